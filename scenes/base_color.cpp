// SPDX-License-Identifier: Apache-2.0
#include "scenes/base_color.h"

#include "cuda/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace shadowdag {

namespace {

/// Returns the code whose linear value is nearest.
uint32_t srgbFromLinear(float value) {
    static const std::array<float, 255> kBetween = [] {
        std::array<float, 255> between{};
        for (size_t i = 0; i < between.size(); ++i)
            between[i] = 0.5f * (linearFromSrgb()[i] + linearFromSrgb()[i + 1]);
        return between;
    }();
    return uint32_t(std::upper_bound(kBetween.begin(), kBetween.end(), value) - kBetween.begin());
}

/// A level of a texture in linear light.
struct LinearLevel {
    uint32_t width = 0, height = 0;
    std::vector<glm::vec3> colors;
};

/// The share of `whole` elements of an axis in element `index` of `part`: those from first to last,
/// of which the outer ones may be included in part.
struct AxisShare {
    uint32_t first, last;
    float weightOf(uint32_t i) const {
        return i == first ? firstWeight : i == last ? lastWeight : 1;
    }
    float firstWeight, lastWeight;
};

AxisShare shareOf(uint32_t index, uint32_t part, uint32_t whole) {
    const double size = double(whole) / double(part);
    const double from = double(index) * size, to = double(index + 1) * size;
    AxisShare share{};
    share.first = uint32_t(from);
    share.last = std::min(uint32_t(std::ceil(to)), whole) - 1;
    share.firstWeight = float(std::min(double(share.first + 1), to) - from);
    share.lastWeight = float(to - double(share.last));
    return share;
}

/// Returns the area average of a level of which `colorAt` returns the colours.
template <class ColorAt>
LinearLevel halved(uint32_t width, uint32_t height, const ColorAt& colorAt) {
    LinearLevel half{std::max(width / 2, 1u), std::max(height / 2, 1u), {}};
    half.colors.resize(size_t(half.width) * half.height);
    cpuParallelRanges(half.height, 16, [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) {
            const AxisShare rows = shareOf(uint32_t(y), half.height, height);
            for (uint32_t x = 0; x < half.width; ++x) {
                const AxisShare columns = shareOf(x, half.width, width);
                glm::vec3 sum(0.0f);
                float weight = 0.0f;
                for (uint32_t sy = rows.first; sy <= rows.last; ++sy)
                    for (uint32_t sx = columns.first; sx <= columns.last; ++sx) {
                        const float share = rows.weightOf(sy) * columns.weightOf(sx);
                        sum += colorAt(sx, sy) * share;
                        weight += share;
                    }
                half.colors[y * half.width + x] = sum / weight;
            }
        }
    });
    return half;
}

} // namespace

const std::vector<float>& linearFromSrgb() {
    static const std::vector<float> kLinear = [] {
        std::vector<float> linear(256);
        for (size_t i = 0; i < linear.size(); ++i) {
            const double code = double(i) / 255.0;
            linear[i] =
                float(code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4));
        }
        return linear;
    }();
    return kLinear;
}

uint32_t TextureSet::add(const ColorImage& image, MaskWrap wrapU, MaskWrap wrapV, bool isNearest) {
    SDAG_ASSERT(image.width >= 1 && image.height >= 1);
    SDAG_ASSERT(image.rgb.size() == size_t(3) * image.width * image.height);
    const size_t first = texels.size();
    textures.push_back(
        {uint32_t(first), image.width, image.height, wrapU, wrapV, uint32_t(isNearest)});
    const size_t count = size_t(image.width) * image.height;
    texels.resize(first + count);
    for (size_t i = 0; i < count; ++i)
        texels[first + i] = uint32_t(image.rgb[3 * i]) | uint32_t(image.rgb[3 * i + 1]) << 8 |
                            uint32_t(image.rgb[3 * i + 2]) << 16;

    const std::vector<float>& linear = linearFromSrgb();
    LinearLevel level{image.width, image.height, {}};
    while (level.width > 1 || level.height > 1) {
        level = level.colors.empty()
                    ? halved(level.width, level.height,
                             [&](uint32_t x, uint32_t y) {
                                 const uint8_t* c = &image.rgb[3 * (size_t(y) * image.width + x)];
                                 return glm::vec3(linear[c[0]], linear[c[1]], linear[c[2]]);
                             })
                    : halved(level.width, level.height, [&](uint32_t x, uint32_t y) {
                          return level.colors[size_t(y) * level.width + x];
                      });
        const size_t begin = texels.size();
        texels.resize(begin + level.colors.size());
        cpuParallelRanges(level.colors.size(), 4096, [&](size_t from, size_t to) {
            for (size_t i = from; i < to; ++i) {
                const glm::vec3& c = level.colors[i];
                texels[begin + i] =
                    srgbFromLinear(c.x) | srgbFromLinear(c.y) << 8 | srgbFromLinear(c.z) << 16;
            }
        });
    }
    SDAG_ASSERT(texels.size() <= 0xffffffffu);
    return uint32_t(textures.size() - 1);
}

} // namespace shadowdag
