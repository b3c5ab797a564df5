// SPDX-License-Identifier: Apache-2.0
// filterVisibility over the taps of a map (shadowmap/shadow_map_lookup.h) for V::kWidth receivers
// at once: the same operations in the same order, so the same bits. Receivers whose filter leaves
// the face of a cube, or omits all taps, are left to the one text. Only lookup_lanes_*.cpp include
// it, each compiled for its processor; nothing inline of other headers is used.
#pragma once

#include "hybrid/frame/lookup_lanes_work.h"

namespace shadowdag::stream {
namespace {

/// Applies moveToFirstTap. @tparam side of the filter @param first the texel that holds the
/// receiver @param f the position in it
template <class V, int side> void moveToFirst(typename V::Floats& first, typename V::Floats& f) {
    if (side == 3) {
        first = V::sub(first, V::splat(1.0f));
    } else if (side == 2) {
        const auto before = V::select(V::less(f, V::splat(0.5f)), V::splat(1.0f), V::splat(0.0f));
        first = V::sub(first, before);
        f = V::add(f, V::sub(before, V::splat(0.5f)));
    }
}

/// The receivers of one vector, as CubeReceiver has them; planes in the frame of the face.
template <class V, int side> struct CubeLanes {
    using F = typename V::Floats;
    using I = typename V::Ints;
    using M = typename V::Mask;

    M on; ///< lanes that are answered here
    I face;
    F x0, y0, fx, fy; ///< the filter's first texel, and the position in it
    F own[3], across[3], low;
    M hasLow;

    /// Returns texel k of the filter along axis a.
    F texel(const LookupWork&, int a, int k) const {
        return V::add(a == 0 ? x0 : y0, V::splat(float(k)));
    }
    /// Returns where the taps of a column or row compare: tapCentre.
    F place(const LookupWork& work, int, const F& texel) const {
        const F centre = V::splat(1.0f - float(work.faceTexels));
        return V::mul(V::add(V::add(texel, texel), centre), V::splat(work.rTexels));
    }
    /// Returns cubeTapLimit at a place; isLow: lanes.
    F limit(const F& u, const F& v, M& isLow) const {
        const F ownHere = V::add(V::add(V::mul(own[0], u), V::mul(own[1], v)), own[2]);
        const F acrossHere = V::add(V::add(V::mul(across[0], u), V::mul(across[1], v)), across[2]);
        isLow = hasLow & V::less(acrossHere, V::mul(ownHere, low));
        return V::greater(ownHere, acrossHere);
    }

    static F dot(const F (&a)[3], const F (&b)[3]) {
        return V::add(V::add(V::mul(a[0], b[0]), V::mul(a[1], b[1])), V::mul(a[2], b[2]));
    }
    static F largest(const F (&a)[3]) {
        return V::greater(V::absolute(a[0]), V::greater(V::absolute(a[1]), V::absolute(a[2])));
    }
    /// Returns a vector in the order of the face's axes; isX, isY: lanes whose face looks along x
    /// or y.
    static void turn(M isX, M isY, const F (&p)[3], F (&q)[3]) {
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
        moveToFirst<V, side>(first, f);
    }

    CubeLanes(const LookupWork& work, uint32_t start, M asked) {
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
        const M isX = V::lessOrEqual(ay, ax) & V::lessOrEqual(az, ax);
        const M isY = ~isX & V::lessOrEqual(az, ay);
        turn(isX, isY, d, q);
        turn(isX, isY, n, m);
        const M isBack = V::less(q[2], zero);
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
        const M faces = V::less(zero, height);
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
        hasLow = V::less(zero, low);

        const F last = V::splat(float(work.faceTexels) - float(side));
        on = on & V::lessOrEqual(zero, x0) & V::lessOrEqual(zero, y0) & V::lessOrEqual(x0, last) &
             V::lessOrEqual(y0, last);
    }
};

/// The receivers of one vector, as DirectionalReceiver has them.
template <class V, int side> struct WindowLanes {
    using F = typename V::Floats;
    using I = typename V::Ints;
    using M = typename V::Mask;
    using D = typename V::Doubles;

    M on; ///< lanes that are answered here
    I face;
    F x0, y0, fx, fy; ///< the filter's first texel, which may lie outside, and the position in it
    D at[2];          ///< position in texels
    F depth, slopeX, slopeY, own, across, forgiven, low;

    /// Returns texel k of the filter along axis a: the nearest one in the window.
    F texel(const LookupWork& work, int a, int k) const {
        const F inside = V::greater(V::add(a == 0 ? x0 : y0, V::splat(float(k))), V::splat(0.0f));
        return V::lesser(inside, V::splat(float(work.faceTexels) - 1.0f));
    }
    /// Returns how far the centres of a column or row are from the receiver, in texels.
    F place(const LookupWork&, int a, const F& texel) const {
        return V::toFloats(V::sub(V::add(V::toDoubles(texel), V::splatDouble(0.5)), at[a]));
    }
    /// Returns windowTapLimit at a place; isLow: lanes.
    F limit(const F& toX, const F& toY, M& isLow) const {
        const F ownHere = V::add(V::mul(slopeX, toX), V::mul(slopeY, toY));
        isLow = V::less(low, ownHere);
        return V::add(depth, V::add(V::greater(V::add(ownHere, own), across), forgiven));
    }

    static D dot(const D (&a)[3], const double (&b)[3]) {
        return V::add(
            V::add(V::mul(a[0], V::splatDouble(b[0])), V::mul(a[1], V::splatDouble(b[1]))),
            V::mul(a[2], V::splatDouble(b[2])));
    }
    /// Returns the lanes whose number is finite and not so large that what is derived from it
    /// could be infinite.
    static M isModest(const D& a) {
        const D most = V::splatDouble(1e15);
        return V::lessOrEqual(a, most) & V::lessOrEqual(V::sub(V::splatDouble(0.0), most), a);
    }
    /// Finds windowTexel and moves it to the first tap.
    static void place(const LookupWork& work, const D& at, F& first, F& f) {
        const D end = V::splatDouble(double(work.faceTexels));
        const D inside = V::lesser(V::greater(at, V::splatDouble(0.0)), end);
        const D texel = V::lesser(V::truncate(inside), V::sub(end, V::splatDouble(1.0)));
        first = V::toFloats(texel);
        f = V::toFloats(V::sub(inside, texel));
        moveToFirst<V, side>(first, f);
    }

    WindowLanes(const LookupWork& work, uint32_t start, M asked) {
        const WindowLookup& window = *work.window;
        F p[3];
        D n[3], q[3];
        for (int a = 0; a < 3; ++a) {
            p[a] = V::load(work.position[a] + start);
            q[a] = V::toDoubles(p[a]);
            n[a] = V::toDoubles(V::load(work.normal[a] + start));
        }
        D at3[3];
        on = asked;
        for (int row = 0; row < 3; ++row) {
            at3[row] = V::sub(dot(q, window.row[row]), V::splatDouble(window.offset[row]));
            on = on & isModest(at3[row]);
        }
        const D half = V::splatDouble(window.halfSide), one = V::splatDouble(1.0);
        face = V::splatInt(int32_t(window.face));
        depth = V::toFloats(at3[2]);
        for (int a = 0; a < 2; ++a)
            at[a] = V::mul(V::add(at3[a], one), half);
        place(work, at[0], x0, fx);
        place(work, at[1], y0, fy);

        F largest[3];
        for (int a = 0; a < 3; ++a)
            largest[a] = V::add(V::absolute(p[a]), V::splat(window.light[a]));
        const F most = V::greater(largest[0], V::greater(largest[1], largest[2]));
        const D perWorld = V::splatDouble(window.perWorld);
        const D rounding = V::mul(V::mul(V::splatDouble(window.wayRounding),
                                         V::add(V::toDoubles(most), V::splatDouble(window.range))),
                                  perWorld);
        const F depthRounding = V::splat(window.depthRounding);
        across = V::add(V::toFloats(rounding), depthRounding);
        const D facing = V::div(dot(n, window.row[2]), perWorld);
        on = on & isModest(facing);
        const M faces = ~V::lessOrEqual(facing, V::splatDouble(0.0));
        const D steep = V::div(V::splatDouble(window.steepest),
                               V::mul(facing, V::splatDouble(window.perWindow)));
        const F zero = V::splat(0.0f);
        slopeX = V::select(faces, V::toFloats(V::mul(steep, dot(n, window.row[0]))), zero);
        slopeY = V::select(faces, V::toFloats(V::mul(steep, dot(n, window.row[1]))), zero);
        const D lift = V::div(rounding, V::greater(facing, V::splatDouble(window.leastFacing)));
        own = V::select(faces, V::add(V::toFloats(lift), depthRounding), across);
        if (window.lodDepth > 0.0f) {
            const F most = V::greater(V::toFloats(facing), V::splat(window.leastFacingOfLevels));
            own = V::select(faces, V::add(own, V::div(V::splat(window.lodDepth), most)), own);
        }
        forgiven = V::splat(window.forgiven);
        low = V::splat(window.low);
    }
};

/// Returns the entries of page (x, y), from the map's first on; 0 for lanes that are off.
template <class V, class Receivers>
typename V::Ints entriesOf(const LookupWork& work, const Receivers& r, const typename V::Ints& x,
                           const typename V::Ints& y) {
    const auto pages = V::splatInt(int32_t(work.facePages));
    const auto row = V::mulInts(V::addInts(V::mulInts(r.face, pages), y), pages);
    return V::selectInts(r.on, V::addInts(row, x), V::splatInt(0));
}

/// The pages that the filters of one vector touch: at most two along each axis.
template <class V, int side> struct PageLanes {
    using I = typename V::Ints;
    using M = typename V::Mask;

    I first[2], last[2]; ///< page along x, y that holds the filter's first and last texel
    I start[2][2];       ///< first texel of page [y][x]; of a page without memory 0
    M isMissing[2][2];
    bool isOne;        ///< each filter lies in one page
    bool isAnyMissing; ///< where a filter is answered
    int log2;          ///< of the texels across a page

    /// @param texel along x, y of the filter's taps
    template <class Receivers>
    PageLanes(const LookupWork& work, const Receivers& r, const I (&texel)[2][side]) {
        log2 = int(work.pageTexelsLog2);
        for (int a = 0; a < 2; ++a) {
            first[a] = V::shiftRight(texel[a][0], log2);
            last[a] = V::shiftRight(texel[a][side - 1], log2);
        }
        const M isIn = V::equalInts(first[0], last[0]) & V::equalInts(first[1], last[1]);
        isOne = uint32_t(r.on & ~isIn) == 0;
        isAnyMissing = false;
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i) {
                if (isOne && i + j != 0) {
                    start[j][i] = start[0][0];
                    isMissing[j][i] = isMissing[0][0];
                    continue;
                }
                find(work, r, i == 0 ? first[0] : last[0], j == 0 ? first[1] : last[1], start[j][i],
                     isMissing[j][i]);
                isAnyMissing |= uint32_t(r.on & isMissing[j][i]) != 0;
            }
    }

    /// Finds the memory of page (x, y).
    template <class Receivers>
    static void find(const LookupWork& work, const Receivers& r, const I& x, const I& y, I& start,
                     M& isMissing) {
        const I page = V::gatherInts(work.pageTable, entriesOf<V>(work, r, x, y));
        isMissing = V::equalInts(page, V::splatInt(-1)); // kNoPage
        start = V::selectInts(r.on & ~isMissing, V::shiftLeft(page, 2 * int(work.pageTexelsLog2)),
                              V::splatInt(0));
    }
};

/// The filters of one vector, up to the addresses of their texels, which the constructor asks the
/// caches for. A lookup waits for memory longer than it computes, so kAhead vectors are set up
/// before the first of them is compared.
/// @tparam Receivers CubeLanes or WindowLanes @tparam side of the filter
template <class V, class Receivers, int side> struct FilterLanes {
    using F = typename V::Floats;
    using I = typename V::Ints;
    using M = typename V::Mask;

    uint32_t start, asked;
    Receivers r;
    I texels[2][side]; ///< of the taps along x, y
    F places[2][side], weights[2][side];
    PageLanes<V, side> pages;

    FilterLanes(const LookupWork& work, uint32_t first, uint32_t which)
        : start(first), asked(which), r(work, first, V::mask(which)),
          pages(work, r, findTaps(work)) {
        for (int j = 0; j < side; ++j) {
            V::prefetch(work.depths, address(work, 0, j));
            if (side > 1 && (!pages.isOne || work.pageTexelsLog2 > 4)) // a line holds 16 texels
                V::prefetch(work.depths, address(work, side - 1, j));
        }
    }

    /// Returns where the texels of tap (i, j) are.
    I address(const LookupWork& work, int i, int j) const {
        const int log2 = int(work.pageTexelsLog2);
        const I inPage = V::splatInt((1 << log2) - 1);
        const I page = ofPage(pages.start, i, j, [](M which, const I& a, const I& b) {
            return V::selectInts(which, a, b);
        });
        const I inRow = V::shiftLeft(V::andInts(texels[1][j], inPage), log2);
        const I texel = V::addInts(page, V::addInts(inRow, V::andInts(texels[0][i], inPage)));
        return V::selectInts(r.on, texel, V::splatInt(0));
    }

    /// Sets what is seen of the lanes that are answered, and lists the other ones as left.
    void compare(LookupWork& work) const {
        const F zero = V::splat(0.0f);
        F lit = zero, leftOut = zero;
        M exists[side][side];
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                const F weight = V::mul(weights[0][i], weights[1][j]);
                M isLow;
                const F limit = r.limit(places[0][i], places[1][j], isLow);
                const F stored = V::bitsToFloats(V::gatherInts(work.depths, address(work, i, j)));
                const M isDark = V::less(limit, stored);
                exists[j][i] = ~ofPage(pages.isMissing, i, j, [](M which, const M& a, const M& b) {
                    return (which & a) | (~which & b);
                });
                leftOut = V::select(isLow & exists[j][i], V::add(leftOut, weight), leftOut);
                lit = V::select(~(isLow | isDark) & exists[j][i], V::add(lit, weight), lit);
            }
        const uint32_t done =
            r.on & (V::lessOrEqual(leftOut, zero) | V::less(leftOut, V::splat(work.largestOut)));
        const F counted = V::sub(V::splat(work.total), leftOut);
        alignas(64) float values[V::kWidth];
        V::store(values, V::add(V::mul(lit, V::div(V::splat(255.0f), counted)), V::splat(0.5f)));
        if (pages.isAnyMissing)
            for (const auto& row : exists)
                for (const M& here : row)
                    work.missingCount += uint32_t(__builtin_popcount(done & ~uint32_t(here)));
        for (uint32_t lanes = done; lanes != 0; lanes &= lanes - 1) {
            const uint32_t i = uint32_t(__builtin_ctz(lanes));
            work.seen[start + i] = uint8_t(uint32_t(values[i]));
        }
        for (uint32_t lanes = asked & ~done; lanes != 0; lanes &= lanes - 1)
            work.left[work.leftCount++] = start + uint32_t(__builtin_ctz(lanes));
    }

    /// Constructs in the memory at `room`; <new> would bring an inline function of another header.
    static void* operator new(decltype(sizeof 0), void* room) { return room; }

private:
    /// Finds texels, places and weights, and returns texels, which PageLanes needs.
    const I (&findTaps(const LookupWork& work))[2][side] {
        const F one = V::splat(1.0f);
        for (int a = 0; a < 2; ++a) {
            const F f = a == 0 ? r.fx : r.fy;
            for (int k = 0; k < side; ++k) {
                const F texel = r.texel(work, a, k);
                texels[a][k] = V::toInts(texel);
                places[a][k] = r.place(work, a, texel);
                weights[a][k] = side == 1 || k + k + 1 == side ? one : k == 0 ? V::sub(one, f) : f;
            }
        }
        return texels;
    }

    /// Returns what is of the page of tap (i, j), given it of each page.
    template <class T, class Select>
    T ofPage(const T (&of)[2][2], int i, int j, const Select& select) const {
        const auto inRow = [&](int row) {
            return i == 0          ? of[row][0]
                   : i == side - 1 ? of[row][1]
                                   : select(isOfFirst(0, i), of[row][0], of[row][1]);
        };
        return j == 0          ? inRow(0)
               : j == side - 1 ? inRow(1)
                               : select(isOfFirst(1, j), inRow(0), inRow(1));
    }
    M isOfFirst(int a, int k) const {
        return V::equalInts(V::shiftRight(texels[a][k], pages.log2), pages.first[a]);
    }
};

/// Returns the asked samples of the vector that begins with sample `start`.
template <class V> uint32_t askedOf(const LookupWork& work, uint32_t start) {
    const uint32_t left = work.count - start;
    if (left >= V::kWidth)
        return V::nonZero(work.isAsked + start);
    uint32_t asked = 0;
    for (uint32_t i = 0; i < left; ++i)
        asked |= uint32_t(work.isAsked[start + i] != 0) << i;
    return asked;
}

/// Vectors whose texels are on their way from memory.
constexpr uint32_t kAhead = 4;

template <class V, class Receivers, int side> void lookUpAll(LookupWork& work) {
    using Filter = FilterLanes<V, Receivers, side>;
    alignas(Filter) unsigned char room[kAhead][sizeof(Filter)];
    Filter* filters[kAhead];
    uint32_t begun = 0, compared = 0;
    for (uint32_t start = 0; start < work.count; start += V::kWidth) {
        const uint32_t asked = askedOf<V>(work, start);
        if (asked == 0)
            continue;
        if (begun - compared == kAhead)
            filters[compared++ % kAhead]->compare(work);
        filters[begun % kAhead] = new (room[begun % kAhead]) Filter(work, start, asked);
        ++begun;
    }
    while (compared != begun)
        filters[compared++ % kAhead]->compare(work);
}

/// Calls run.operator()<Receivers, side>() for the kind of the map and the filter.
template <class V, class Run> void forFilter(const LookupWork& work, const Run& run) {
    const auto ofSide = [&]<int side>() {
        if (work.window != nullptr)
            run.template operator()<WindowLanes<V, side>, side>();
        else
            run.template operator()<CubeLanes<V, side>, side>();
    };
    if (work.side == 1)
        ofSide.template operator()<1>();
    else if (work.side == 2)
        ofSide.template operator()<2>();
    else
        ofSide.template operator()<3>();
}

template <class V> void lookUp(LookupWork& work) {
    forFilter<V>(work, [&]<class Receivers, int side>() { lookUpAll<V, Receivers, side>(work); });
}

} // namespace
} // namespace shadowdag::stream
