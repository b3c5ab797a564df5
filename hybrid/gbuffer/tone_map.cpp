// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/tone_map.h"

#include "cuda/parallel_for.h"

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
    double sum = 0;
    size_t count = 0;
    for (const glm::vec3& p : linear) {
        const double luminance = 0.2126 * p.x + 0.7152 * p.y + 0.0722 * p.z;
        if (!(luminance > 0.0) || !std::isfinite(luminance))
            continue;
        sum += std::log(luminance);
        ++count;
    }
    return count ? float(0.18 / std::exp(sum / double(count))) : 1.0f;
}

} // namespace shadowdag
