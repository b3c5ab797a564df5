// SPDX-License-Identifier: Apache-2.0
// What a rectangle of an alpha mask holds: nothing, something or only what is opaque. Exact, texel
// by texel; a pyramid of bits spares most of them.
#pragma once

#include "scenes/alpha_mask.h"

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// What is opaque of the texels that a rectangle touches.
enum class MaskCover : uint8_t { kNone, kSome, kAll };

/// One mask, read as its wrap modes say.
class MaskPyramid {
public:
    /// @param words those of all masks, from info.firstWord on
    MaskPyramid(const MaskInfo& info, View<const uint32_t> words);

    /// Returns the cover of the texels that the closed rectangle touches, in texels (texture
    /// coordinates times the size) before wrapping. A rectangle that holds no finite point: kSome.
    MaskCover cover(const glm::dvec2& least, const glm::dvec2& most) const;
    glm::dvec2 size() const { return {double(width_), double(height_)}; }

private:
    struct Level {
        uint32_t width, height;
        std::vector<uint32_t> any, all; ///< rows as AlphaMask's; below a cell: any, all opaque
    };
    struct Span {
        uint32_t first, last;
    };
    static int fold(double least, double most, uint32_t size, MaskWrap wrap, Span spans[3]);
    void gather(size_t level, uint32_t x, uint32_t y, const Span& xs, const Span& ys, bool& any,
                bool& all) const;

    uint32_t width_, height_;
    MaskWrap wrapU_, wrapV_;
    std::vector<Level> levels_; ///< 0: the texels themselves; the last: one cell
};

} // namespace shadowdag
