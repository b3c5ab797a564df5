// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/tone_map.h"

#include "cuda/parallel_for.h"
#include "scenes/light.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {
namespace {

float filmic(float x) {
    return x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
}

float display(float linear, float exposure) {
    const float x = linear * exposure;
    if (!(x > 0.0f)) // NaN as well
        return 0.0f;
    // Past 1e4 the curve is 2.51 / 2.43 > 1 and infinity would give NaN.
    return srgbFromLinear(std::clamp(filmic(std::min(x, 1e4f)), 0.0f, 1.0f));
}

} // namespace

float srgbFromLinear(float linear) {
    if (linear >= 1.0f) // the formula gives an ulp less
        return 1.0f;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linearFromSrgb(float srgb) {
    return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
}

std::vector<glm::vec3> toneMap(const std::vector<glm::vec3>& linear, float exposure) {
    std::vector<glm::vec3> shown(linear.size());
    cpuParallelRanges(linear.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            for (int c = 0; c < 3; ++c)
                shown[i][c] = display(linear[i][c], exposure);
    });
    return shown;
}

float autoExposure(const std::vector<glm::vec3>& linear) {
    std::vector<float> lit, any;
    for (const glm::vec3& p : linear) {
        const float luminance = 0.2126f * p.x + 0.7152f * p.y + 0.0722f * p.z;
        if (!(luminance > 0.0f) || !std::isfinite(luminance))
            continue;
        any.push_back(luminance);
        if (luminance > kAmbientRadiance)
            lit.push_back(luminance);
    }
    std::vector<float>& of = lit.empty() ? any : lit;
    if (of.empty())
        return 1.0f;
    const auto middle = of.begin() + std::ptrdiff_t(of.size() / 2);
    std::nth_element(of.begin(), middle, of.end());
    return 0.18f / *middle;
}

} // namespace shadowdag
