// SPDX-License-Identifier: Apache-2.0
// Exact shadow rays in packets of V::kWidth rays to one light, through a hierarchy over triangles,
// for a vector type V (voxel/lanes_avx2.h). Only exact_stream_*.cpp and beam_kernel.h include it,
// each compiled for its processor: everything is in an anonymous namespace, and nothing inline of
// other headers is used (voxel/dag_stream_work.h says why).
//
// All rays of a packet go to one light L, so what they need of a triangle A, B, C is computed once
// a packet. With n1 = (A - L) x (B - A), n2 = (B - L) x (C - B), n3 = (C - L) x (A - C) and
// N = (B - A) x (C - A), the ray from a start S, w = S - L, passes within the triangle where all
// n_i . w have the sign of N . (A - L), and crosses its plane between S and L where N . w is larger
// than N . (A - L), of that sign. (The light buffer of Haines and Greenberg 1986 rests on the
// same.) To a directional light, towards D, with a start R instead of L and w = S - R: n1 = D x (B
// - A) and so on, n_i . w - n_i . (A_i - R) of the sign of N . D, and N . (A - R) - N . w of that
// sign.
//
// These are floats with errors that are bounded below. Where a sign is not certain, the test of
// the truth in double (blocksTruthRay) decides, so the answers are the truth's.
//
// The bounds, with u = 2^-24 and Euclidean lengths. W: the longest w; far: |A - L| + l; l: the
// longest side; n = |B - A| |C - A| >= |N|; Q: |L|. The truth's ray starts at S, a float point, the
// same here. It ends at S + d, d rounded: |S + d - L| <= e = u (W + Q) + endError.
// - n_i . w: differences have an error of u each, relative, so a cross product is off by
//   9 u far l at most and its scalar product with w by 4 u far l W more. Moving L by e changes it
//   by e l (2 far + W) at most.
// - N . w - N . (A - L): N is off by 5 u n, each scalar product by 4 u n times its length:
//   9 u n (W + far). The light is clear of the plane if N . (A - L) exceeds this, n e and the
//   16 u n W by which the truth ends its ray before the light.
// - Directional: turning D by the angle t = endError changes n_i . (A_i - S) by t l (far + W), its
//   rounding is 12 u l (far + W); N . D is certain above n (8 u + t).
// - Boxes are grown by 16 u (W + Q) + endError, directional by (32 u + t) size.
// The code takes 1.25 times these, for terms of second order.
#pragma once

#include "hybrid/rays/exact_stream_work.h"
#include "voxel/ray_slabs_leaf.h" // its constants

namespace shadowdag::stream {
namespace {

constexpr float kRounding = 1.0f / 16777216.0f; ///< u
constexpr float kSafety = 1.25f;

inline float lengthOf3(float x, float y, float z) {
    return 1.000001f * __builtin_sqrtf(x * x + y * y + z * z);
}

/// Up to V::kWidth rays. Boxes: near(p) = (p - origin) * inv + cNear on each axis, far alike.
template <class V, bool kIsDirectional> struct ExactRays {
    using F = typename V::Floats;
    F way[3], inv[3], cNear[3], cFar[3];
    uint32_t against[3];          ///< bits of the lanes that run against the axis
    float longest = 0, light = 0; ///< W and Q

    ExactRays(const ExactWork& work, const uint32_t* index, uint32_t all) {
        const F zero = V::splat(0.0f);
        F square = zero;
        for (int a = 0; a < 3; ++a) {
            way[a] = V::sub(V::gather(work.starts + a, index), V::splat(work.origin[a]));
            square = V::fma(way[a], way[a], square);
        }
        longest = 1.000001f * __builtin_sqrtf(V::greatest(all, square));
        light = lengthOf3(work.origin[0], work.origin[1], work.origin[2]);
        const float margin =
            kSafety * (kIsDirectional ? (32 * kRounding + work.endError) * (work.size + light)
                                      : 16 * kRounding * (longest + light) + work.endError);
        // No inverse is infinite: along an axis that a ray hardly follows it moves by less than the
        // margin.
        const float least = kIsDirectional ? kRounding * kRounding
                                           : kRounding * kRounding * (longest + light) + 1e-30f;
        for (int a = 0; a < 3; ++a) {
            const F along = kIsDirectional ? V::splat(work.direction[a]) : way[a];
            against[a] = V::less(along, zero);
            const F lifted = V::select(against[a], V::splat(-least), V::splat(least));
            inv[a] = V::div(V::splat(1.0f),
                            V::select(V::less(V::absolute(along), V::splat(least)), lifted, along));
            const F grown = V::mul(V::splat(margin), V::absolute(inv[a]));
            const F start = kIsDirectional ? V::mul(way[a], inv[a]) : zero;
            cNear[a] = V::sub(V::sub(zero, start), grown);
            cFar[a] = V::sub(grown, start);
        }
    }

    uint32_t octantOf(uint32_t lane) const {
        return (against[0] >> lane & 1) | (against[1] >> lane & 1) << 1 |
               (against[2] >> lane & 1) << 2;
    }
    /// Returns the lanes of an octant.
    uint32_t lanesOf(uint32_t octant) const {
        uint32_t lanes = ~0u;
        for (int a = 0; a < 3; ++a)
            lanes &= (octant >> a & 1) ? against[a] : ~against[a];
        return lanes;
    }
};

/// A leaf's triangles as the rays of one packet see them, a lane of T for each. Signs are turned so
/// that a ray through a triangle has positive ones.
template <class T, bool kIsDirectional> struct SeenLeaf {
    using F = typename T::Floats;
    F n1[4], n2[4], n3[4]; ///< x, y, z; directional: what is added to the scalar product
    F normal[4];
    F depth;             ///< what N . w must exceed, >= 0
    F band;              ///< error of n_i . w
    F depthBand;         ///< error of N . w
    uint32_t edgeOn = 0; ///< bits of triangles whose plane is not clear of the light

    SeenLeaf(const ExactWork& work, const TriangleBvhLeaf& leaf, float longest, float light) {
        F a[3], b[3], e1[3], e2[3], side[3], d[3];
        for (int x = 0; x < 3; ++x) {
            e1[x] = T::load(leaf.edge1[x]);
            e2[x] = T::load(leaf.edge2[x]);
            a[x] = T::sub(T::load(leaf.corner[x]), T::splat(work.origin[x]));
            b[x] = T::add(a[x], e1[x]);
            side[x] = T::sub(e2[x], e1[x]);
            d[x] = T::splat(work.direction[x]);
        }
        cross(e1, e2, normal);
        cross(kIsDirectional ? d : a, e1, n1);
        cross(kIsDirectional ? d : b, side, n2);
        cross(e2, kIsDirectional ? d : a, n3);
        const F l = T::load(leaf.longest), n = T::load(leaf.sides);
        const F far = T::fma(T::splat(1.000001f), T::root(dot(a, a)), l);
        const F reach = T::splat(longest);
        const F planeOffset = dot(normal, a);
        depthBand = T::mul(T::splat(kSafety * kRounding * 9), T::mul(n, T::add(reach, far)));
        F clear, clearBand;
        if (kIsDirectional) {
            const F zero = T::splat(0.0f);
            n1[3] = T::sub(zero, dot(n1, a));
            n2[3] = T::sub(zero, dot(n2, b));
            n3[3] = T::sub(zero, dot(n3, a));
            clear = dot(normal, d);
            for (int x = 0; x < 3; ++x)
                normal[x] = T::sub(zero, normal[x]);
            normal[3] = planeOffset;
            clearBand = T::mul(T::splat(kSafety * (8 * kRounding + work.endError)), n);
            band = T::mul(T::splat(kSafety * (12 * kRounding + work.endError)),
                          T::mul(l, T::add(far, reach)));
        } else {
            clear = planeOffset;
            const float moved = kRounding * (longest + light) + work.endError;
            clearBand =
                T::fma(T::splat(kSafety * (16 * kRounding * longest + moved)), n, depthBand);
            const F grown = T::fma(T::splat(13 * kRounding * longest + 2 * moved), far,
                                   T::splat(moved * longest));
            band = T::mul(T::splat(kSafety), T::mul(l, grown));
        }
        const F sign = T::select(T::less(clear, T::splat(0.0f)), T::splat(-1.0f), T::splat(1.0f));
        depth = T::mul(sign, clear);
        edgeOn = T::lessOrEqual(depth, clearBand);
        for (int x = 0; x < (kIsDirectional ? 4 : 3); ++x) {
            n1[x] = T::mul(sign, n1[x]);
            n2[x] = T::mul(sign, n2[x]);
            n3[x] = T::mul(sign, n3[x]);
            normal[x] = T::mul(sign, normal[x]);
        }
        if (kIsDirectional)
            depth = T::splat(0.0f);
    }

    /// Returns the scalar product of each triangle's n with one w.
    static F along(const F (&n)[4], const float (&w)[3]) {
        const F last = T::mul(n[2], T::splat(w[2]));
        return T::fma(n[0], T::splat(w[0]),
                      T::fma(n[1], T::splat(w[1]), kIsDirectional ? T::add(last, n[3]) : last));
    }

private:
    static F dot(const F* p, const F* q) {
        return T::fma(p[0], q[0], T::fma(p[1], q[1], T::mul(p[2], q[2])));
    }
    static void cross(const F* p, const F* q, F* product) {
        const F zero = T::splat(0.0f);
        for (int x = 0; x < 3; ++x) {
            const int y = (x + 1) % 3, z = (x + 2) % 3;
            product[x] = T::fma(p[y], q[z], T::sub(zero, T::mul(p[z], q[y])));
        }
    }
};

/// Returns the rays that triangle k of a leaf may block. @param lanes of the rays that are asked
/// @param way from the light to the start of each ray
/// @param certain receives those that it certainly blocks
template <class V, class N, bool kIsDirectional>
uint32_t blockedBy(const SeenLeaf<N, kIsDirectional>& seen, const TriangleBvhLeaf& leaf, uint32_t k,
                   const typename V::Floats (&way)[3], uint32_t lanes, uint32_t& certain) {
    using F = typename V::Floats;
    using G = typename N::Floats;
    const auto splat = [k](const G& v) { return V::splat(N::lane(v, k)); };
    const auto along = [&](const G(&n)[4]) {
        const F last =
            kIsDirectional ? V::fma(splat(n[2]), way[2], splat(n[3])) : V::mul(splat(n[2]), way[2]);
        return V::fma(splat(n[0]), way[0], V::fma(splat(n[1]), way[1], last));
    };
    certain = 0;
    const F band = splat(seen.band), under = V::sub(V::splat(0.0f), band);
    const F v1 = along(seen.n1), v2 = along(seen.n2), v3 = along(seen.n3);
    const F inside = V::lesser(V::lesser(v1, v2), v3);
    uint32_t maybe = lanes & V::less(under, inside);
    if (seen.edgeOn >> k & 1) { // of either sign, anywhere along the ray
        const F outside = V::greater(V::greater(v1, v2), v3);
        return maybe | (lanes & V::less(outside, band));
    }
    if (maybe == 0)
        return 0;
    const F beyond = V::sub(along(seen.normal), splat(seen.depth));
    const F depthBand = splat(seen.depthBand);
    maybe &= V::less(V::sub(V::splat(0.0f), depthBand), beyond);
    if (maybe != 0 && (leaf.triangle[k] & kCutTriangleTag) == 0)
        certain = maybe & V::less(band, inside) & V::less(depthBand, beyond);
    return maybe;
}

/// The way of some rays of one octant through the hierarchy. V: a vector for rays; N: one for the
/// children of a node and for the triangles of a leaf.
template <class V, class N, bool kIsDirectional> class ExactPacket {
    using F = typename V::Floats;
    using G = typename N::Floats;
    using Seen = SeenLeaf<N, kIsDirectional>;
    using Rays = ExactRays<V, kIsDirectional>;

public:
    ExactPacket(ExactWork& work, const Rays& rays, uint32_t first, uint32_t octant, uint32_t active)
        : work_(work), rays_(rays), first_(first), octant_(octant), active_(active) {
        for (int a = 0; a < 3; ++a) {
            invLow_[a] = N::splat(V::least(active, rays.inv[a]));
            invHigh_[a] = N::splat(V::greatest(active, rays.inv[a]));
            cNear_[a] = N::splat(V::least(active, rays.cNear[a]));
            cFar_[a] = N::splat(V::greatest(active, rays.cFar[a]));
        }
    }

    uint32_t blocked() const { return blocked_; }
    /// The last leaf that blocked a ray; kNoTriangleChild: none.
    uint32_t lastLeaf() const { return lastLeaf_; }

    /// Tests the lanes against the triangles of a leaf.
    void testLeaf(uint32_t index, uint32_t lanes) {
        const TriangleBvhLeaf& leaf = work_.leaves[index];
        const Seen seen(work_, leaf, rays_.longest, rays_.light);
        for (uint32_t k = 0; k < kTrianglesPerLeaf; ++k) {
            if (leaf.longest[k] == 0)
                continue; // unused, or a point
            lanes &= ~blocked_;
            if (lanes == 0)
                return;
            uint32_t certain = 0;
            const uint32_t maybe =
                blockedBy<V, N, kIsDirectional>(seen, leaf, k, rays_.way, lanes, certain);
            if (certain != 0)
                lastLeaf_ = index;
            blocked_ |= certain;
            confirm(maybe & ~certain, leaf.triangle[k]);
        }
    }

    /// Traces the active rays that are not blocked yet.
    void run() {
        uint32_t count = 0;
        stack_[count++] = {work_.root, active_};
        while (count > 0) {
            const Entry entry = stack_[--count];
            const uint32_t lanes = entry.active & ~blocked_;
            if (lanes == 0)
                continue;
            if (__builtin_popcount(lanes) <= kFewRays)
                for (uint32_t left = lanes; left != 0; left &= left - 1)
                    runOne(entry.child, uint32_t(__builtin_ctz(left)));
            else if (entry.child & kTriangleLeafTag)
                testLeaf(entry.child & ~kTriangleLeafTag, lanes);
            else
                count = visit(work_.nodes[entry.child], lanes, count);
        }
    }

private:
    struct Entry {
        uint32_t child, active;
    };

    /// Puts the children that rays meet on the stack; returns its new length.
    uint32_t visit(const TriangleBvhNode& node, uint32_t lanes, uint32_t count) {
        alignas(64) float near[3][kTriangleBvhWidth], far[3][kTriangleBvhWidth];
        G enter = N::splat(0.0f), leave = N::splat(kEnd);
        for (int a = 0; a < 3; ++a) {
            const bool isAgainst = (octant_ >> a & 1) != 0;
            const G origin = N::splat(work_.origin[a]);
            const G n = N::sub(N::load(isAgainst ? node.high[a] : node.low[a]), origin);
            const G f = N::sub(N::load(isAgainst ? node.low[a] : node.high[a]), origin);
            N::store(near[a], n);
            N::store(far[a], f);
            enter = N::greater(enter, N::lesser(N::fma(n, invLow_[a], cNear_[a]),
                                                N::fma(n, invHigh_[a], cNear_[a])));
            leave = N::lesser(leave, N::greater(N::fma(f, invLow_[a], cFar_[a]),
                                                N::fma(f, invHigh_[a], cFar_[a])));
        }
        for (uint32_t met = N::lessOrEqual(enter, leave); met != 0; met &= met - 1) {
            const uint32_t i = uint32_t(__builtin_ctz(met));
            F in = V::splat(0.0f), out = V::splat(kEnd);
            for (int a = 0; a < 3; ++a) {
                in = V::greater(in, V::fma(V::splat(near[a][i]), rays_.inv[a], rays_.cNear[a]));
                out = V::lesser(out, V::fma(V::splat(far[a][i]), rays_.inv[a], rays_.cFar[a]));
            }
            const uint32_t active = lanes & V::lessOrEqual(in, out);
            stack_[count] = {node.child[i], active};
            count += active != 0;
        }
        return count;
    }

    /// Traces one ray through what lies below a child.
    void runOne(uint32_t start, uint32_t lane) {
        G inv[3], cNear[3], cFar[3];
        for (int a = 0; a < 3; ++a) {
            inv[a] = N::splat(V::lane(rays_.inv[a], lane));
            cNear[a] = N::splat(V::lane(rays_.cNear[a], lane));
            cFar[a] = N::splat(V::lane(rays_.cFar[a], lane));
        }
        uint32_t stack[kTriangleBvhDepth * kTriangleBvhWidth + 1], count = 0;
        stack[count++] = start;
        while (count > 0) {
            const uint32_t child = stack[--count];
            if (child & kTriangleLeafTag) {
                testLeafForOne(child & ~kTriangleLeafTag, lane);
                if (blocked_ >> lane & 1)
                    return;
                continue;
            }
            const TriangleBvhNode& node = work_.nodes[child];
            G enter = N::splat(0.0f), leave = N::splat(kEnd);
            for (int a = 0; a < 3; ++a) {
                const bool isAgainst = (octant_ >> a & 1) != 0;
                const G origin = N::splat(work_.origin[a]);
                const G n = N::sub(N::load(isAgainst ? node.high[a] : node.low[a]), origin);
                const G f = N::sub(N::load(isAgainst ? node.low[a] : node.high[a]), origin);
                enter = N::greater(enter, N::fma(n, inv[a], cNear[a]));
                leave = N::lesser(leave, N::fma(f, inv[a], cFar[a]));
            }
            for (uint32_t met = N::lessOrEqual(enter, leave); met != 0; met &= met - 1)
                stack[count++] = node.child[__builtin_ctz(met)];
        }
    }

    /// Tests one ray against the triangles of a leaf.
    void testLeafForOne(uint32_t index, uint32_t lane) {
        const TriangleBvhLeaf& leaf = work_.leaves[index];
        const Seen seen(work_, leaf, rays_.longest, rays_.light);
        float w[3];
        for (int a = 0; a < 3; ++a)
            w[a] = V::lane(rays_.way[a], lane);
        const G v1 = Seen::along(seen.n1, w), v2 = Seen::along(seen.n2, w),
                v3 = Seen::along(seen.n3, w),
                beyond = N::sub(Seen::along(seen.normal, w), seen.depth);
        const G inside = N::lesser(N::lesser(v1, v2), v3);
        const G outside = N::greater(N::greater(v1, v2), v3);
        const G zero = N::splat(0.0f);
        const uint32_t within = N::less(N::sub(zero, seen.band), inside);
        // Unused triangles, and points, have no sides.
        uint32_t maybe = N::less(zero, N::load(leaf.longest)) &
                         ((seen.edgeOn & (within | N::less(outside, seen.band))) |
                          (~seen.edgeOn & within & N::less(N::sub(zero, seen.depthBand), beyond)));
        if (maybe == 0)
            return;
        const uint32_t certain =
            maybe & ~seen.edgeOn & N::less(seen.band, inside) & N::less(seen.depthBand, beyond);
        for (uint32_t left = certain; left != 0; left &= left - 1)
            if ((leaf.triangle[__builtin_ctz(left)] & kCutTriangleTag) == 0) {
                blocked_ |= 1u << lane;
                lastLeaf_ = index;
                return;
            }
        for (; maybe != 0 && (blocked_ >> lane & 1) == 0; maybe &= maybe - 1)
            confirm(1u << lane, leaf.triangle[__builtin_ctz(maybe)]);
    }

    void confirm(uint32_t lanes, uint32_t tagged) {
        const uint32_t triangle = tagged & ~kCutTriangleTag;
        for (lanes &= ~blocked_; lanes != 0; lanes &= lanes - 1) {
            const uint32_t lane = uint32_t(__builtin_ctz(lanes));
            if (work_.receivers[first_ + lane] == triangle)
                continue;
            ++work_.confirmCount;
            blocked_ |= uint32_t(work_.confirm(work_.user, first_ + lane, triangle)) << lane;
        }
    }

    /// With so few rays left each goes alone, the children and triangles of a node in lanes.
    static constexpr int kFewRays = int(V::kWidth / 8);
    /// Where rays end: at their starts; of directional lights nowhere.
    static constexpr float kEnd = kIsDirectional ? kLargestScale : 1.0f;

    ExactWork& work_;
    const Rays& rays_;
    uint32_t first_, octant_, active_, blocked_ = 0, lastLeaf_ = kNoTriangleChild;
    G invLow_[3], invHigh_[3], cNear_[3], cFar_[3]; ///< of the shaft around the rays
    Entry stack_[kTriangleBvhDepth * kTriangleBvhWidth + 1];
};

template <class V, class N, bool kIsDirectional> void traceAllExactly(ExactWork& work) {
    static_assert(N::kWidth == kTriangleBvhWidth && N::kWidth == kTrianglesPerLeaf);
    uint32_t lastLeaf = kNoTriangleChild; // often blocks the next packet, too
    for (size_t first = 0; first < work.count; first += V::kWidth) {
        const size_t left = work.count - first;
        const uint32_t count = left < V::kWidth ? uint32_t(left) : V::kWidth;
        uint32_t index[V::kWidth];
        for (uint32_t i = 0; i < V::kWidth; ++i)
            index[i] = 3 * uint32_t(first + (i < count ? i : count - 1));
        const uint32_t all = uint32_t((uint64_t(1) << count) - 1);
        const ExactRays<V, kIsDirectional> rays(work, index, all);
        uint32_t blocked = 0, waiting = all;
        while (waiting != 0) {
            const uint32_t octant = rays.octantOf(uint32_t(__builtin_ctz(waiting)));
            const uint32_t active = waiting & rays.lanesOf(octant);
            waiting &= ~active;
            ExactPacket<V, N, kIsDirectional> packet(work, rays, uint32_t(first), octant, active);
            if (lastLeaf != kNoTriangleChild)
                packet.testLeaf(lastLeaf, active);
            if (packet.blocked() != active)
                packet.run();
            blocked |= packet.blocked();
            if (packet.lastLeaf() != kNoTriangleChild)
                lastLeaf = packet.lastLeaf();
        }
        for (uint32_t i = 0; i < count; ++i)
            work.blocked[first + i] = uint8_t(blocked >> i & 1);
    }
}

template <class V, class N> void traceAllExactly(ExactWork& work, bool isDirectional) {
    if (isDirectional)
        traceAllExactly<V, N, true>(work);
    else
        traceAllExactly<V, N, false>(work);
}

} // namespace
} // namespace shadowdag::stream
