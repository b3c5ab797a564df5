// SPDX-License-Identifier: Apache-2.0
// The depth of the farthest receiver in every cell of a projection map, and the test that culling
// needs: does any cell of a rectangle have a receiver this deep? Olsson et al. 2015 use one depth
// per face and name "better max-depth culling" as future work (sec. VIII).
#pragma once

#include "cuda/atomics.h"
#include "cuda/view.h"
#include "shadowmap/cube_face.h"

#include <cstring>

namespace shadowdag {

/// The projection map has 32 x 32 cells a face, whatever the resolution of the map.
constexpr uint32_t kProjectionMapSize = 32;
constexpr uint32_t kProjectionWordsPerMap = kFaceCount * kProjectionMapSize;
constexpr uint32_t kCellsPerFace = kProjectionMapSize * kProjectionMapSize;
constexpr uint32_t kCellsPerMap = kFaceCount * kCellsPerFace;

/// Blocks of 4 x 4 cells are the level above, so that wide rectangles need to test only 64 of them.
constexpr uint32_t kBlockCellsLog2 = 2;
constexpr uint32_t kBlocksPerSide = kProjectionMapSize >> kBlockCellsLog2;
constexpr uint32_t kBlocksPerFace = kBlocksPerSide * kBlocksPerSide;
constexpr uint32_t kBlocksPerMap = kFaceCount * kBlocksPerFace;

SDAG_HD inline uint32_t floatBits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

SDAG_HD inline float bitsFloat(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/// Returns the bits of a depth >= 0 as cells hold it: at least 1, since 0 is a cell without
/// receivers. Ordered as the depths are. A depth of -0, which a box that ends at the light's plane
/// has on one face of two, counts as 0: its own bits would be the greatest of all.
SDAG_HD inline uint32_t depthBits(float depth) {
    return depth > 0.0f ? floatBits(depth) : 1u;
}

/// Cells of a face, from the first to the last of both axes.
struct CellRect {
    uint32_t u0, u1, v0, v1;
};

/// Returns the cells that a rectangle of a face touches.
SDAG_HD inline CellRect cellsOf(const FaceRect& rect) {
    return {faceCell(rect.uMin, kProjectionMapSize), faceCell(rect.uMax, kProjectionMapSize),
            faceCell(rect.vMin, kProjectionMapSize), faceCell(rect.vMax, kProjectionMapSize)};
}

/// Returns the index of a cell among those of all maps: maps, faces, rows of v, u fastest.
SDAG_HD inline uint32_t cellIndex(uint32_t mapIndex, uint32_t face, uint32_t u, uint32_t v) {
    return (mapIndex * kFaceCount + face) * kCellsPerFace + v * kProjectionMapSize + u;
}

/// Returns the index of a block of cells, in the same order.
SDAG_HD inline uint32_t blockIndex(uint32_t mapIndex, uint32_t face, uint32_t u, uint32_t v) {
    return (mapIndex * kFaceCount + face) * kBlocksPerFace + v * kBlocksPerSide + u;
}

/// The farthest depth at which a blocker can matter to receivers, as depthBits; 0 for no receiver.
/// cells: kCellsPerMap a map; blocks: kBlocksPerMap a map, the greatest of their cells.
struct CellDepthView {
    View<const uint32_t> cells;
    View<const uint32_t> blocks;

    SDAG_HD bool empty() const { return cells.empty(); }

    /// Returns whether test(cell index, its depth) holds for a cell of the rectangle whose depth is
    /// at least `bits`; tests no other cells.
    template <class Test>
    SDAG_HD bool any(uint32_t mapIndex, uint32_t face, const CellRect& rect, uint32_t bits,
                     const Test& test) const {
        for (uint32_t bv = rect.v0 >> kBlockCellsLog2; bv <= rect.v1 >> kBlockCellsLog2; ++bv)
            for (uint32_t bu = rect.u0 >> kBlockCellsLog2; bu <= rect.u1 >> kBlockCellsLog2; ++bu)
                if (anyOfBlock(mapIndex, face, rect, bits, bu, bv, test))
                    return true;
        return false;
    }
    /// The same for the cells of block (bu, bv), which the rectangle touches.
    template <class Test>
    SDAG_HD bool anyOfBlock(uint32_t mapIndex, uint32_t face, const CellRect& rect, uint32_t bits,
                            uint32_t bu, uint32_t bv, const Test& test) const {
        if (blocks[blockIndex(mapIndex, face, bu, bv)] < bits)
            return false;
        constexpr uint32_t kLast = (1u << kBlockCellsLog2) - 1;
        const uint32_t u = bu << kBlockCellsLog2, v = bv << kBlockCellsLog2;
        const uint32_t uEnd = glm::min(rect.u1, u + kLast), vEnd = glm::min(rect.v1, v + kLast);
        for (uint32_t y = glm::max(rect.v0, v); y <= vEnd; ++y)
            for (uint32_t x = glm::max(rect.u0, u); x <= uEnd; ++x) {
                const uint32_t cell = cellIndex(mapIndex, face, x, y);
                if (cells[cell] >= bits && test(cell, cells[cell]))
                    return true;
            }
        return false;
    }

    /// Returns whether a receiver under a cell of the rectangle lies at `bits` or beyond.
    SDAG_HD bool reaches(uint32_t mapIndex, uint32_t face, const CellRect& rect,
                         uint32_t bits) const {
        return any(mapIndex, face, rect, bits, [](uint32_t, uint32_t) { return true; });
    }
};

/// Raises the depth of the cells of a rectangle to `bits`. Blocks that lie within it are raised
/// instead of their cells, until GatherBlock: a sixteenth of the work for wide rectangles.
SDAG_HD inline void raiseCells(View<uint32_t> cells, View<uint32_t> blocks, uint32_t mapIndex,
                               uint32_t face, const CellRect& rect, uint32_t bits) {
    constexpr uint32_t kLast = (1u << kBlockCellsLog2) - 1;
    for (uint32_t bv = rect.v0 >> kBlockCellsLog2; bv <= rect.v1 >> kBlockCellsLog2; ++bv)
        for (uint32_t bu = rect.u0 >> kBlockCellsLog2; bu <= rect.u1 >> kBlockCellsLog2; ++bu) {
            const uint32_t u = bu << kBlockCellsLog2, v = bv << kBlockCellsLog2;
            const uint32_t u0 = glm::max(rect.u0, u), u1 = glm::min(rect.u1, u + kLast);
            const uint32_t v0 = glm::max(rect.v0, v), v1 = glm::min(rect.v1, v + kLast);
            if (u1 - u0 == kLast && v1 - v0 == kLast) {
                atomicMaxRelaxed(&blocks[blockIndex(mapIndex, face, bu, bv)], bits);
                continue;
            }
            for (uint32_t y = v0; y <= v1; ++y)
                for (uint32_t x = u0; x <= u1; ++x)
                    atomicMaxRelaxed(&cells[cellIndex(mapIndex, face, x, y)], bits);
        }
}

/// Completes block i and its cells as CellDepthView describes them.
struct GatherBlock {
    View<uint32_t> cells;
    View<uint32_t> blocks;

    size_t itemCount() const { return blocks.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t face = uint32_t(i) / kBlocksPerFace, block = uint32_t(i) % kBlocksPerFace;
        const uint32_t first = cellIndex(0, face, (block % kBlocksPerSide) << kBlockCellsLog2,
                                         (block / kBlocksPerSide) << kBlockCellsLog2);
        const uint32_t least = blocks[i];
        uint32_t greatest = least;
        for (uint32_t v = 0; v < 1u << kBlockCellsLog2; ++v)
            for (uint32_t u = 0; u < 1u << kBlockCellsLog2; ++u) {
                uint32_t& cell = cells[first + v * kProjectionMapSize + u];
                cell = glm::max(cell, least);
                greatest = glm::max(greatest, cell);
            }
        blocks[i] = greatest;
    }
};

} // namespace shadowdag
