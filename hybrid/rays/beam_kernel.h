// SPDX-License-Identifier: Apache-2.0
// Beams: which triangles may block rays to one light from anywhere in a box, and rays against such
// a list. Only beam_stream_*.cpp include it (exact_stream_kernel.h says why).
//
// A ray's test of a triangle is the sign of four products that are linear in its start
// (exact_stream_kernel.h). So their extremes over a box are at its corners, centre +- half an
// extent: a triangle that fails a test everywhere blocks no ray of the box, one that passes all of
// them everywhere blocks all. Boxes of nodes, and triangles again, are held against the shaft
// around the box and the light (Haines and Wallace 1991): its sides are the at most six planes that
// contain the light and touch the box along an edge, two for each axis.
//
// Bounds: rays start at the box's points exactly, and the errors of the four products are those of
// packets; centre and half extent are rounded, which adds 4 u |n| (|centre| + |half|) < 8 u |n| W
// to each. They are taken as twice the bounds of packets, which hold more than that. Shafts: a
// corner relative to the light is off by u of itself, one that is found by adding a rounded edge by
// 4 u, a plane's product by 4 u |corner| |plane| more, and the ray's end by e (there). Taken: the
// margin of packets and 8 u of the largest coordinate on each axis, added.
#pragma once

#include "hybrid/rays/beam_work.h"
#include "hybrid/rays/exact_stream_kernel.h"

namespace shadowdag::stream {
namespace {

/// The shaft around a light, which is the origin, and a box.
struct Shaft {
    float low[3], high[3]; ///< bounds of both
    /// Outside: across[0] * p[axis 0] + across[1] * p[axis 1] > 0.
    struct Side {
        uint32_t axis[2];
        float across[2];
    };
    Side sides[6];
    uint32_t sideCount = 0;
    float margin = 0;
    float longest = 0; ///< from the light to a corner

    /// @param low_,high_ of the box, relative to the light
    Shaft(const float* low_, const float* high_, float margin_) : margin(margin_) {
        float far[3];
        for (int a = 0; a < 3; ++a) {
            low[a] = low_[a] < 0.0f ? low_[a] : 0.0f;
            high[a] = high_[a] > 0.0f ? high_[a] : 0.0f;
            far[a] = -low_[a] > high_[a] ? -low_[a] : high_[a];
        }
        longest = lengthOf3(far[0], far[1], far[2]);
        for (uint32_t a = 0; a < 3; ++a)
            addSides(a, (a + 1) % 3, low_, high_);
    }

private:
    void addSides(uint32_t a, uint32_t b, const float* from, const float* to) {
        if (from[a] <= margin && to[a] >= -margin && from[b] <= margin && to[b] >= -margin)
            return; // seen along the third axis, the light lies in the box
        const float corner[4][2] = {
            {from[a], from[b]}, {to[a], from[b]}, {from[a], to[b]}, {to[a], to[b]}};
        uint32_t left = 0, right = 0;
        const auto cross = [&](uint32_t i, uint32_t j) {
            return corner[i][0] * corner[j][1] - corner[i][1] * corner[j][0];
        };
        for (uint32_t i = 1; i < 4; ++i) {
            if (cross(left, i) > 0.0f)
                left = i;
            if (cross(right, i) < 0.0f)
                right = i;
        }
        sides[sideCount++] = {{a, b}, {-corner[left][1], corner[left][0]}};
        sides[sideCount++] = {{a, b}, {corner[right][1], -corner[right][0]}};
    }
};

template <class N> class BeamSearch {
    using G = typename N::Floats;
    using Seen = SeenLeaf<N, false>;

public:
    explicit BeamSearch(BeamWork& work)
        : work_(work), light_(lengthOf3(work.origin[0], work.origin[1], work.origin[2])),
          shaft_(relative(work.low, 0), relative(work.high, 1), 0.0f) {
        shaft_ =
            Shaft(relative_[0], relative_[1], kSafety * 16 * kRounding * (shaft_.longest + light_));
        for (int a = 0; a < 3; ++a) {
            packet_.origin[a] = work.origin[a];
            packet_.direction[a] = 0;
        }
        packet_.endError = 0;
    }

    void run() {
        uint32_t stack[kTriangleBvhDepth * kTriangleBvhWidth + 1], count = 0;
        stack[count++] = work_.root;
        while (count > 0) {
            const uint32_t child = stack[--count];
            if (child & kTriangleLeafTag) {
                testLeaf(child & ~kTriangleLeafTag);
                if (work_.isDark || work_.isOverflow)
                    return;
                continue;
            }
            const TriangleBvhNode& node = work_.nodes[child];
            for (uint32_t met = meets(node.low, node.high); met != 0; met &= met - 1)
                stack[count++] = node.child[__builtin_ctz(met)];
        }
    }

private:
    const float* relative(const float* p, int to) {
        for (int a = 0; a < 3; ++a)
            relative_[to][a] = p[a] - work_.origin[a];
        return relative_[to];
    }

    /// Returns the boxes that meet the shaft. @param low,high by axis
    uint32_t meets(const float (&low)[3][N::kWidth], const float (&high)[3][N::kWidth]) const {
        G l[3], h[3], slack = N::splat(shaft_.margin);
        for (int a = 0; a < 3; ++a) {
            l[a] = N::sub(N::load(low[a]), N::splat(work_.origin[a]));
            h[a] = N::sub(N::load(high[a]), N::splat(work_.origin[a]));
            slack = N::fma(N::splat(8 * kRounding),
                           N::greater(N::absolute(l[a]), N::absolute(h[a])), slack);
        }
        const G zero = N::splat(0.0f);
        uint32_t met = ~0u;
        for (int a = 0; a < 3; ++a)
            met &= N::lessOrEqual(N::sub(l[a], slack), N::splat(shaft_.high[a])) &
                   N::lessOrEqual(N::splat(shaft_.low[a]), N::add(h[a], slack));
        for (uint32_t s = 0; s < shaft_.sideCount; ++s) {
            const Shaft::Side& side = shaft_.sides[s];
            const float x = side.across[0], y = side.across[1];
            const G& p = x > 0.0f ? l[side.axis[0]] : h[side.axis[0]];
            const G& q = y > 0.0f ? l[side.axis[1]] : h[side.axis[1]];
            const G inner = N::fma(N::splat(x), p, N::mul(N::splat(y), q));
            const G allowed = N::mul(slack, N::splat(__builtin_fabsf(x) + __builtin_fabsf(y)));
            met &= N::lessOrEqual(N::sub(inner, allowed), zero);
        }
        return met;
    }

    void testLeaf(uint32_t index) {
        const TriangleBvhLeaf& leaf = work_.leaves[index];
        const G zero = N::splat(0.0f);
        // The shaft's sides against the corners.
        G corner[3][3];
        G slack = N::splat(shaft_.margin);
        for (int x = 0; x < 3; ++x) {
            corner[0][x] = N::sub(N::load(leaf.corner[x]), N::splat(work_.origin[x]));
            corner[1][x] = N::add(corner[0][x], N::load(leaf.edge1[x]));
            corner[2][x] = N::add(corner[0][x], N::load(leaf.edge2[x]));
            const G most =
                N::greater(N::absolute(corner[0][x]),
                           N::greater(N::absolute(corner[1][x]), N::absolute(corner[2][x])));
            slack = N::fma(N::splat(8 * kRounding), most, slack);
        }
        uint32_t maybe = N::less(zero, N::load(leaf.longest)); // unused, and points, have no sides
        for (int x = 0; x < 3; ++x) {
            const G least = N::lesser(corner[0][x], N::lesser(corner[1][x], corner[2][x]));
            const G most = N::greater(corner[0][x], N::greater(corner[1][x], corner[2][x]));
            maybe &= N::lessOrEqual(N::sub(least, slack), N::splat(shaft_.high[x])) &
                     N::lessOrEqual(N::splat(shaft_.low[x]), N::add(most, slack));
        }
        for (uint32_t s = 0; s < shaft_.sideCount && maybe != 0; ++s) {
            const Shaft::Side& side = shaft_.sides[s];
            const G x = N::splat(side.across[0]), y = N::splat(side.across[1]);
            G inner = zero;
            for (int c = 0; c < 3; ++c) {
                const G out =
                    N::fma(x, corner[c][side.axis[0]], N::mul(y, corner[c][side.axis[1]]));
                inner = c == 0 ? out : N::lesser(inner, out);
            }
            const G allowed = N::mul(
                slack, N::splat(__builtin_fabsf(side.across[0]) + __builtin_fabsf(side.across[1])));
            maybe &= N::lessOrEqual(N::sub(inner, allowed), zero);
        }
        if (maybe == 0)
            return;
        // The triangles' edges and planes against the box.
        const Seen seen(packet_, leaf, shaft_.longest, light_);
        float centre[3], half[3];
        for (int a = 0; a < 3; ++a) {
            centre[a] = 0.5f * (relative_[0][a] + relative_[1][a]);
            half[a] = 0.5f * (relative_[1][a] - relative_[0][a]);
        }
        const G band = N::add(seen.band, seen.band), under = N::sub(zero, band);
        const G depthBand = N::add(seen.depthBand, seen.depthBand);
        uint32_t anyAbove = ~0u, allAbove = ~0u, anyBelow = ~0u;
        const auto reach = [&](const G(&n)[4], G& least, G& most) {
            const G at = Seen::along(n, centre);
            G r = N::mul(N::absolute(n[0]), N::splat(half[0]));
            r = N::fma(N::absolute(n[1]), N::splat(half[1]), r);
            r = N::fma(N::absolute(n[2]), N::splat(half[2]), r);
            least = N::sub(at, r);
            most = N::add(at, r);
        };
        G least, most;
        uint32_t centreIn = ~0u;
        const G(*const edges[3])[4] = {&seen.n1, &seen.n2, &seen.n3};
        for (const auto* n : edges) {
            reach(*n, least, most);
            centreIn &= N::less(zero, N::add(least, most));
            anyAbove &= N::less(under, most);
            allAbove &= N::less(band, least);
            anyBelow &= N::less(least, band);
        }
        reach(seen.normal, least, most);
        centreIn &= N::less(N::add(seen.depth, seen.depth), N::add(least, most));
        const uint32_t anyBeyond = N::less(N::sub(zero, depthBand), N::sub(most, seen.depth));
        const uint32_t allBeyond = N::less(depthBand, N::sub(least, seen.depth));
        maybe &= (seen.edgeOn & (anyAbove | anyBelow)) | (~seen.edgeOn & anyAbove & anyBeyond);
        if (maybe == 0)
            return;
        for (uint32_t all = maybe & ~seen.edgeOn & allAbove & allBeyond; all != 0; all &= all - 1)
            if ((leaf.triangle[__builtin_ctz(all)] & kCutTriangleTag) == 0) {
                work_.isDark = true;
                return;
            }
        if (work_.count == work_.capacity) {
            work_.isOverflow = true;
            return;
        }
        uint32_t at = work_.count++;
        if (centreIn & maybe) { // likely to block most rays: to the front
            work_.leaf[at] = work_.leaf[front_];
            work_.mask[at] = work_.mask[front_];
            at = front_++;
        }
        work_.leaf[at] = index;
        work_.mask[at] = uint8_t(maybe);
    }

    BeamWork& work_;
    float relative_[2][3];
    float light_;
    Shaft shaft_;
    ExactWork packet_{};
    uint32_t front_ = 0; ///< leaves that block the middle
};

template <class N> void findBeam(BeamWork& work) {
    work.count = 0;
    work.isDark = work.isOverflow = false;
    BeamSearch<N>(work).run();
}

/// Traces up to kMany packets of rays against the list.
template <class V, class N> class ListedRays {
    using F = typename V::Floats;
    using G = typename N::Floats;
    using Seen = SeenLeaf<N, false>;

public:
    static constexpr uint32_t kMany = 8;

    ListedRays(ListedWork& work, size_t first, size_t count) : work_(work), first_(first) {
        F most = V::splat(0.0f);
        for (size_t done = 0; done < count; done += V::kWidth) {
            const size_t left = count - done;
            F square = V::splat(0.0f);
            for (int a = 0; a < 3; ++a) {
                way_[packets_][a] =
                    V::sub(V::load(work.start[a] + first + done), V::splat(work.rays.origin[a]));
                square = V::fma(way_[packets_][a], way_[packets_][a], square);
            }
            const uint32_t used =
                left < V::kWidth ? (1u << left) - 1 : uint32_t((uint64_t(1) << V::kWidth) - 1);
            active_[packets_] = used & bitsFrom(work.active, work.firstBit + first + done);
            waiting_[packets_] = active_[packets_];
            ++packets_;
            most = V::greater(most, V::select(used, square, V::splat(0.0f)));
        }
        longest_ = 1.000001f * __builtin_sqrtf(V::greatest(~0u, most));
        const float* at = work.rays.origin;
        light_ = lengthOf3(at[0], at[1], at[2]);
    }

    void run() {
        for (uint32_t i = 0; i < work_.listCount; ++i)
            if (!test(work_.rays.leaves[work_.leaf[i]], work_.mask[i]))
                return;
    }

    void store() const {
        for (uint32_t p = 0; p < packets_; ++p)
            for (uint32_t dark = active_[p] & ~waiting_[p]; dark != 0; dark &= dark - 1)
                work_.isDark[first_ + p * V::kWidth + uint32_t(__builtin_ctz(dark))] = 1;
    }

private:
    /// Returns V::kWidth bits at a place.
    static uint32_t bitsFrom(const uint64_t* words, size_t at) {
        const uint64_t low = words[at / 64] >> (at % 64);
        return uint32_t(at % 64 == 0 ? low : low | words[at / 64 + 1] << (64 - at % 64));
    }

    /// Returns whether rays are left.
    bool test(const TriangleBvhLeaf& leaf, uint32_t mask) {
        const Seen seen(work_.rays, leaf, longest_, light_);
        uint32_t any = 0;
        for (uint32_t p = 0; p < packets_; ++p) {
            for (uint32_t left = mask; left != 0 && waiting_[p] != 0; left &= left - 1)
                test(seen, leaf, uint32_t(__builtin_ctz(left)), p);
            any |= waiting_[p];
        }
        return any != 0;
    }

    void test(const Seen& seen, const TriangleBvhLeaf& leaf, uint32_t k, uint32_t p) {
        uint32_t certain;
        const uint32_t maybe = blockedBy<V, N, false>(seen, leaf, k, way_[p], waiting_[p], certain);
        waiting_[p] &= ~certain;
        confirm(maybe & ~certain, leaf.triangle[k], p);
    }

    void confirm(uint32_t lanes, uint32_t tagged, uint32_t p) {
        const uint32_t triangle = tagged & ~kCutTriangleTag;
        for (; lanes != 0; lanes &= lanes - 1) {
            const uint32_t lane = uint32_t(__builtin_ctz(lanes));
            const uint32_t ray = uint32_t(first_) + p * V::kWidth + lane;
            if (work_.rays.receivers[ray] == triangle)
                continue;
            ++work_.rays.confirmCount;
            if (work_.rays.confirm(work_.rays.user, ray, triangle))
                waiting_[p] &= ~(1u << lane);
        }
    }

    ListedWork& work_;
    size_t first_;
    uint32_t packets_ = 0;
    uint32_t active_[kMany];
    uint32_t waiting_[kMany]; ///< active lanes that nothing blocked yet
    F way_[kMany][3];
    float longest_, light_;
};

/// Returns a bit for each of V::kWidth bytes of 0 or 1.
template <class V> uint32_t bitsOfBytes(const uint8_t* bytes) {
    uint32_t bits = 0;
    for (uint32_t i = 0; i < V::kWidth; i += 8) {
        uint64_t eight;
        __builtin_memcpy(&eight, bytes + i, 8);
        bits |= uint32_t(eight * 0x0102040810204080ull >> 56) << i;
    }
    return bits;
}

template <class V> void findActive(const ActiveWork& work) {
    using F = typename V::Floats;
    const F x = V::splat(work.light[0]), y = V::splat(work.light[1]), z = V::splat(work.light[2]);
    const F beyond = V::splat(work.beyond);
    static_assert(64 % V::kWidth == 0);
    for (size_t first = 0; first < work.count; first += 64) {
        uint64_t active = 0, open = 0;
        for (uint32_t i = 0; i < 64 && first + i < work.count; i += V::kWidth) {
            const size_t at = first + i;
            const F height = V::sub(V::fma(V::load(work.plane[0] + at), x,
                                           V::fma(V::load(work.plane[1] + at), y,
                                                  V::mul(V::load(work.plane[2] + at), z))),
                                    V::load(work.plane[3] + at));
            uint32_t asked = bitsOfBytes<V>(work.isAsked + at);
            const size_t left = work.count - at;
            if (left < V::kWidth)
                asked &= (1u << left) - 1;
            const uint32_t clear = V::less(V::add(V::load(work.clear + at), beyond), height);
            active |= uint64_t(asked & clear) << i;
            open |= uint64_t(asked & ~clear) << i;
        }
        work.active[first / 64] = active;
        work.open[first / 64] = open;
    }
}

template <class V, class N> void traceListed(ListedWork& work) {
    constexpr size_t kAtOnce = ListedRays<V, N>::kMany * V::kWidth;
    for (size_t first = 0; first < work.rays.count; first += kAtOnce) {
        const size_t left = work.rays.count - first, count = left < kAtOnce ? left : kAtOnce;
        ListedRays<V, N> rays(work, first, count);
        rays.run();
        rays.store();
    }
}

} // namespace
} // namespace shadowdag::stream
