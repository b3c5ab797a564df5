// SPDX-License-Identifier: Apache-2.0
// The source of ray streams, over a vector type V that the including file defines: packets
// of V::kWidth rays of one octant through the wide form of a DAG (dag.h). Only dag_stream_*.cpp
// include it, each compiled for its processor: everything is in an anonymous namespace and nothing
// inline of other headers is used (dag_stream_work.h says why).
//
// A packet is enclosed by a shaft: the box of its starts moves to the box of its ends. At each node
// one 64-cell slab test of the shaft finds the cells that any ray may meet; each of them that is
// occupied is tested with the rays' own slab test, in lanes, and visited with the rays that meet
// it. The results are those of the rays' tests alone, and those are monotone (ray_slabs.h), so they
// are the bits of occluded(). A shaft skips no cell that a ray's test accepts: such a cell lies
// within twice the margin of the exact segment, the shaft is grown by twice the margin, and its own
// test by another margin.
//
// V has: kWidth; Floats, with splat, lane, sub, mul, div, fma, lesser, greater, absolute;
// lessOrEqual and less, as bits; select(bits, a, b); least(bits, v), greatest(bits, v) over lanes;
// gather; and Grid, the 64-cell test of one ray or shaft, with the node's planes.
#pragma once

#include "voxel/dag_stream_work.h"
#include "voxel/ray_slabs_leaf.h" // its constants: a function would be compiled for one processor

namespace shadowdag::stream {
namespace {

constexpr uint32_t kMaxDepth = 9; // nodes on a path: (kMaxResolutionLog2 + 1) / 2
/// With so few rays left of a packet each is traced alone, because the packet's shaft is too wide
/// for them. Measured for 8 to 32 rays, LAYOUT.md.
constexpr int fewRays(uint32_t width) {
    return int(width / 8);
}

/// Rays whose ends lie within so many voxels of each other are assumed to go to one light.
constexpr float kSameEnd = 16;

/// Slab tests of one segment, or of a shaft: near(p) = fma(p, invNear, cNear) on each axis.
struct Slabs {
    float invNear[3], invFar[3], cNear[3], cFar[3];
};

/// Numbers of cells in the order of visits, from the segment's end: number i is cell i ^
/// order(octant); axis a's planes run backwards where bit a of endOctant is set.
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

/// Returns the address of the node below an occupied cell.
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
            fit &= V::less(f, V::splat(kLargestScale)) & V::less(t, V::splat(kLargestScale));
            scale = V::greater(scale, V::greater(f, t));
        }
        dark = ~fit;
        margin = V::mul(scale, V::splat(kSlabMargin));
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
    /// Returns how many rays, starting with the first, go to the first one's light.
    uint32_t countToFirstLight() const {
        uint32_t same = ~0u;
        for (int a = 0; a < 3; ++a)
            same &= V::less(V::absolute(V::sub(to[a], V::splat(V::lane(to[a], 0)))),
                            V::splat(kSameEnd));
        const uint32_t other = ~same;
        return other == 0 ? 32 : uint32_t(__builtin_ctz(other));
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
        const float least = grown * (kLeastDirection / (4 * kSlabMargin));
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

/// Traces some rays of one octant through the wide form from their end, because near the start they
/// meet more cells, those of the surface that they left.
template <class V> class Packet {
public:
    Packet(const uint32_t* words, const Rays<V>& rays, uint32_t active, uint32_t octant)
        : words_(words), rays_(rays), octant_(octant), order_(endOctant(octant) * 9),
          grid_(rays.shaftOf(active, octant), octant) {}

    uint32_t blocked() const { return blocked_; }
    /// The last node above leaves that stopped a ray; side 0: none.
    const Visit& stoppedBy() const { return stoppedBy_; }

    /// Traces `lanes` through what lies below the nodes and leaves.
    void trace(const Start* starts, size_t count, uint32_t lanes) {
        for (size_t first = 0; first < count; first += kStarts) {
            const size_t most = count - first < kStarts ? count - first : kStarts;
            // The last one first: the stack turns them round.
            uint32_t depth = 0;
            for (size_t s = first + most; s-- > first;) {
                const Start& start = starts[s];
                depth += enter({{start.corner[0], start.corner[1], start.corner[2]},
                                float(uint32_t(1) << start.level) * 0.25f,
                                start.address,
                                lanes},
                               depth);
            }
            run(depth);
            if ((lanes & ~blocked_) == 0)
                return;
        }
    }
    /// The same of one node.
    void trace(const Visit& visit) { run(enter(visit, 0)); }

private:
    static constexpr size_t kStarts = 64;

    /// Puts a node to number `depth` of the stack with those rays that meet it; returns whether
    /// there are any.
    uint32_t enter(const Visit& visit, uint32_t depth) {
        float near[3], far[3];
        for (int a = 0; a < 3; ++a) {
            const float low = visit.corner[a], high = low + 4 * visit.side;
            const bool isAgainst = (octant_ >> a & 1) != 0;
            near[a] = isAgainst ? high : low;
            far[a] = isAgainst ? low : high;
        }
        Visit& entered = stack_[depth];
        entered = visit;
        entered.active &= rays_.meet(near[0], near[1], near[2], far[0], far[1], far[2]);
        return entered.active != 0;
    }

    void run(uint32_t count) {
        while (count > 0) {
            const Visit visit = stack_[--count];
            const uint32_t lanes = visit.active & ~blocked_;
            if (lanes == 0)
                continue;
            if (__builtin_popcount(lanes) <= fewRays(V::kWidth)) {
                visitFew(visit, lanes);
                continue;
            }
            if (visit.side == 4) {
                visitBlock(visit, lanes);
                continue;
            }
            if (visit.side == 1) {
                visitLeaf(visit);
                continue;
            }
            uint64_t met =
                grid_.ordered(words_ + visit.address) & grid_.hits(visit.corner, visit.side);
            alignas(64) float planes[24];
            grid_.planes(visit.corner, visit.side, planes);
            // Last visited first: the stack turns them round.
            const uint64_t mask = maskAt(words_, visit.address);
            while (met != 0) {
                const uint32_t i = 63u - uint32_t(__builtin_clzll(met));
                met ^= uint64_t(1) << i;
                count += descend(visit, mask, planes, i, lanes, stack_[count]);
            }
        }
    }

    uint32_t meet(const float* planes, uint32_t i) const {
        const uint32_t x = (i & 1) | (i >> 2 & 2), y = (i >> 1 & 1) | (i >> 3 & 2),
                       z = (i >> 2 & 1) | (i >> 4 & 2);
        return rays_.meet(planes[x], planes[8 + y], planes[16 + z], planes[4 + x], planes[12 + y],
                          planes[20 + z]);
    }

    /// Sets `below` to the node or leaf in cell i; returns whether rays meet it.
    uint32_t descend(const Visit& visit, uint64_t mask, const float* planes, uint32_t i,
                     uint32_t lanes, Visit& below) const {
        const uint32_t cell = i ^ order_;
        const float* place = kPlaces.at[cell];
        for (int a = 0; a < 3; ++a)
            below.corner[a] = visit.corner[a] + visit.side * place[a];
        below.side = visit.side * 0.25f;
        below.address = belowCell(words_, visit.address, mask, cell);
        __builtin_prefetch(words_ + below.address);
        below.active = meet(planes, i) & lanes;
        return below.active != 0;
    }

    void visitFew(const Visit& visit, uint32_t lanes) {
        for (; lanes != 0; lanes &= lanes - 1) {
            const uint32_t lane = uint32_t(__builtin_ctz(lanes));
            const typename V::Grid own(rays_.slabsOf(lane), octant_);
            blocked_ |= uint32_t(meetsBelow(words_, own, order_, visit)) << lane;
        }
    }

    void visitLeaf(const Visit& leaf) {
        uint32_t lanes = leaf.active & ~blocked_;
        if (__builtin_popcount(lanes) <= fewRays(V::kWidth)) {
            for (; lanes != 0; lanes &= lanes - 1) {
                const uint32_t lane = uint32_t(__builtin_ctz(lanes));
                const typename V::Grid own(rays_.slabsOf(lane), octant_);
                const uint64_t met = own.ordered(words_ + leaf.address) & own.hits(leaf.corner, 1);
                blocked_ |= uint32_t(met != 0) << lane;
            }
            return;
        }
        uint64_t met = grid_.ordered(words_ + leaf.address) & grid_.hits(leaf.corner, 1);
        alignas(64) float planes[24];
        grid_.planes(leaf.corner, 1, planes);
        for (; met != 0; met &= met - 1)
            blocked_ |= meet(planes, uint32_t(__builtin_ctzll(met))) & lanes;
    }

    void visitBlock(const Visit& visit, uint32_t lanes) {
        uint64_t met = grid_.ordered(words_ + visit.address) & grid_.hits(visit.corner, 4);
        alignas(64) float planes[24];
        grid_.planes(visit.corner, 4, planes);
        const uint64_t mask = maskAt(words_, visit.address);
        Visit leaves[64];
        uint32_t count = 0;
        for (; met != 0; met &= met - 1)
            count +=
                descend(visit, mask, planes, uint32_t(__builtin_ctzll(met)), lanes, leaves[count]);
        const uint32_t before = blocked_;
        for (uint32_t l = 0; l < count; ++l)
            visitLeaf(leaves[l]);
        if (blocked_ != before)
            stoppedBy_ = visit;
    }

    const uint32_t* words_;
    const Rays<V>& rays_;
    uint32_t octant_, order_, blocked_ = 0;
    typename V::Grid grid_;
    Visit stoppedBy_ = {};
    Visit stack_[kStarts + 64 * kMaxDepth];
};

/// Returns which of the active rays, of one octant, meet a voxel below the starts. The node that
/// stopped the previous packet, if all of that was dark, is tried first and then updated:
/// `stopper`, of side 0 if there is none. This saves a tenth where packets are dense and costs
/// nothing elsewhere.
template <class V>
uint32_t tracePacket(const Work& work, const Rays<V>& rays, uint32_t active, uint32_t octant,
                     Visit& stopper) {
    Packet<V> packet(work.words, rays, active, octant);
    if (stopper.side != 0) {
        stopper.active = active;
        packet.trace(stopper);
    }
    if (packet.blocked() != active)
        packet.trace(work.starts, work.startCount, active);
    stopper = packet.stoppedBy();
    if (packet.blocked() != active)
        stopper.side = 0;
    return packet.blocked();
}

template <class V> void traceAll(const Work& work) {
    Visit stopper = {};
    size_t first = 0;
    while (first < work.count) {
        const size_t left = work.count - first;
        uint32_t count = left < V::kWidth ? uint32_t(left) : V::kWidth;
        uint32_t index[V::kWidth];
        for (uint32_t i = 0; i < V::kWidth; ++i)
            index[i] = 6 * (i < count ? i : count - 1);
        const Rays<V> rays(work.segments + 6 * first, index, work.resolution);
        // A packet ends where the light changes, unless it would be almost empty.
        const uint32_t toFirstLight = rays.countToFirstLight();
        if (toFirstLight < count && toFirstLight >= V::kWidth / 4)
            count = toFirstLight;
        const uint32_t all = uint32_t((uint64_t(1) << count) - 1);
        uint32_t blocked = rays.dark & all;
        uint32_t waiting = all & ~blocked;
        while (waiting != 0) {
            const uint32_t octant = rays.octantOf(uint32_t(__builtin_ctz(waiting)));
            const uint32_t active = waiting & rays.lanesOf(octant);
            waiting &= ~active;
            blocked |= tracePacket(work, rays, active, octant, stopper);
        }
        for (uint32_t i = 0; i < count; ++i)
            work.blocked[first + i] = uint8_t(blocked >> i & 1);
        first += count;
    }
}

} // namespace
} // namespace shadowdag::stream
