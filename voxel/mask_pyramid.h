// SPDX-License-Identifier: Apache-2.0
// Returns whether a rectangle of an alpha mask contains opaque texels: none, some or only opaque
// ones. Exact to the texel; a pyramid of bits avoids reading most texels.
#pragma once

#include "scenes/alpha_mask.h"

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// How much of a rectangle's texels is opaque.
enum class MaskCover : uint8_t { kNone, kSome, kAll };

/// One level of a mask's pyramid, with rows as in AlphaMask. A bit summarizes the texels below it:
/// any opaque, or all opaque.
struct MaskLevel {
    uint32_t width, height;
    uint32_t firstAny, firstAll; ///< into the words of all pyramids
};

/// The pyramid of one mask on a backend, read as its wrap modes say.
struct MaskPyramidView {
    uint32_t width = 0, height = 0; ///< 0: there is none
    MaskWrap wrapU = MaskWrap::kRepeat, wrapV = MaskWrap::kRepeat;
    View<const MaskLevel> levels; ///< 0: the texels themselves; the last: one cell
    View<const uint32_t> words;

    /// Returns the cover of the texels that the closed rectangle touches, in texels (texture
    /// coordinates times the size) before wrapping. A rectangle that holds no finite point: kSome.
    SDAG_HD MaskCover cover(const glm::dvec2& least, const glm::dvec2& most) const {
        if (!(least.x <= most.x && least.y <= most.y))
            return MaskCover::kSome;
        Span xs[3], ys[3];
        const int xCount = fold(least.x, most.x, width, wrapU, xs);
        const int yCount = fold(least.y, most.y, height, wrapV, ys);
        bool any = false, all = true;
        for (int i = 0; i < xCount; ++i)
            for (int j = 0; j < yCount; ++j)
                gather(xs[i], ys[j], any, all);
        return all && any ? MaskCover::kAll : any ? MaskCover::kSome : MaskCover::kNone;
    }
    SDAG_HD glm::dvec2 size() const { return {double(width), double(height)}; }
    SDAG_HD bool empty() const { return width == 0; }

private:
    struct Span {
        uint32_t first, last;
    };
    struct Cell {
        uint32_t level, x, y;
    };
    /// Levels of a mask at most: 2^14 texels a side (kMaxMaskSide), and the one cell on top.
    static constexpr uint32_t kMaxLevels = 15;

    SDAG_HD bool bitAt(uint32_t first, uint32_t levelWidth, uint32_t x, uint32_t y) const {
        return (words[first + size_t(y) * maskRowWords(levelWidth) + x / 32] >> (x & 31u) & 1u) !=
               0;
    }
    SDAG_HD static double within(double x, double lo, double hi) {
        return x < lo ? lo : hi < x ? hi : x;
    }
    SDAG_HD static uint32_t lesserOf(uint32_t a, uint32_t b) { return a < b ? a : b; }

    /// Writes the texels of an axis that [least, most] touches as up to three runs, and returns how
    /// many: a run that wraps has two, one that is mirrored at both borders three.
    SDAG_HD static int fold(double least, double most, uint32_t size, MaskWrap wrap,
                            Span spans[3]) {
        const double n = double(size);
        double first = floor(least), last = floor(most);
        if (wrap == MaskWrap::kClamp) {
            spans[0] = {uint32_t(within(first, 0.0, n - 1.0)),
                        uint32_t(within(last, 0.0, n - 1.0))};
            return 1;
        }
        const double period = wrap == MaskWrap::kRepeat ? n : 2.0 * n;
        if (!(last - first < period - 1.0)) {
            spans[0] = {0, size - 1};
            return 1;
        }
        const double shift = floor(first / period) * period;
        first = first - shift > 0.0 ? first - shift : 0.0;
        last = last - shift > first ? last - shift : first;
        int count = 0;
        for (double start = 0.0; start <= last && count < 3;
             start += n) { // one period of the texture
            const double a = (first > start ? first : start) - start;
            const double b = (last < start + n - 1.0 ? last : start + n - 1.0) - start;
            if (a > b)
                continue;
            const bool isMirrored = wrap == MaskWrap::kMirror && (start == n || start == 3.0 * n);
            spans[count++] = isMirrored ? Span{uint32_t(n - 1.0 - b), uint32_t(n - 1.0 - a)}
                                        : Span{uint32_t(a), uint32_t(b)};
        }
        return count;
    }

    /// Descends from the top to cells that are uniform or completely inside the rectangle.
    SDAG_HD void gather(const Span& xs, const Span& ys, bool& any, bool& all) const {
        Cell open[3 * kMaxLevels +
                  1]; // three wait on every level, and the descent continues with the last
        int count = 0;
        open[count++] = {uint32_t(levels.count) - 1, 0, 0};
        while (count > 0 && (!any || all)) { // both are settled otherwise
            const Cell cell = open[--count];
            const MaskLevel here = levels[cell.level];
            const uint32_t x0 = cell.x << cell.level, y0 = cell.y << cell.level;
            const uint32_t x1 = lesserOf(((cell.x + 1) << cell.level) - 1, width - 1);
            const uint32_t y1 = lesserOf(((cell.y + 1) << cell.level) - 1, height - 1);
            if (x0 > xs.last || x1 < xs.first || y0 > ys.last || y1 < ys.first)
                continue;
            const bool hasAny = bitAt(here.firstAny, here.width, cell.x, cell.y);
            const bool hasAll = bitAt(here.firstAll, here.width, cell.x, cell.y);
            if (hasAny == hasAll ||
                (x0 >= xs.first && x1 <= xs.last && y0 >= ys.first && y1 <= ys.last)) {
                any = any || hasAny;
                all = all && hasAll;
                continue;
            }
            const MaskLevel below = levels[cell.level - 1];
            for (uint32_t c = 4; c-- > 0;) {
                const uint32_t x = 2 * cell.x + (c & 1), y = 2 * cell.y + (c >> 1);
                if (x < below.width && y < below.height)
                    open[count++] = {cell.level - 1, x, y};
            }
        }
    }
};

/// The position of one mask's pyramid among all.
struct MaskPyramidInfo {
    uint32_t width, height;
    MaskWrap wrapU, wrapV;
    uint32_t firstLevel, levelCount;
};

/// The pyramids of all masks on one backend.
struct MaskPyramidsView {
    View<const MaskPyramidInfo> masks;
    View<const MaskLevel> levels;
    View<const uint32_t> words;

    SDAG_HD MaskPyramidView operator[](size_t mask) const {
        const MaskPyramidInfo& info = masks[mask];
        return {info.width,
                info.height,
                info.wrapU,
                info.wrapV,
                View<const MaskLevel>{levels.data + info.firstLevel, info.levelCount},
                words};
    }
};

/// Owns the pyramids of all masks on the host.
class MaskPyramids {
public:
    MaskPyramids() = default;
    /// @param words those of all masks. Throws Error kResource when the pyramids need 2^32 words.
    MaskPyramids(View<const MaskInfo> masks, View<const uint32_t> words);

    MaskPyramidsView view() const { return {viewOf(masks), viewOf(levels), viewOf(words)}; }

    std::vector<MaskPyramidInfo> masks;
    std::vector<MaskLevel> levels;
    std::vector<uint32_t> words;
};

} // namespace shadowdag
