// SPDX-License-Identifier: Apache-2.0
// A compute shader and the CPU compute the same expressions on numbers from a seeded generator.
#include "gl/numerics.h"

#include "gl/buffer.h"
#include "gl/program.h"

#include <bit>
#include <cmath>
#include <vector>

namespace shadowdag {

namespace {

constexpr uint32_t kCount = 1024; // enough to detect a quotient that rounds wrongly once in ten

// Floats with random mantissas and exponents near 1.
float randomFloat(uint32_t& state) {
    state = state * 1664525u + 1013904223u;
    const uint32_t exponent = 120u + (state >> 28);
    return std::bit_cast<float>((state & 0x80000000u) | exponent << 23 | (state >> 5 & 0x7fffffu));
}

} // namespace

GlNumerics probeGlNumerics() {
    constexpr const char* kText =
        "layout(local_size_x = 64) in;\n"
        "layout(std430, binding = 0) readonly buffer Given { vec4 given[]; };\n"
        "layout(std430, binding = 1) writeonly buffer Found { vec2 found[]; };\n"
        "void main() {\n"
        "    vec4 g = given[gl_GlobalInvocationID.x];\n"
        "    precise float sum = fma(g.x, g.y, g.z);\n"
        "    precise float quotient = g.x / g.w;\n"
        "    found[gl_GlobalInvocationID.x] = vec2(sum, quotient);\n"
        "}\n";
    const GlProgram program("numerics", {{GlStage::kCompute, "numerics.comp"}},
                            {{"numerics.comp", kText}});
    std::vector<float> given;
    uint32_t state = 1;
    for (uint32_t i = 0; i < kCount; ++i) {
        const float a = randomFloat(state), b = randomFloat(state), w = randomFloat(state);
        // Near the product's negative, so that the sum is the product's rounding error.
        given.insert(given.end(), {a, b, -(a * b), w});
    }
    GlBuffer in("numerics given"), out("numerics found");
    in.upload(given);
    out.resize(kCount * 2 * sizeof(float));
    in.bindStorage(0);
    out.bindStorage(1);
    program.dispatch(kCount / 64);
    const std::vector<float> found = out.download<float>();
    GlNumerics result{true, true};
    for (uint32_t i = 0; i < kCount; ++i) {
        const float* g = &given[4 * i];
        result.hasFusedMultiplyAdd &= found[2 * i] == std::fmaf(g[0], g[1], g[2]);
        result.hasExactDivision &= found[2 * i + 1] == g[0] / g[3];
    }
    return result;
}

} // namespace shadowdag
