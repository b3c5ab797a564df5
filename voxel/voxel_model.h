// SPDX-License-Identifier: Apache-2.0
// A probability model of a DAG, level by level and voxel by voxel: the contexts in which
// compact_encoding codes it. One text for writing and reading; Coder is RangeEncoder or
// RangeDecoder.
//
// Voxels are coded in cubes of 16^3, coarse to fine: the eight cells in an occupied cell are one
// symbol. First comes whether they are the same as last time in the same surroundings (70 % are);
// if not, they follow one by one. The surroundings are the cells around that are coded already:
// fully on the near sides, at the coarser scale on the far sides. Flat surfaces therefore take few
// bits.
#pragma once

#include "voxel/range_coder.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace shadowdag {

/// The state of a cube of 16^3 voxels as far as it is coded: occupancy at sides of 1, 2, 4 voxels
/// (scale 0, 1, 2). Cells not coded yet have the value of their coarser cell; cells outside are
/// occupied.
class KnownCube {
public:
    KnownCube() { forget(); }

    void forget() { std::memset(rows_, 0xff, sizeof rows_); }
    /// Returns cells x - 1 and up, lowest bit first; coordinates from -1 to the cube's size.
    uint32_t row(uint32_t scale, int x, int y, int z) const {
        return rows_[scale][(z + 1) * kStride + y + 1] >> x;
    }
    /// Sets `count` cells from x on.
    void setRow(uint32_t scale, int x, int y, int z, uint32_t count, uint32_t bits) {
        uint32_t& r = rows_[scale][(z + 1) * kStride + y + 1];
        const uint32_t field = ((1u << count) - 1) << (x + 1);
        r = (r & ~field) | bits << (x + 1);
    }
    /// Sets the cell and its content to empty.
    void setEmpty(uint32_t scale, int x, int y, int z) {
        for (uint32_t s = 0; s <= std::min(scale, 2u); ++s) {
            const uint32_t up = scale - s;
            const int side = 1 << up;
            for (int j = 0; j < side; ++j)
                for (int k = 0; k < side; ++k)
                    setRow(s, x << up, (y << up) + j, (z << up) + k, uint32_t(side), 0);
        }
    }
    /// Sets the eight cells of the coarser cell (x, y, z) to a mask, and the content of empty ones
    /// to empty.
    void setOctant(uint32_t scale, int x, int y, int z, uint32_t mask) {
        for (int k = 0; k < 4; ++k)
            setRow(scale, 2 * x, 2 * y + (k & 1), 2 * z + (k >> 1), 2, mask >> (2 * k) & 3);
        if (scale == 0)
            return;
        for (int c = 0; c < 8; ++c)
            if ((mask >> c & 1) == 0)
                setEmpty(scale, 2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2));
    }
    /// Sets the leaf at (x, y, z), in leaves, with all its cells.
    void setLeaf(int x, int y, int z, uint64_t voxels) {
        uint32_t octants = 0;
        for (int o = 0; o < 8; ++o) {
            const uint32_t mask = uint32_t(voxels >> (8 * o)) & 0xffu;
            octants |= uint32_t(mask != 0) << o;
            setOctant(0, 2 * x + (o & 1), 2 * y + (o >> 1 & 1), 2 * z + (o >> 2), mask);
        }
        for (int k = 0; k < 4; ++k)
            setRow(1, 2 * x, 2 * y + (k & 1), 2 * z + (k >> 1), 2, octants >> (2 * k) & 3);
        setRow(2, x, y, z, 1, voxels != 0);
    }

private:
    static constexpr int kStride = 18;
    uint32_t rows_[3][kStride * kStride];
};

/// Learns while it codes. The same calls with the same values keep encoder's and decoder's models
/// equal.
class VoxelModel {
public:
    /// @param nodeCount of the DAG: small ones get small tables
    explicit VoxelModel(uint64_t nodeCount) {
        uint32_t log2 = 8;
        while (log2 < 18 && (uint64_t(1) << log2) < 8 * nodeCount)
            ++log2;
        shift_ = 64 - log2;
        for (int s = 0; s < 3; ++s) {
            octants_[s].resize(size_t(1) << log2);
            cells_[s].resize(size_t(1) << log2);
        }
        followers_.resize(size_t(1) << log2);
    }

    KnownCube known; ///< of the cube being coded

    /// Codes the eight cells of scale `scale` in the coarser cell (x, y, z), which is occupied, and
    /// writes them into the state. Returns them; 0 (none) only from damaged data.
    template <class Coder>
    uint32_t octant(Coder& coder, uint32_t scale, int x, int y, int z, uint32_t mask) {
        AdaptiveBit& last = octants_[scale][at(octantContext(scale, 2 * x, 2 * y, 2 * z))];
        if (coder.bit(last, mask == last.owners)) {
            mask = last.owners;
            known.setOctant(scale, x, y, z, mask);
            return mask;
        }
        const uint32_t truth = mask;
        mask = 0;
        for (int c = 0; c < 8; ++c) {
            const int cx = 2 * x + (c & 1), cy = 2 * y + (c >> 1 & 1), cz = 2 * z + (c >> 2);
            uint32_t bit = 1; // the last one when there was none before it
            if (c < 7 || mask != 0)
                bit = coder.bit(cells_[scale][at(cellContext(scale, cx, cy, cz))], truth >> c & 1);
            mask |= bit << c;
            if (bit == 0)
                known.setEmpty(scale, cx, cy, cz);
        }
        if (last.chance < 32768)
            last.owners = uint8_t(mask);
        return mask;
    }

    /// Codes a child mask. Returns it; may be 0 from damaged data.
    template <class Coder> uint32_t childMask(Coder& coder, uint32_t level, uint32_t mask) {
        uint32_t path = 1;
        for (int c = 0; c < 8; ++c)
            path = path << 1 | coder.bit(masks_[level][path], mask >> c & 1);
        uint32_t result = 0;
        for (int c = 0; c < 8; ++c)
            result |= (path >> (7 - c) & 1) << c;
        return result;
    }

    /// Codes whether a child is new; `path` is 1 for a node's first child, and kept between its
    /// children.
    template <class Coder> bool isNew(Coder& coder, uint32_t level, uint32_t& path, bool value) {
        const uint32_t bit = coder.bit(flags_[level][path], value);
        path = (path << 1 | bit) & 0xffu;
        return bit != 0;
    }

    /// Codes a child seen before: whether it is the one that followed the child before it last
    /// time, else how many nodes back it was. Returns its number, or `seen` from damaged data.
    /// @param context of the child, for follow()
    /// @param number of the child; ignored by decoders
    template <class Coder>
    uint32_t reference(Coder& coder, uint32_t level, uint64_t context, uint32_t number,
                       uint32_t seen) {
        Follower& follower = followers_[at(context)];
        if (follower.number < seen && coder.bit(follower.isRight, follower.number == number))
            return follower.number;
        const uint32_t back = distance(coder, level, seen - number);
        return back <= seen ? seen - back : seen;
    }
    /// Stores the child that followed, new or not.
    void follow(uint64_t context, uint32_t number) { followers_[at(context)].number = number; }

    /// Returns the context of child c of a node of a level, after the child of that number (~0:
    /// none).
    static uint64_t childContext(uint32_t level, uint32_t c, uint32_t before) {
        return (uint64_t(before) << 3 | c) << 5 | level;
    }

private:
    struct Follower {
        uint32_t number = ~0u;
        AdaptiveBit isRight;
    };

    /// Codes a distance, 1 or more: its bit length, three bits after the first, the rest even.
    template <class Coder> uint32_t distance(Coder& coder, uint32_t level, uint32_t value) {
        const uint32_t truth = 31u - uint32_t(std::countl_zero(value | 1u));
        uint32_t path = 1;
        for (int i = 4; i >= 0; --i)
            path = path << 1 | coder.bit(lengths_[level][path], truth >> i & 1);
        const uint32_t length = path & 31u;
        uint32_t result = 1, ahead = 1;
        for (uint32_t i = length; i-- > 0;) {
            const uint32_t bit = value >> i & 1;
            const uint32_t got =
                ahead < 8 ? coder.bit(mantissas_[level][length][ahead], bit) : coder.evenBit(bit);
            result = result << 1 | got;
            ahead = ahead << 1 | got;
        }
        return result;
    }

    size_t at(uint64_t context) const { return size_t(context * 0x9e3779b97f4a7c15u >> shift_); }
    /// Returns the surroundings of the octant at (x, y, z), in cells: those that touch its near
    /// sides and edges, and its coarser neighbours at the far ones. More cells were tried and gave
    /// larger files, because each distinct surrounding is learned separately.
    uint64_t octantContext(uint32_t s, int x, int y, int z) const {
        uint64_t k = known.row(s, x, y - 1, z - 1) >> 1 & 3u;
        k = k << 4 | (known.row(s, x, y, z - 1) & 15u);
        k = k << 4 | (known.row(s, x, y + 1, z - 1) & 15u);
        k = k << 4 | (known.row(s, x, y - 1, z) & 15u);
        k = k << 4 | (known.row(s, x, y - 1, z + 1) & 15u);
        const uint32_t middle = known.row(s, x, y, z);
        k = k << 2 | (middle & 1u) | (middle >> 2 & 2u);
        k = k << 1 | (known.row(s, x, y + 1, z) & 1u);
        k = k << 1 | (known.row(s, x, y, z + 1) & 1u);
        k = k << 1 | (known.row(s, x, y + 1, z + 1) & 1u);
        k = k << 1 | (known.row(s, x, y + 2, z) >> 1 & 1u);
        return k << 1 | (known.row(s, x, y, z + 2) >> 1 & 1u);
    }
    /// The surroundings of the cell, and its position in its octant.
    uint64_t cellContext(uint32_t s, int x, int y, int z) const {
        uint64_t k = known.row(s, x, y - 1, z - 1) & 7u;
        k = k << 3 | (known.row(s, x, y, z - 1) & 7u);
        k = k << 2 | (known.row(s, x, y + 1, z - 1) & 3u);
        k = k << 3 | (known.row(s, x, y - 1, z) & 7u);
        const uint32_t middle = known.row(s, x, y, z);
        k = k << 2 | (middle & 1u) | (middle >> 1 & 2u);
        k = k << 2 | (known.row(s, x, y + 1, z) & 3u);
        k = k << 2 | (known.row(s, x, y - 1, z + 1) & 3u);
        k = k << 2 | (known.row(s, x, y, z + 1) & 3u);
        return k << 3 | uint64_t((x & 1) | (y & 1) << 1 | (z & 1) << 2);
    }

    static constexpr uint32_t kLevels = 18;
    uint32_t shift_;
    std::vector<AdaptiveBit> octants_[3]; ///< by context: the eight cells coded last
    std::vector<AdaptiveBit> cells_[3];
    std::vector<Follower> followers_;
    AdaptiveBit masks_[kLevels][256], flags_[kLevels][256], lengths_[kLevels][32];
    AdaptiveBit mantissas_[kLevels][32][8];
};

} // namespace shadowdag
