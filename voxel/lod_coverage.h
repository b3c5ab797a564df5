// SPDX-License-Identifier: Apache-2.0
// How much of a leaf's cell, and of its octants, is covered: how many of the columns along x, y or
// z, whichever are more, hold a voxel. Larger cells: withCoverage in dag_lod.h.
#pragma once

#include "voxel/bits.h"

namespace shadowdag::detail {

/// The voxels of a leaf (bit number x0 y0 z0 x1 y1 z1) whose two bits of the axis are 0.
SDAG_HD inline uint64_t leafColumns(uint32_t axis) {
    return axis == 0 ? 0x0055005500550055u : axis == 1 ? 0x0000333300003333u : 0x000000000f0f0f0fu;
}

/// Returns the columns of a leaf along an axis that hold a voxel, at their first voxel's bit.
SDAG_HD inline uint64_t coveredColumns(uint64_t voxels, uint32_t axis) {
    voxels |= voxels >> (1u << axis);
    voxels |= voxels >> (8u << axis);
    return voxels & leafColumns(axis);
}

SDAG_HD inline uint32_t bitCount64(uint64_t bits) {
    return bitCount32(uint32_t(bits)) + bitCount32(uint32_t(bits >> 32));
}

/// Returns a share of columns as a coverage: 255 when all are covered, rounded down, never 0
/// (unknown) if there is a voxel.
SDAG_HD inline uint32_t coverageByte(uint32_t covered, uint32_t columns) {
    const uint32_t byte = 255u * covered / columns;
    return byte != 0 ? byte : 1;
}

/// Returns the coverage of a leaf's 4^3 cell.
SDAG_HD inline uint32_t leafCoverage(uint64_t voxels) {
    uint32_t most = 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint32_t covered = bitCount64(coveredColumns(voxels, axis));
        most = covered > most ? covered : most;
    }
    return coverageByte(most, 16);
}

/// Returns the coverage of a 2^3 octant.
SDAG_HD inline uint32_t octantCoverage(uint32_t voxels) {
    const uint32_t x = bitCount32((voxels | voxels >> 1) & 0x55u),
                   y = bitCount32((voxels | voxels >> 2) & 0x33u),
                   z = bitCount32((voxels | voxels >> 4) & 0x0fu);
    const uint32_t most = x > y ? x : y;
    return coverageByte(most > z ? most : z, 4);
}

} // namespace shadowdag::detail
