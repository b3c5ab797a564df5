// SPDX-License-Identifier: Apache-2.0
// Exact shadow rays in packets of V::kWidth rays to one light, through a hierarchy over triangles,
// for a vector type V (voxel/lanes_avx2.h). Only exact_stream_*.cpp include it, each compiled for
// its processor: everything is in an anonymous namespace, and nothing inline of other headers is
// used (voxel/dag_stream_work.h says why).
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

/// A leaf's triangles as the rays of one packet see them, lane k of each array for triangle k.
struct SeenLeaf {
    static constexpr uint32_t K = kTrianglesPerLeaf;
    float n1[4][K], n2[4][K], n3[4][K]; ///< x, y, z, and what is added to the scalar product
    float normal[4][K];
    float depth[K];      ///< what N . w must exceed, >= 0
    float band[K];       ///< error of n_i . w
    float depthBand[K];  ///< error of N . w
    uint32_t edgeOn = 0; ///< bits of triangles whose plane is not clear of the light
};

/// Sets `seen`; signs are turned so that a ray through the triangle has positive ones.
template <bool kIsDirectional>
void seeLeaf(const ExactWork& work, const TriangleBvhLeaf& leaf, float longest, float light,
             SeenLeaf& seen) {
    constexpr uint32_t K = SeenLeaf::K;
    float a[3][K], b[3][K], side[3][K], clear[K], clearBand[K];
    for (int x = 0; x < 3; ++x)
        for (uint32_t k = 0; k < K; ++k) {
            a[x][k] = leaf.corner[x][k] - work.origin[x];
            b[x][k] = a[x][k] + leaf.edge1[x][k];
            side[x][k] = leaf.edge2[x][k] - leaf.edge1[x][k];
        }
    const float* const d = work.direction;
    for (int x = 0; x < 3; ++x) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        for (uint32_t k = 0; k < K; ++k) {
            const float(&e1)[3][K] = leaf.edge1;
            const float(&e2)[3][K] = leaf.edge2;
            seen.normal[x][k] = e1[y][k] * e2[z][k] - e1[z][k] * e2[y][k];
            if (kIsDirectional) {
                seen.n1[x][k] = d[y] * e1[z][k] - d[z] * e1[y][k];
                seen.n2[x][k] = d[y] * side[z][k] - d[z] * side[y][k];
                seen.n3[x][k] = e2[y][k] * d[z] - e2[z][k] * d[y];
            } else {
                seen.n1[x][k] = a[y][k] * e1[z][k] - a[z][k] * e1[y][k];
                seen.n2[x][k] = b[y][k] * side[z][k] - b[z][k] * side[y][k];
                seen.n3[x][k] = e2[y][k] * a[z][k] - e2[z][k] * a[y][k];
            }
        }
    }
    const auto dot = [](const float(*n)[K], const float(*p)[K], uint32_t k) {
        return n[0][k] * p[0][k] + n[1][k] * p[1][k] + n[2][k] * p[2][k];
    };
    for (uint32_t k = 0; k < K; ++k) {
        const float l = leaf.longest[k], n = leaf.sides[k];
        const float far = l + lengthOf3(a[0][k], a[1][k], a[2][k]);
        const float planeOffset = dot(seen.normal, a, k);
        seen.depthBand[k] = kSafety * kRounding * 9 * n * (longest + far);
        if (kIsDirectional) {
            seen.n1[3][k] = -dot(seen.n1, a, k);
            seen.n2[3][k] = -dot(seen.n2, b, k);
            seen.n3[3][k] = -dot(seen.n3, a, k);
            clear[k] =
                seen.normal[0][k] * d[0] + seen.normal[1][k] * d[1] + seen.normal[2][k] * d[2];
            for (int x = 0; x < 3; ++x)
                seen.normal[x][k] = -seen.normal[x][k];
            seen.normal[3][k] = planeOffset;
            clearBand[k] = kSafety * n * (8 * kRounding + work.endError);
            seen.band[k] = kSafety * l * (12 * kRounding + work.endError) * (far + longest);
        } else {
            seen.n1[3][k] = seen.n2[3][k] = seen.n3[3][k] = seen.normal[3][k] = 0;
            clear[k] = planeOffset;
            const float moved = kRounding * (longest + light) + work.endError;
            clearBand[k] = seen.depthBand[k] + kSafety * n * (16 * kRounding * longest + moved);
            seen.band[k] =
                kSafety * l * (13 * kRounding * far * longest + moved * (2 * far + longest));
        }
    }
    seen.edgeOn = 0;
    for (uint32_t k = 0; k < K; ++k) {
        const float sign = clear[k] < 0 ? -1.0f : 1.0f;
        seen.edgeOn |= uint32_t(sign * clear[k] <= clearBand[k]) << k;
        for (int x = 0; x < 4; ++x) {
            seen.n1[x][k] *= sign;
            seen.n2[x][k] *= sign;
            seen.n3[x][k] *= sign;
            seen.normal[x][k] *= sign;
        }
        seen.depth[k] = kIsDirectional ? 0.0f : sign * clear[k];
    }
}

/// The way of some rays of one octant through the hierarchy. V: a vector for rays; N: one of
/// kTriangleBvhWidth lanes for the children of a node.
template <class V, class N, bool kIsDirectional> class ExactPacket {
    using F = typename V::Floats;
    using G = typename N::Floats;
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
        SeenLeaf seen;
        seeLeaf<kIsDirectional>(work_, leaf, rays_.longest, rays_.light, seen);
        for (uint32_t k = 0; k < kTrianglesPerLeaf; ++k) {
            if (leaf.longest[k] == 0)
                continue; // unused, or a point
            lanes &= ~blocked_;
            if (lanes == 0)
                return;
            const auto along = [&](const float(&n)[4][kTrianglesPerLeaf]) {
                const F last = kIsDirectional
                                   ? V::fma(V::splat(n[2][k]), rays_.way[2], V::splat(n[3][k]))
                                   : V::mul(V::splat(n[2][k]), rays_.way[2]);
                return V::fma(V::splat(n[0][k]), rays_.way[0],
                              V::fma(V::splat(n[1][k]), rays_.way[1], last));
            };
            const F v1 = along(seen.n1), v2 = along(seen.n2), v3 = along(seen.n3);
            const F inside = V::lesser(V::lesser(v1, v2), v3);
            uint32_t maybe = lanes & V::less(V::splat(-seen.band[k]), inside);
            if (seen.edgeOn >> k & 1) { // of either sign, anywhere along the ray
                const F outside = V::greater(V::greater(v1, v2), v3);
                maybe |= lanes & V::less(outside, V::splat(seen.band[k]));
                confirm(maybe, leaf.triangle[k]);
                continue;
            }
            if (maybe == 0)
                continue;
            const F beyond = along(seen.normal);
            maybe &= V::less(V::splat(seen.depth[k] - seen.depthBand[k]), beyond);
            if (maybe == 0)
                continue;
            uint32_t certain = 0;
            if ((leaf.triangle[k] & kCutTriangleTag) == 0)
                certain = maybe & V::less(V::splat(seen.band[k]), inside) &
                          V::less(V::splat(seen.depth[k] + seen.depthBand[k]), beyond);
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
        constexpr uint32_t K = kTrianglesPerLeaf;
        const TriangleBvhLeaf& leaf = work_.leaves[index];
        SeenLeaf seen;
        seeLeaf<kIsDirectional>(work_, leaf, rays_.longest, rays_.light, seen);
        float w[3];
        for (int a = 0; a < 3; ++a)
            w[a] = V::lane(rays_.way[a], lane);
        float inside[K], outside[K], beyond[K];
        for (uint32_t k = 0; k < K; ++k) {
            const auto along = [&](const float(&n)[4][K]) {
                return n[0][k] * w[0] + n[1][k] * w[1] + n[2][k] * w[2] + n[3][k];
            };
            const float v1 = along(seen.n1), v2 = along(seen.n2), v3 = along(seen.n3);
            const float low = v1 < v2 ? v1 : v2, high = v1 < v2 ? v2 : v1;
            inside[k] = low < v3 ? low : v3;
            outside[k] = high < v3 ? v3 : high;
            beyond[k] = along(seen.normal) - seen.depth[k];
        }
        for (uint32_t k = 0; k < K; ++k) {
            if (leaf.longest[k] == 0)
                continue; // unused, or a point
            const bool isEdgeOn = (seen.edgeOn >> k & 1) != 0;
            const bool maybe = isEdgeOn
                                   ? -seen.band[k] < inside[k] || outside[k] < seen.band[k]
                                   : -seen.band[k] < inside[k] && -seen.depthBand[k] < beyond[k];
            if (!maybe)
                continue;
            if (!isEdgeOn && (leaf.triangle[k] & kCutTriangleTag) == 0 &&
                seen.band[k] < inside[k] && seen.depthBand[k] < beyond[k]) {
                blocked_ |= 1u << lane;
                lastLeaf_ = index;
                return;
            }
            confirm(1u << lane, leaf.triangle[k]);
            if (blocked_ >> lane & 1)
                return;
        }
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
    static_assert(N::kWidth == kTriangleBvhWidth);
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
