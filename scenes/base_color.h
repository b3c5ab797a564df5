// SPDX-License-Identifier: Apache-2.0
// Base colour textures of materials, for pictures: they scale the albedo in shading and change
// nothing that decides visibility. Texels are decoded from sRGB before they are filtered. Source:
// Khronos, glTF 2.0 specification, sec. 3.8.4 (samplers), 3.9.2 (baseColorTexture); Williams,
// Pyramidal Parametrics, SIGGRAPH 1983 (levels); Khronos, EXT_texture_filter_anisotropic (probes).
#pragma once

#include "cuda/view.h"
#include "scenes/alpha_mask.h"
#include "scenes/color_image.h"

#include <glm/glm.hpp>

#include <bit>
#include <cstdint>
#include <vector>

namespace shadowdag {

/// Marks a material without a base colour texture.
constexpr uint32_t kNoTexture = 0xffffffffu;
/// All textures of a scene have at most this many texels: 1 GiB, and a third more for their smaller
/// levels. The indices of texels are then below 2^32.
constexpr uint64_t kMaxSceneTexels = uint64_t(1) << 28;

/// A texture among those of a scene. Level 0 begins at firstTexel, row 0 at v = 0; the next level
/// follows each, with half the width and height, rounded down but at least 1, up to 1 x 1.
struct TextureInfo {
    uint32_t firstTexel, width, height;
    MaskWrap wrapU, wrapV;
    uint32_t isNearest; ///< 1: magnified texels have sharp edges

    bool operator==(const TextureInfo&) const = default;
};

/// Owns the textures of a scene, with all levels.
/// texels: bits 0..7 red, 8..15 green, 16..23 blue, as sRGB; the rest 0.
struct TextureSet {
    std::vector<TextureInfo> textures;
    std::vector<uint32_t> texels;

    /// Appends a texture and its levels, each the area average of the linear light of the one
    /// before; returns its index. Texels may not exceed kMaxSceneTexels. Needs three temporary
    /// bytes per texel.
    uint32_t add(const ColorImage& image, MaskWrap wrapU, MaskWrap wrapV, bool isNearest);
    bool operator==(const TextureSet&) const = default;
};

/// Returns the linear value of each of the 256 codes of sRGB; 0 and 1 are exact. Source: IEC
/// 61966-2-1.
const std::vector<float>& linearFromSrgb();

/// Returns half the logarithm to base 2, which is that of a length given its square, by linear
/// interpolation between powers of two: at most 0.044 too small, and the same on every processor.
/// Up to 1 and NaN: 0.
SDAG_HD inline double halfLog2(double x) {
    if (!(x > 1.0))
        return 0.0;
    const uint64_t bits = std::bit_cast<uint64_t>(x);
    const double mantissa = double(bits & ((uint64_t(1) << 52) - 1)) * 0x1p-52;
    return 0.5 * (double(int(bits >> 52) - 1023) + mantissa);
}

/// The base colour textures of a world on one backend; empty where it has none.
/// materialTexture: materialCount, index into textures or kNoTexture. instanceUv: instanceCount,
/// what to add to a vertex index of the world, modulo 2^32, for its index into uv; arbitrary for
/// instances without textures. uv: the vertices of the meshes with textures, once each. textures,
/// texels: see TextureSet. linear: linearFromSrgb.
struct BaseColorView {
    View<const uint32_t> materialTexture;
    View<const uint32_t> instanceUv;
    View<const glm::vec2> uv;
    View<const TextureInfo> textures;
    View<const uint32_t> texels;
    View<const float> linear;

    /// Samples of a footprint are averaged over at most this many places along its longer axis.
    static constexpr uint32_t kMaxProbes = 8;

    SDAG_HD bool empty() const { return textures.empty(); }

    /// Returns the linear colour of a texture at a point, filtered over the footprint of a pixel:
    /// bilinear between texels and linear between levels, averaged along the longer of the
    /// footprint's axes, so that grazing surfaces are blurred across it only by more than
    /// kMaxProbes to 1. A texture with isNearest gives its nearest texel where it is magnified.
    /// @param at texture coordinates, finite
    /// @param perX,perY their change from the pixel to its right and lower neighbour; not finite:
    /// the colour of the last level
    SDAG_HD glm::vec3 filtered(const TextureInfo& t, const glm::dvec2& at, const glm::dvec2& perX,
                               const glm::dvec2& perY) const {
        const double xx = texelsSquared(t, perX), yy = texelsSquared(t, perY);
        if (!(xx + yy < 1e300))
            return texel(levelOf(t, lastLevel(t)), 0, 0);
        const bool isAlongX = xx > yy;
        const double most = isAlongX ? xx : yy;
        const double least = glm::max(isAlongX ? yy : xx, 1.0); // smaller ones need no probes
        uint32_t probeCount = 1;
        while (probeCount < kMaxProbes && double(probeCount * probeCount) * least < most)
            ++probeCount;
        const double level = halfLog2(most / double(probeCount * probeCount));
        const glm::dvec2& along = isAlongX ? perX : perY;
        glm::vec3 sum(0.0f);
        for (uint32_t i = 0; i < probeCount; ++i)
            sum += atLevel(t, at + ((double(i) + 0.5) / double(probeCount) - 0.5) * along, level);
        return sum * (1.0f / float(probeCount));
    }

private:
    struct Level {
        uint32_t firstTexel, width, height;
    };

    SDAG_HD static double texelsSquared(const TextureInfo& t, const glm::dvec2& step) {
        const double x = step.x * double(t.width), y = step.y * double(t.height);
        return x * x + y * y;
    }
    SDAG_HD static uint32_t lastLevel(const TextureInfo& t) {
        return uint32_t(std::bit_width(t.width > t.height ? t.width : t.height)) - 1;
    }
    SDAG_HD static Level levelOf(const TextureInfo& t, uint32_t index) {
        Level level{t.firstTexel, t.width, t.height};
        for (uint32_t i = 0; i < index; ++i) {
            level.firstTexel += level.width * level.height;
            level.width = level.width > 1 ? level.width / 2 : 1;
            level.height = level.height > 1 ? level.height / 2 : 1;
        }
        return level;
    }
    SDAG_HD glm::vec3 texel(const Level& level, uint32_t x, uint32_t y) const {
        const uint32_t code = texels[level.firstTexel + size_t(y) * level.width + x];
        return {linear[code & 255u], linear[code >> 8 & 255u], linear[code >> 16 & 255u]};
    }
    SDAG_HD glm::vec3 bilinear(const TextureInfo& t, const Level& level,
                               const glm::dvec2& at) const {
        // Texel i's centre lies at i + 1/2.
        const double u = at.x * double(level.width) - 0.5, v = at.y * double(level.height) - 0.5;
        const double left = glm::floor(u), top = glm::floor(v);
        const float x = float(u - left), y = float(v - top);
        const uint32_t x0 = maskTexel(left, level.width, t.wrapU);
        const uint32_t x1 = maskTexel(left + 1.0, level.width, t.wrapU);
        const uint32_t y0 = maskTexel(top, level.height, t.wrapV);
        const uint32_t y1 = maskTexel(top + 1.0, level.height, t.wrapV);
        const glm::vec3 upper = texel(level, x0, y0) * (1.0f - x) + texel(level, x1, y0) * x;
        const glm::vec3 lower = texel(level, x0, y1) * (1.0f - x) + texel(level, x1, y1) * x;
        return upper * (1.0f - y) + lower * y;
    }
    SDAG_HD glm::vec3 atLevel(const TextureInfo& t, const glm::dvec2& at, double level) const {
        const Level finest = levelOf(t, 0);
        if (level <= 0.0 && t.isNearest)
            return texel(finest, maskTexel(glm::floor(at.x * double(t.width)), t.width, t.wrapU),
                         maskTexel(glm::floor(at.y * double(t.height)), t.height, t.wrapV));
        if (level <= 0.0)
            return bilinear(t, finest, at);
        const uint32_t last = lastLevel(t);
        if (level >= double(last))
            return bilinear(t, levelOf(t, last), at);
        const uint32_t finer = uint32_t(level);
        const float toCoarser = float(level - double(finer));
        return bilinear(t, levelOf(t, finer), at) * (1.0f - toCoarser) +
               bilinear(t, levelOf(t, finer + 1), at) * toCoarser;
    }
};

} // namespace shadowdag
