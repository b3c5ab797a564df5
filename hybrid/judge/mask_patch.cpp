// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/mask_patch.h"

#include "hybrid/judge/exact_sign.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr double kMostTexels = 4096;

struct Range {
    double low = std::numeric_limits<double>::infinity(),
           high = -std::numeric_limits<double>::infinity();
    void add(double value, double error) {
        low = std::min(low, value - error);
        high = std::max(high, value + error);
    }
};

/// Returns the texel of an axis under its wrap mode.
int64_t wrapped(int64_t texel, int64_t size, MaskWrap wrap) {
    const int64_t period = wrap == MaskWrap::kMirror ? 2 * size : size;
    if (wrap == MaskWrap::kClamp)
        return std::clamp<int64_t>(texel, 0, size - 1);
    const int64_t inPeriod = (texel % period + period) % period;
    return inPeriod < size ? inPeriod : 2 * size - 1 - inPeriod;
}

/// The whole texels of one axis that a range of coordinates meets, of those of the triangle.
struct Texels {
    double first, last;

    Texels(const float (&t)[3], const Range& coordinate, uint32_t size) {
        const double n = double(size);
        const double least = double(std::min({t[0], t[1], t[2]})) * n;
        const double most = double(std::max({t[0], t[1], t[2]})) * n;
        const double from = std::floor(least), to = std::max(std::ceil(most) - 1.0, from);
        first = std::clamp(std::floor(coordinate.low * n), from, to);
        last = std::clamp(std::floor(coordinate.high * n), from, to);
    }
};

} // namespace

MaskPatch maskPatch(const TriangleView& triangles, uint32_t triangle, const SegmentFamily& family) {
    const AlphaMaskView& masks = triangles.masks;
    if (masks.triangleCut.empty() || masks.triangleCut[triangle] == kNotCut)
        return MaskPatch::kOpaque;
    const CutTriangle& cut = masks.cuts[masks.triangleCut[triangle]];
    const MaskInfo& mask = masks.masks[cut.mask];
    glm::dvec3 v[3];
    for (int i = 0; i < 3; ++i)
        v[i] = glm::dvec3(triangles.vertex(triangle, i));
    // A weight is a quotient of functions that are linear in each coordinate of both ends, with a
    // denominator of one sign: its extremes lie at corners of the boxes.
    Range weight[3];
    int side[2] = {0, 0};
    for (int corner = 0; corner < 8; ++corner)
        for (int end = 0; end < 2; ++end) {
            const PointBox& box = end == 0 ? family.start : family.end;
            const int here = orientation(v[0], v[1], v[2], box.corner(corner));
            if (here == 0 || (corner > 0 && here != side[end]))
                return MaskPatch::kMixed;
            side[end] = here;
        }
    if (side[0] == side[1])
        return MaskPatch::kMixed;
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            const glm::dvec3 a = family.start.corner(i), b = family.end.corner(j);
            BoundedDeterminant det[3];
            double sum = 0, error = 0;
            for (int k = 0; k < 3; ++k) {
                det[k] = boundedOrientation(a, b, v[(k + 1) % 3], v[(k + 2) % 3]);
                sum += det[k].value;
                error += det[k].error;
            }
            if (!(std::fabs(sum) > 4.0 * error))
                return MaskPatch::kMixed;
            for (int k = 0; k < 3; ++k)
                weight[k].add(det[k].value / sum, 4.0 * error / std::fabs(sum));
        }
    Range coordinate[2];
    for (int axis = 0; axis < 2; ++axis) {
        // Linear in the two free weights: at a corner of their ranges.
        const double t0 = double(cut.uv[0][axis]), t1 = double(cut.uv[1][axis]) - t0,
                     t2 = double(cut.uv[2][axis]) - t0;
        for (const double w1 : {weight[1].low, weight[1].high})
            for (const double w2 : {weight[2].low, weight[2].high})
                coordinate[axis].add(t0 + w1 * t1 + w2 * t2,
                                     0x1p-44 * (std::fabs(t0) + std::fabs(t1) + std::fabs(t2)));
    }
    const float u[3] = {cut.uv[0].x, cut.uv[1].x, cut.uv[2].x},
                w[3] = {cut.uv[0].y, cut.uv[1].y, cut.uv[2].y};
    const Texels columns(u, coordinate[0], mask.width), rows(w, coordinate[1], mask.height);
    if (!((columns.last - columns.first + 1.0) * (rows.last - rows.first + 1.0) <= kMostTexels) ||
        std::fabs(columns.first) > 0x1p52 || std::fabs(rows.first) > 0x1p52)
        return MaskPatch::kMixed;
    bool isOpaque = false, isOpen = false;
    const size_t rowWords = (mask.width + 31) / 32;
    for (auto y = int64_t(rows.first); y <= int64_t(rows.last); ++y)
        for (auto x = int64_t(columns.first); x <= int64_t(columns.last); ++x) {
            const auto column = size_t(wrapped(x, mask.width, mask.wrapU)),
                       row = size_t(wrapped(y, mask.height, mask.wrapV));
            const uint32_t word = masks.words[mask.firstWord + row * rowWords + column / 32];
            (word >> (column % 32) & 1u ? isOpaque : isOpen) = true;
        }
    return isOpaque && isOpen ? MaskPatch::kMixed
           : isOpaque         ? MaskPatch::kOpaque
                              : MaskPatch::kOpen;
}

} // namespace shadowdag
