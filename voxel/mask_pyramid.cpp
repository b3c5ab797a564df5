// SPDX-License-Identifier: Apache-2.0
#include "voxel/mask_pyramid.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

bool bitOf(const std::vector<uint32_t>& bits, uint32_t width, uint32_t x, uint32_t y) {
    return (bits[size_t(y) * maskRowWords(width) + x / 32] >> (x & 31u) & 1u) != 0;
}

} // namespace

MaskPyramid::MaskPyramid(const MaskInfo& info, View<const uint32_t> words)
    : width_(info.width), height_(info.height), wrapU_(info.wrapU), wrapV_(info.wrapV) {
    const size_t count = size_t(maskRowWords(width_)) * height_;
    const uint32_t* const first = words.data + info.firstWord;
    SDAG_ASSERT(info.firstWord + count <= words.count);
    levels_.push_back({width_, height_, {first, first + count}, {first, first + count}});
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Level& below = levels_.back();
        Level level{(below.width + 1) / 2, (below.height + 1) / 2, {}, {}};
        const uint32_t rowWords = maskRowWords(level.width);
        level.any.assign(size_t(rowWords) * level.height, 0u);
        level.all = level.any;
        for (uint32_t y = 0; y < level.height; ++y)
            for (uint32_t x = 0; x < level.width; ++x) {
                bool any = false, all = true;
                for (uint32_t cy = 2 * y; cy < std::min(2 * y + 2, below.height); ++cy)
                    for (uint32_t cx = 2 * x; cx < std::min(2 * x + 2, below.width); ++cx) {
                        any |= bitOf(below.any, below.width, cx, cy);
                        all &= bitOf(below.all, below.width, cx, cy);
                    }
                const size_t word = size_t(y) * rowWords + x / 32;
                level.any[word] |= uint32_t(any) << (x & 31u);
                level.all[word] |= uint32_t(all) << (x & 31u);
            }
        levels_.push_back(std::move(level));
    }
}

// Writes the texels of an axis that [least, most] touches as up to three runs, and returns how
// many: a run that wraps has two, one that is mirrored at both borders three.
int MaskPyramid::fold(double least, double most, uint32_t size, MaskWrap wrap, Span spans[3]) {
    const double n = double(size);
    double first = std::floor(least), last = std::floor(most);
    const Span whole{0, size - 1};
    if (wrap == MaskWrap::kClamp) {
        spans[0] = {uint32_t(std::clamp(first, 0.0, n - 1.0)),
                    uint32_t(std::clamp(last, 0.0, n - 1.0))};
        return 1;
    }
    const double period = wrap == MaskWrap::kRepeat ? n : 2.0 * n;
    if (!(last - first < period - 1.0)) {
        spans[0] = whole;
        return 1;
    }
    const double shift = std::floor(first / period) * period;
    first = std::max(first - shift, 0.0);
    last = std::max(last - shift, first);
    int count = 0;
    for (double start = 0.0; start <= last && count < 3; start += n) { // one tile of the texture
        const double a = std::max(first, start) - start,
                     b = std::min(last, start + n - 1.0) - start;
        if (a > b)
            continue;
        const bool isMirrored = wrap == MaskWrap::kMirror && (start == n || start == 3.0 * n);
        spans[count++] = isMirrored ? Span{uint32_t(n - 1.0 - b), uint32_t(n - 1.0 - a)}
                                    : Span{uint32_t(a), uint32_t(b)};
    }
    return count;
}

void MaskPyramid::gather(size_t level, uint32_t x, uint32_t y, const Span& xs, const Span& ys,
                         bool& any, bool& all) const {
    const Level& here = levels_[level];
    const uint32_t x0 = x << level, y0 = y << level;
    const uint32_t x1 = std::min(((x + 1) << level) - 1, width_ - 1);
    const uint32_t y1 = std::min(((y + 1) << level) - 1, height_ - 1);
    if (x0 > xs.last || x1 < xs.first || y0 > ys.last || y1 < ys.first)
        return;
    const bool hasAny = bitOf(here.any, here.width, x, y);
    const bool hasAll = bitOf(here.all, here.width, x, y);
    if (hasAny == hasAll || (x0 >= xs.first && x1 <= xs.last && y0 >= ys.first && y1 <= ys.last)) {
        any |= hasAny;
        all &= hasAll;
        return;
    }
    const Level& below = levels_[level - 1];
    for (uint32_t cy = 2 * y; cy < std::min(2 * y + 2, below.height); ++cy)
        for (uint32_t cx = 2 * x; cx < std::min(2 * x + 2, below.width); ++cx)
            if (!any || all) // both are settled otherwise
                gather(level - 1, cx, cy, xs, ys, any, all);
}

MaskCover MaskPyramid::cover(const glm::dvec2& least, const glm::dvec2& most) const {
    if (!(least.x <= most.x && least.y <= most.y))
        return MaskCover::kSome;
    Span xs[3], ys[3];
    const int xCount = fold(least.x, most.x, width_, wrapU_, xs);
    const int yCount = fold(least.y, most.y, height_, wrapV_, ys);
    bool any = false, all = true;
    for (int i = 0; i < xCount; ++i)
        for (int j = 0; j < yCount; ++j)
            gather(levels_.size() - 1, 0, 0, xs[i], ys[j], any, all);
    return all && any ? MaskCover::kAll : any ? MaskCover::kSome : MaskCover::kNone;
}

} // namespace shadowdag
