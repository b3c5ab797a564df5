// SPDX-License-Identifier: Apache-2.0
// The one text of ray streams, over a vector type V that the files which include it bring: packets
// of V::kWidth rays of one octant through the wide form of a DAG (dag.h). Only dag_stream_*.cpp
// include it, each compiled for its processor: everything is in an anonymous namespace and nothing
// inline of other headers is used (dag_stream_work.h says why).
//
// A packet is enclosed by a shaft: the box of its starts moves to the box of its ends. At each node
// one 64-cell slab test of the shaft finds what any ray may meet; each cell that is occupied as
// well is tested with the rays' own slab test, in lanes, and visited with the rays that meet it.
// The answers are those of the rays' tests alone, and those are monotone (ray_slabs.h): the bits of
// occluded(). A shaft drops nothing that a ray's test accepts, since such a cell lies within twice
// the margin of the exact segment, the shaft is grown by twice the margin, and its own test by a
// margin more.
//
// V has: kWidth; Floats, with splat, load, add, sub, mul, div, fma, lesser, greater, absolute;
// lessOrEqual and less, as bits; select(bits, a, b); least(bits, v), greatest(bits, v) over lanes;
// gather; and Grid, the 64-cell test of one ray or shaft.
#pragma once

#include "voxel/dag_stream_work.h"

namespace shadowdag::stream {
namespace {

constexpr float kLargest = 1e30f;           // kLargestScale of ray_slabs.h
constexpr float kMargin = 0x1p-20f;         // slabMargin of ray_slabs.h
constexpr float kLeastDirection = 0x1p-24f; // makeRaySlabs of ray_slabs.h
constexpr uint32_t kMaxDepth = 9;           // nodes on a path: (kMaxResolutionLog2 + 1) / 2
/// With so few rays left each goes alone: the shaft of the packet is too wide for them.
constexpr int kFewRays = 1;

/// Slab tests of one segment, or of a shaft: near(p) = fma(p, invNear, cNear) on each axis.
struct Slabs {
    float invNear[3], invFar[3], cNear[3], cFar[3];
};

/// Numbers of cells in the order of visits, from the segment's end: number i stands for cell
/// i ^ order(octant), axis a's planes run backwards where bit a of endOctant is set.
inline uint32_t endOctant(uint32_t octant) {
    return octant ^ 7u;
}

/// x, y, z of the 64 cells of a node.
struct Places {
    float at[64][4];
    constexpr Places() : at() {
        for (uint32_t i = 0; i < 64; ++i)
            for (uint32_t a = 0; a < 3; ++a)
                at[i][a] = float((i >> (3 + a) & 1) * 2 + (i >> a & 1));
    }
};
constexpr Places kPlaces;

/// Indices of a node's 8 planes of an axis, in the order of visits: of the near planes of cells
/// 0..3, then of their far planes; by [backwards][against].
struct PlaneNumbers {
    float at[2][2][8];
    constexpr PlaneNumbers() : at() {
        for (int b = 0; b < 2; ++b)
            for (int against = 0; against < 2; ++against)
                for (int k = 0; k < 4; ++k) {
                    const int cell = b ? 3 - k : k;
                    at[b][against][k] = float(cell + against);
                    at[b][against][4 + k] = float(cell + 1 - against);
                }
    }
};
constexpr PlaneNumbers kPlaneNumbers;

inline const float* planeNumbers(uint32_t octant, int axis) {
    const uint32_t against = octant >> axis & 1;
    return kPlaneNumbers.at[against ^ 1][against];
}

inline uint64_t maskAt(const uint32_t* words, uint32_t address) {
    return words[address] | uint64_t(words[address + 1]) << 32;
}

/// Returns the address of what lies below a cell that is there.
inline uint32_t belowCell(const uint32_t* words, uint32_t address, uint64_t mask, uint32_t cell) {
    const uint64_t before = mask & ((uint64_t(1) << cell) - 1);
    return words[address + 2 + uint32_t(__builtin_popcountll(before))];
}

/// A node or leaf to visit: corner, side of its cells, and which rays meet it.
struct Visit {
    float corner[3];
    float side;
    uint32_t address;
    uint32_t active;
};

/// Returns whether the one ray of `grid` meets a voxel below the node.
template <class Grid>
bool meetsBelow(const uint32_t* words, const Grid& grid, uint32_t order, const Visit& start) {
    struct Entry {
        float corner[3];
        uint32_t address;
        uint64_t pending;
    };
    Entry stack[kMaxDepth];
    Entry node{{start.corner[0], start.corner[1], start.corner[2]}, start.address, 0};
    float side = start.side;
    node.pending = grid.ordered(words + node.address) & grid.hits(node.corner, side);
    if (side == 1)
        return node.pending != 0;
    uint64_t mask = maskAt(words, node.address);
    uint32_t depth = 0;
    while (true) {
        while (node.pending == 0) {
            if (depth-- == 0)
                return false;
            node = stack[depth];
            mask = maskAt(words, node.address);
            side *= 4;
        }
        const uint32_t cell = uint32_t(__builtin_ctzll(node.pending)) ^ order;
        node.pending &= node.pending - 1;
        const float* place = kPlaces.at[cell];
        Entry below;
        below.address = belowCell(words, node.address, mask, cell);
        for (int a = 0; a < 3; ++a)
            below.corner[a] = node.corner[a] + side * place[a];
        below.pending = grid.ordered(words + below.address) & grid.hits(below.corner, side * 0.25f);
        if (side == 4) {
            if (below.pending != 0)
                return true;
            continue;
        }
        stack[depth++] = node;
        node = below;
        mask = maskAt(words, node.address);
        side *= 0.25f;
    }
}

/// Up to V::kWidth rays.
template <class V> struct Rays {
    typename V::Floats from[3], to[3], inv[3], cNear[3], cFar[3];
    typename V::Floats margin;
    uint32_t dark;       ///< ends that are not numbers, or too large
    uint32_t against[3]; ///< bits of the lanes that run against the axis

    /// makeRaySlabs of ray_slabs.h in lanes.
    Rays(const float* segments, const uint32_t* index, float resolution) {
        using F = typename V::Floats;
        for (int a = 0; a < 3; ++a) {
            from[a] = V::gather(segments + a, index);
            to[a] = V::gather(segments + 3 + a, index);
        }
        F scale = V::splat(resolution);
        uint32_t fit = ~0u;
        for (int a = 0; a < 3; ++a) {
            const F f = V::absolute(from[a]), t = V::absolute(to[a]);
            // Not less: NaN as well.
            fit &= V::less(f, V::splat(kLargest)) & V::less(t, V::splat(kLargest));
            scale = V::greater(scale, V::greater(f, t));
        }
        dark = ~fit;
        margin = V::mul(scale, V::splat(kMargin));
        const F least = V::mul(scale, V::splat(kLeastDirection)), zero = V::splat(0.0f);
        for (int a = 0; a < 3; ++a) {
            const F straight = V::sub(to[a], from[a]);
            const F lifted = V::select(V::less(straight, zero), V::sub(zero, least), least);
            const F d = V::select(V::less(V::absolute(straight), least), lifted, straight);
            inv[a] = V::div(V::splat(1.0f), d);
            const F back = V::sub(zero, from[a]);
            const F before = V::mul(V::sub(back, margin), inv[a]);
            const F after = V::mul(V::sub(margin, from[a]), inv[a]);
            against[a] = V::less(d, zero);
            cNear[a] = V::select(against[a], after, before);
            cFar[a] = V::select(against[a], before, after);
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

    Slabs slabsOf(uint32_t lane) const {
        Slabs s;
        for (int a = 0; a < 3; ++a) {
            s.invNear[a] = s.invFar[a] = V::lane(inv[a], lane);
            s.cNear[a] = V::lane(cNear[a], lane);
            s.cFar[a] = V::lane(cFar[a], lane);
        }
        return s;
    }

    /// Returns the slabs of the shaft around lanes of one octant. The foremost coordinate of the
    /// moving box enters a near plane, the hindmost leaves a far plane.
    Slabs shaftOf(uint32_t lanes, uint32_t octant) const {
        Slabs s;
        const float grown = 4 * V::greatest(lanes, margin);
        const float least = grown * (kLeastDirection / (4 * kMargin));
        for (int a = 0; a < 3; ++a) {
            const float fromLow = V::least(lanes, from[a]) - grown,
                        fromHigh = V::greatest(lanes, from[a]) + grown,
                        toLow = V::least(lanes, to[a]) - grown,
                        toHigh = V::greatest(lanes, to[a]) + grown;
            const bool isAgainst = (octant >> a & 1) != 0;
            float low = toLow - fromLow, high = toHigh - fromHigh;
            if (isAgainst) {
                low = low > -least ? -least : low;
                high = high > -least ? -least : high;
            } else {
                low = low < least ? least : low;
                high = high < least ? least : high;
            }
            const float invLow = 1 / low, invHigh = 1 / high;
            s.invNear[a] = isAgainst ? invLow : invHigh;
            s.cNear[a] = isAgainst ? -fromLow * invLow : -fromHigh * invHigh;
            s.invFar[a] = isAgainst ? invHigh : invLow;
            s.cFar[a] = isAgainst ? -fromHigh * invHigh : -fromLow * invLow;
        }
        return s;
    }

    /// Returns which lanes meet the box between these planes, x, y, z each.
    uint32_t meet(float nearX, float nearY, float nearZ, float farX, float farY, float farZ) const {
        const auto near = [&](int a, float p) { return V::fma(V::splat(p), inv[a], cNear[a]); };
        const auto far = [&](int a, float p) { return V::fma(V::splat(p), inv[a], cFar[a]); };
        const auto enter = V::greater(V::greater(near(0, nearX), near(1, nearY)),
                                      V::greater(near(2, nearZ), V::splat(0.0f)));
        const auto leave = V::lesser(V::lesser(far(0, farX), far(1, farY)),
                                     V::lesser(far(2, farZ), V::splat(1.0f)));
        return V::lessOrEqual(enter, leave);
    }
};

/// Returns which of the active rays, of one octant, meet a voxel below the starts.
template <class V>
uint32_t tracePacket(const Work& work, const Rays<V>& rays, uint32_t active, uint32_t octant) {
    const uint32_t* words = work.words;
    const uint32_t order = endOctant(octant) * 9;
    const typename V::Grid grid(rays.shaftOf(active, octant), octant);
    const float* numbers[3];
    for (int a = 0; a < 3; ++a)
        numbers[a] = planeNumbers(octant, a);
    Visit stack[64 * kMaxDepth];
    uint32_t blocked = 0;
    for (size_t s = 0; s < work.startCount; ++s) {
        const Start& start = work.starts[s];
        stack[0] = {{start.corner[0], start.corner[1], start.corner[2]},
                    float(uint32_t(1) << (start.level - 2)),
                    start.address,
                    active};
        size_t count = 1;
        while (count > 0) {
            const Visit visit = stack[--count];
            const uint32_t lanes = visit.active & ~blocked;
            if (lanes == 0)
                continue;
            if (__builtin_popcount(lanes) <= kFewRays) {
                for (uint32_t left = lanes; left != 0; left &= left - 1) {
                    const uint32_t lane = uint32_t(__builtin_ctz(left));
                    const typename V::Grid own(rays.slabsOf(lane), octant);
                    blocked |= uint32_t(meetsBelow(words, own, order, visit)) << lane;
                }
                continue;
            }
            uint64_t met =
                grid.ordered(words + visit.address) & grid.hits(visit.corner, visit.side);
            float planes[3][8];
            for (int a = 0; a < 3; ++a)
                for (int k = 0; k < 8; ++k)
                    planes[a][k] = visit.corner[a] + visit.side * numbers[a][k];
            const auto meet = [&](uint32_t i) {
                const uint32_t x = (i & 1) | (i >> 2 & 2), y = (i >> 1 & 1) | (i >> 3 & 2),
                               z = (i >> 2 & 1) | (i >> 4 & 2);
                return rays.meet(planes[0][x], planes[1][y], planes[2][z], planes[0][4 + x],
                                 planes[1][4 + y], planes[2][4 + z]);
            };
            if (visit.side == 1) {
                for (; met != 0; met &= met - 1)
                    blocked |= meet(uint32_t(__builtin_ctzll(met))) & lanes;
                continue;
            }
            // Last visited first: the stack turns them round.
            const uint64_t mask = maskAt(words, visit.address);
            while (met != 0) {
                const uint32_t i = 63u - uint32_t(__builtin_clzll(met));
                met ^= uint64_t(1) << i;
                const uint32_t cell = i ^ order;
                const float* place = kPlaces.at[cell];
                Visit& below = stack[count];
                for (int a = 0; a < 3; ++a)
                    below.corner[a] = visit.corner[a] + visit.side * place[a];
                below.side = visit.side * 0.25f;
                below.address = belowCell(words, visit.address, mask, cell);
                below.active = meet(i) & lanes;
                count += below.active != 0;
            }
        }
    }
    return blocked;
}

template <class V> void traceAll(const Work& work) {
    for (size_t first = 0; first < work.count; first += V::kWidth) {
        const size_t left = work.count - first;
        const uint32_t count = left < V::kWidth ? uint32_t(left) : V::kWidth;
        uint32_t index[V::kWidth];
        for (uint32_t i = 0; i < V::kWidth; ++i)
            index[i] = 6 * (i < count ? i : count - 1);
        const uint32_t all = uint32_t((uint64_t(1) << count) - 1);
        const Rays<V> rays(work.segments + 6 * first, index, work.resolution);
        uint32_t blocked = rays.dark & all;
        uint32_t waiting = all & ~blocked;
        while (waiting != 0) {
            const uint32_t octant = rays.octantOf(uint32_t(__builtin_ctz(waiting)));
            const uint32_t active = waiting & rays.lanesOf(octant);
            waiting &= ~active;
            blocked |= tracePacket(work, rays, active, octant);
        }
        for (uint32_t i = 0; i < count; ++i)
            work.blocked[first + i] = uint8_t(blocked >> i & 1);
    }
}

} // namespace
} // namespace shadowdag::stream
