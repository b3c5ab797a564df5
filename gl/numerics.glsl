// SPDX-License-Identifier: Apache-2.0
// Arithmetic with the results of the CPU (-ffp-contract=off, IEEE). GLSL guarantees neither that fma()
// rounds once nor that quotients are correctly rounded. Where a test of the device failed
// (gl/numerics.h), doubles are used: they hold the product of two floats exactly, and rounding twice
// differs from rounding once in a few of 2^29 cases.

float fusedMultiplyAdd(float a, float b, float c) {
#ifdef SDAG_FUSED_MULTIPLY_ADD
    precise float sum = fma(a, b, c);
#else
    precise double sum = double(a) * double(b) + double(c);
#endif
    return float(sum);
}

float quotient(float a, float b) {
#ifdef SDAG_EXACT_DIVISION
    precise float q = a / b;
#else
    precise double q = double(a) / double(b);
#endif
    return float(q);
}

// Adds from left to right, as GLM does on the CPU.
float dotInOrder(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

double dotInOrder(dvec3 a, dvec3 b) {
    precise double sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

dvec3 crossInOrder(dvec3 a, dvec3 b) {
    precise dvec3 c = dvec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
    return c;
}
