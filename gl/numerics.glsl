// SPDX-License-Identifier: Apache-2.0
// Arithmetic as the processor does it (-ffp-contract=off, IEEE). GLSL promises neither fma() in one
// rounding nor exact quotients; where the device was seen not to give them (gl/numerics.h), doubles
// do: the product of two floats is exact there, and rounding twice differs from rounding once a few
// times in 2^29.

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

// Sums from the left, as the vector library on the processor does.
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
