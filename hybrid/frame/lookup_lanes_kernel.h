// SPDX-License-Identifier: Apache-2.0
// filterVisibility over the taps of a cube map (shadowmap/shadow_map_lookup.h) for V::kWidth
// receivers at once: the same operations in the same order, so the same bits. Receivers whose
// filter leaves the face, or omits all taps, are left to the one text. Only lookup_lanes_*.cpp
// include it, each compiled for its processor; nothing inline of other headers is used.
#pragma once

#include "hybrid/frame/lookup_lanes_work.h"

namespace shadowdag::stream {
namespace {

/// The receivers of one vector, as CubeReceiver has them; planes in the frame of the face.
template <class V> struct ReceiverLanes {
    using F = typename V::Floats;
    using I = typename V::Ints;

    uint32_t on; ///< lanes that are answered here
    I face;
    F x0, y0, fx, fy; ///< the filter's first texel, and the position in it
    F own[3], across[3], low;

    static F dot(const F (&a)[3], const F (&b)[3]) {
        return V::add(V::add(V::mul(a[0], b[0]), V::mul(a[1], b[1])), V::mul(a[2], b[2]));
    }
    static F largest(const F (&a)[3]) {
        return V::greater(V::absolute(a[0]), V::greater(V::absolute(a[1]), V::absolute(a[2])));
    }
    /// Returns a vector in the order of the face's axes; isX, isY: lanes whose face looks along x
    /// or y.
    static void turn(uint32_t isX, uint32_t isY, const F (&p)[3], F (&q)[3]) {
        q[0] = V::select(isX, p[1], V::select(isY, p[2], p[0]));
        q[1] = V::select(isX, p[2], V::select(isY, p[0], p[1]));
        q[2] = V::select(isX, p[0], V::select(isY, p[1], p[2]));
    }
    /// Returns moveToFirstTap of a position in texels, clamped to the face.
    static void place(const LookupWork& work, F s, F& first, F& f) {
        const F end = V::splat(float(work.faceTexels));
        s = V::lesser(V::greater(s, V::splat(0.0f)), end);
        first = V::lesser(V::toFloats(V::toInts(s)), V::sub(end, V::splat(1.0f)));
        f = V::sub(s, first);
        if (work.side == 3) {
            first = V::sub(first, V::splat(1.0f));
        } else if (work.side == 2) {
            const F before = V::select(V::less(f, V::splat(0.5f)), V::splat(1.0f), V::splat(0.0f));
            first = V::sub(first, before);
            f = V::add(f, V::sub(before, V::splat(0.5f)));
        }
    }

    ReceiverLanes(const LookupWork& work, uint32_t start, uint32_t asked) {
        const F zero = V::splat(0.0f), one = V::splat(1.0f), half = V::splat(0.5f);
        F p[3], n[3], d[3], q[3], m[3];
        for (int a = 0; a < 3; ++a) {
            p[a] = V::load(work.position[a] + start);
            n[a] = V::load(work.normal[a] + start);
            d[a] = V::sub(p[a], V::splat(work.light[a]));
        }
        const F dd = dot(d, d);
        constexpr float kMostSquared = 1e30f; // beyond it, and for NaN, the one text decides
        on = asked & V::less(zero, dd) & V::less(dd, V::splat(kMostSquared));
        const F ax = V::absolute(d[0]), ay = V::absolute(d[1]), az = V::absolute(d[2]);
        const uint32_t isX = V::lessOrEqual(ay, ax) & V::lessOrEqual(az, ax);
        const uint32_t isY = ~isX & V::lessOrEqual(az, ay);
        turn(isX, isY, d, q);
        turn(isX, isY, n, m);
        const uint32_t isBack = V::less(q[2], zero);
        face =
            V::selectInts(isX, V::splatInt(0), V::selectInts(isY, V::splatInt(2), V::splatInt(4)));
        face = V::addInts(face, V::selectInts(isBack, V::splatInt(1), V::splatInt(0)));
        q[2] = V::absolute(q[2]);
        m[2] = V::select(isBack, V::sub(V::splat(-0.0f), m[2]), m[2]);
        const F rDepth = V::div(one, q[2]);
        const F halfTexels = V::splat(0.5f * float(work.faceTexels));
        place(work, V::mul(V::add(V::mul(q[0], rDepth), one), halfTexels), x0, fx);
        place(work, V::mul(V::add(V::mul(q[1], rDepth), one), halfTexels), y0, fy);

        const F rounding = V::add(V::mul(V::splat(work.placeRounding), largest(p)),
                                  V::mul(V::splat(work.wayRounding), largest(d)));
        const F height = V::sub(V::splat(-0.0f), dot(n, d));
        const uint32_t faces = V::less(zero, height);
        const F exact = V::greater(V::sub(height, rounding), V::mul(half, height));
        F lifted = exact;
        if (work.twoLod > 0.0f) {
            const F lift = V::mul(V::mul(V::splat(work.twoLod), q[2]), V::splat(work.rTexels));
            lifted = V::select(faces, V::greater(V::sub(exact, lift), V::mul(half, exact)), exact);
        }
        const F forgiven = V::splat(work.forgiven);
        const F rHeight = V::sub(V::splat(-0.0f), V::div(forgiven, lifted));
        const F apart = V::mul(
            dd, V::sub(one, V::lesser(V::add(V::mul(rounding, rDepth), V::splat(work.wayRounding)),
                                      half)));
        const F rAcross = V::div(forgiven, apart);
        for (int a = 0; a < 3; ++a) {
            own[a] = V::select(faces, V::mul(m[a], rHeight), zero);
            across[a] = V::mul(q[a], rAcross);
        }
        low = V::splat(work.low);
        if (work.twoLod > 0.0f)
            low = V::select(V::less(lifted, exact), V::mul(low, V::div(lifted, exact)), low);

        const F last = V::splat(float(work.faceTexels) - float(work.side));
        on &= V::lessOrEqual(zero, x0) & V::lessOrEqual(zero, y0) & V::lessOrEqual(x0, last) &
              V::lessOrEqual(y0, last);
    }
};

/// The pages that the filters of one vector touch: at most two along each axis.
template <class V> struct PageLanes {
    using I = typename V::Ints;

    I first[2], last[2];      ///< page along x, y that holds the filter's first and last texel
    I start[2][2];            ///< first texel of page [y][x]; of a page without memory 0
    uint32_t isMissing[2][2]; ///< lanes
    bool isOne;               ///< each filter lies in one page

    PageLanes(const LookupWork& work, const ReceiverLanes<V>& r, const I& x, const I& y) {
        const int log2 = int(work.pageTexelsLog2);
        const I reach = V::splatInt(int32_t(work.side) - 1);
        first[0] = V::shiftRight(x, log2);
        first[1] = V::shiftRight(y, log2);
        last[0] = V::shiftRight(V::addInts(x, reach), log2);
        last[1] = V::shiftRight(V::addInts(y, reach), log2);
        isOne = (r.on & ~(V::equalInts(first[0], last[0]) & V::equalInts(first[1], last[1]))) == 0;
        for (int j = 0; j < (isOne ? 1 : 2); ++j)
            for (int i = 0; i < (isOne ? 1 : 2); ++i)
                find(work, r, i == 0 ? first[0] : last[0], j == 0 ? first[1] : last[1], start[j][i],
                     isMissing[j][i]);
    }

    /// Finds the memory of page (x, y).
    static void find(const LookupWork& work, const ReceiverLanes<V>& r, const I& x, const I& y,
                     I& start, uint32_t& isMissing) {
        const I pages = V::splatInt(int32_t(work.facePages));
        I entry = V::mulInts(V::addInts(V::mulInts(r.face, pages), y), pages);
        entry = V::selectInts(r.on, V::addInts(entry, x), V::splatInt(0));
        const I page = V::gatherInts(work.pageTable, entry);
        isMissing = V::equalInts(page, V::splatInt(-1)); // kNoPage
        start = V::selectInts(r.on & ~isMissing, V::shiftLeft(page, 2 * int(work.pageTexelsLog2)),
                              V::splatInt(0));
    }
};

template <class V> void lookUpVector(LookupWork& work, uint32_t start, uint32_t asked) {
    using F = typename V::Floats;
    using I = typename V::Ints;
    const ReceiverLanes<V> r(work, start, asked);
    const F zero = V::splat(0.0f), one = V::splat(1.0f);
    uint32_t done = 0;
    alignas(64) float values[V::kWidth];
    if (r.on != 0) {
        const int log2 = int(work.pageTexelsLog2);
        const I x = V::toInts(r.x0), y = V::toInts(r.y0);
        const PageLanes<V> pages(work, r, x, y);
        const I inPage = V::splatInt((1 << log2) - 1);
        const F centre = V::splat(1.0f - float(work.faceTexels)), rTexels = V::splat(work.rTexels);
        const uint32_t hasLow = V::less(zero, r.low);
        const int side = int(work.side);
        F lit = zero, leftOut = zero;
        uint32_t missing[9];
        for (int j = 0; j < side; ++j) {
            const F row = V::add(r.y0, V::splat(float(j)));
            const F v = V::mul(V::add(V::add(row, row), centre), rTexels);
            const F wy = side == 1 || j + j + 1 == side ? one : j == 0 ? V::sub(one, r.fy) : r.fy;
            const I rowTexel = V::addInts(y, V::splatInt(j));
            const I inRow = V::shiftLeft(V::andInts(rowTexel, inPage), log2);
            const uint32_t isFirstRow =
                pages.isOne ? ~0u : V::equalInts(V::shiftRight(rowTexel, log2), pages.first[1]);
            for (int i = 0; i < side; ++i) {
                const F column = V::add(r.x0, V::splat(float(i)));
                const F u = V::mul(V::add(V::add(column, column), centre), rTexels);
                const F wx = side == 1 || i + i + 1 == side ? one
                             : i == 0                       ? V::sub(one, r.fx)
                                                            : r.fx;
                const F weight = V::mul(wx, wy);
                const F own = V::add(V::add(V::mul(r.own[0], u), V::mul(r.own[1], v)), r.own[2]);
                const F across =
                    V::add(V::add(V::mul(r.across[0], u), V::mul(r.across[1], v)), r.across[2]);
                const uint32_t isLow = hasLow & V::less(across, V::mul(own, r.low));
                const F limit = V::greater(own, across);

                const I columnTexel = V::addInts(x, V::splatInt(i));
                I page = pages.start[0][0];
                uint32_t isMissing = pages.isMissing[0][0];
                if (!pages.isOne) {
                    const uint32_t isFirst =
                        V::equalInts(V::shiftRight(columnTexel, log2), pages.first[0]);
                    page =
                        V::selectInts(isFirstRow, V::selectInts(isFirst, page, pages.start[0][1]),
                                      V::selectInts(isFirst, pages.start[1][0], pages.start[1][1]));
                    isMissing = (isFirstRow &
                                 ((isFirst & isMissing) | (~isFirst & pages.isMissing[0][1]))) |
                                (~isFirstRow & ((isFirst & pages.isMissing[1][0]) |
                                                (~isFirst & pages.isMissing[1][1])));
                }
                I texel = V::addInts(page, V::addInts(inRow, V::andInts(columnTexel, inPage)));
                texel = V::selectInts(r.on, texel, V::splatInt(0));
                const F stored = V::bitsToFloats(V::gatherInts(work.depths, texel));
                const uint32_t isDark = V::less(limit, stored);
                leftOut = V::select(isLow & ~isMissing, V::add(leftOut, weight), leftOut);
                lit = V::select(~isLow & ~isMissing & ~isDark, V::add(lit, weight), lit);
                missing[3 * j + i] = isMissing;
            }
        }
        const F total = V::splat(work.total);
        done = r.on & (V::lessOrEqual(leftOut, zero) | V::less(leftOut, V::splat(work.largestOut)));
        const F counted = V::sub(total, leftOut);
        V::store(values, V::add(V::mul(lit, V::div(V::splat(255.0f), counted)), V::splat(0.5f)));
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i)
                work.missingCount += uint32_t(__builtin_popcount(missing[3 * j + i] & done));
    }
    for (uint32_t lanes = done; lanes != 0; lanes &= lanes - 1) {
        const uint32_t i = uint32_t(__builtin_ctz(lanes));
        work.seen[start + i] = uint8_t(uint32_t(values[i]));
    }
    for (uint32_t lanes = asked & ~done; lanes != 0; lanes &= lanes - 1)
        work.left[work.leftCount++] = start + uint32_t(__builtin_ctz(lanes));
}

template <class V> void lookUp(LookupWork& work) {
    for (uint32_t start = 0; start < work.count; start += V::kWidth) {
        const uint32_t left = work.count - start;
        uint32_t asked = 0;
        for (uint32_t i = 0; i < (left < V::kWidth ? left : V::kWidth); ++i)
            asked |= uint32_t(work.isAsked[start + i] != 0) << i;
        if (asked != 0)
            lookUpVector<V>(work, start, asked);
    }
}

} // namespace
} // namespace shadowdag::stream
