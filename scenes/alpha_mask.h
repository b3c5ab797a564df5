// SPDX-License-Identifier: Apache-2.0
// Alpha masks: materials that the alpha of their texture cuts out, each texel opaque or not. The
// G-buffer, maps, exact rays and Embree's filter all use this one source, so that they have the
// same holes; voxels are made from it conservatively (voxel/cut_voxels.h). Source: Khronos, glTF
// 2.0 specification, sec. 3.9.4 (alphaMode MASK), 3.8.4 (wrap modes).
//
// A texel is opaque or not as a whole: alpha is compared with the cutoff at texel centres, and the
// nearest texel decides. A bilinear outline would be smoother by up to half a texel; but texels are
// rectangles, so the test of a voxel for an opaque point is exact, and one bit per texel is enough.
#pragma once

#include "cuda/view.h"
#include "scenes/alpha_mask_leaf.h"

#include <glm/glm.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace shadowdag {

/// The continuation beyond the texture's borders.
enum class MaskWrap : uint32_t { kRepeat = kMaskRepeat, kMirror = kMaskMirror, kClamp };

/// The opaque texels of one texture.
/// words: maskRowWords(width) * height; texel (x, y) is bit x & 31 of word y * rowWords + (x >> 5),
/// 1 opaque; row 0 lies at v = 0.
struct AlphaMask {
    uint32_t width = 1, height = 1;
    MaskWrap wrapU = MaskWrap::kRepeat, wrapV = MaskWrap::kRepeat;
    std::vector<uint32_t> words;

    bool operator==(const AlphaMask&) const = default;
    bool isOpaque(uint32_t x, uint32_t y) const;
    /// Returns whether every texel is opaque: such a mask cuts nothing.
    bool isAllOpaque() const;
};

/// Wider or higher textures, and those of more than kMaxMaskTexels, are refused.
constexpr uint32_t kMaxMaskSide = 16384;
constexpr uint64_t kMaxMaskTexels = uint64_t(1) << 26;

/// Returns a mask without an opaque texel.
AlphaMask makeAlphaMask(uint32_t width, uint32_t height, MaskWrap wrapU = MaskWrap::kRepeat,
                        MaskWrap wrapV = MaskWrap::kRepeat);
/// Makes a texel opaque.
void setOpaque(AlphaMask& mask, uint32_t x, uint32_t y);

/// A mask on a backend; its words start at `firstWord` of those of all masks.
struct MaskInfo {
    uint32_t firstWord, width, height;
    MaskWrap wrapU, wrapV;
};

/// A triangle that a mask cuts: the texture coordinates of its corners.
struct CutTriangle {
    uint32_t mask;
    glm::vec2 uv[3];
};

/// Returns the texel of an axis of `size` for a whole number of texels. NaN: 0.
SDAG_HD inline uint32_t maskTexel(double texel, uint32_t size, MaskWrap wrap) {
    return maskTexel(texel, size, uint32_t(wrap));
}

/// The masks of a world's triangles on one backend; empty where nothing is cut.
/// triangleCut: triangleCount, index into cuts or kNotCut, or empty: no triangle is cut. cuts: in
/// no stated order, shared by instances. masks, words: see AlphaMask.
struct AlphaMaskView {
    View<const uint32_t> triangleCut;
    View<const CutTriangle> cuts;
    View<const MaskInfo> masks;
    View<const uint32_t> words;

    /// Returns whether a mask cuts a triangle: one test in scenes without cut triangles, one more
    /// load in others.
    SDAG_HD bool isCut(size_t triangle) const {
        return !triangleCut.empty() && triangleCut[triangle] != kNotCut;
    }

    /// Returns whether a cut triangle is opaque at the point with these weights of its corners, in
    /// any common unit and sign, not all 0. Weights that rounding put past an edge count as on it.
    SDAG_HD bool isOpaque(size_t triangle, double weight0, double weight1, double weight2) const {
        const CutTriangle& cut = cuts[triangleCut[triangle]];
        double b1, b2;
        unitWeights(weight0, weight1, weight2, b1, b2);
        const MaskInfo info = masks[cut.mask];
        const uint32_t x = maskTexelAt(cut.uv[0].x, cut.uv[1].x, cut.uv[2].x, b1, b2, info.width,
                                       uint32_t(info.wrapU));
        const uint32_t y = maskTexelAt(cut.uv[0].y, cut.uv[1].y, cut.uv[2].y, b1, b2, info.height,
                                       uint32_t(info.wrapV));
        const uint32_t word = words[info.firstWord + size_t(y) * maskRowWords(info.width) + x / 32];
        return (word >> (x & 31u) & 1u) != 0;
    }
};

/// Owns the masks of triangles on the host.
struct AlphaMaskSet {
    std::vector<uint32_t> triangleCut;
    std::vector<CutTriangle> cuts;
    std::vector<MaskInfo> masks;
    std::vector<uint32_t> words;

    AlphaMaskSet() = default;
    /// Copies what a view on the host shows.
    explicit AlphaMaskSet(const AlphaMaskView& view);

    /// Appends a mask; returns its index.
    uint32_t add(const AlphaMask& mask);
    AlphaMaskView view() const {
        return {viewOf(triangleCut), viewOf(cuts), viewOf(masks), viewOf(words)};
    }
    /// Returns a hash of one mask's content, whatever its index.
    std::array<uint8_t, 16> contentHash(uint32_t mask) const;
};

} // namespace shadowdag
