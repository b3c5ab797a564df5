// SPDX-License-Identifier: Apache-2.0
// Clusters: the occupied cells of the grid and their samples; cluster_bounds.h bounds them,
// normal_clusters.h parts them by direction. Sorting is not needed: a cell's samples all lie in one
// tile, so one item a tile puts them in order.
#pragma once

#include "cuda/atomics.h"
#include "hybrid/cluster_grid.h"
#include "hybrid/gbuffer.h"
#include "hybrid/normal_cells.h"
#include "scenes/box.h"

namespace shadowdag {

constexpr uint32_t kNoCluster = 0xffffffffu;

/// Samples stand in a cluster by blocks of 8 x 4 pixels, so that neighbours in the list, which are
/// traced together, are neighbours in both directions: the rays of a packet then share more nodes
/// than those of a row (voxel/LAYOUT.md).
constexpr uint32_t kBlockWidthLog2 = 3, kBlockHeightLog2 = 2;

/// Returns the pixel that is the i-th of a tile, relative to the tile's corner: by block, rows of
/// blocks from the top, and row by row within a block.
SDAG_HD inline glm::uvec2 pixelOfTile(uint32_t i) {
    constexpr uint32_t kBlocksAcrossLog2 = kTileSizeLog2 - kBlockWidthLog2;
    const uint32_t inBlock = i & ((1u << (kBlockWidthLog2 + kBlockHeightLog2)) - 1);
    const uint32_t block = i >> (kBlockWidthLog2 + kBlockHeightLog2);
    const uint32_t across = block & ((1u << kBlocksAcrossLog2) - 1);
    return {across << kBlockWidthLog2 | (inBlock & ((1u << kBlockWidthLog2) - 1)),
            block >> kBlocksAcrossLog2 << kBlockHeightLog2 | inBlock >> kBlockWidthLog2};
}

/// Which box a cluster has.
enum class ClusterBounds : uint8_t {
    kImplicit, ///< of the grid cell
    kExplicit, ///< the cell's, shrunk to the tenths of its sides that hold samples (EB)
    kTight,    ///< of its samples
};

/// The clusters of a frame, ascending by cell, then by the cell of their normals.
/// cell, boxesWorld: clusterCount; sampleStart: clusterCount + 1, into samples; samples:
/// sampleCount sample indices, within a cluster in the order of pixelOfTile; clusterOfSample: width
/// * height, kNoCluster for background; normals.cells: clusterCount, or empty where clusters are by
/// position alone.
struct ClusterView {
    View<const uint32_t> cell;
    View<const Box> boxesWorld;
    View<const uint32_t> sampleStart;
    View<const uint32_t> samples;
    View<const uint32_t> clusterOfSample;
    ClusterNormalsView normals = {};

    SDAG_HD size_t count() const { return cell.count; }
    SDAG_HD uint32_t sampleCount(size_t cluster) const {
        return sampleStart[cluster + 1] - sampleStart[cluster];
    }
};

/// Finds every sample's cell and counts the samples of each cell (cellSamples: cellCount, zero
/// before).
struct CountCellSamples {
    GBufferView gbuffer;
    ClusterGridView grid;
    View<uint32_t> cellOfSample;
    View<uint32_t> cellSamples;

    SDAG_HD void operator()(size_t i) const {
        if (gbuffer.triangle[i] == kBackground) {
            cellOfSample[i] = kNoCluster;
            return;
        }
        const uint32_t tile = grid.tileOf(uint32_t(i % grid.width), uint32_t(i / grid.width));
        const uint32_t cell = grid.cellOf(tile, grid.sliceOf(gbuffer.depthView[i]));
        cellOfSample[i] = cell;
        atomicAddRelaxed(&cellSamples[cell], 1);
    }
};

/// Marks occupied cells with 1: an exclusive scan of the marks numbers the clusters.
struct MarkOccupiedCells {
    View<const uint32_t> cellSamples;
    View<uint32_t> clusterOfCell;

    SDAG_HD void operator()(size_t cell) const { clusterOfCell[cell] = cellSamples[cell] != 0; }
};

/// Writes the compact list of occupied cells and their sample counts.
struct CompactCells {
    View<const uint32_t> cellSamples;
    View<const uint32_t> clusterOfCell;
    View<uint32_t> cell;
    View<uint32_t> sampleCount;

    SDAG_HD void operator()(size_t c) const {
        if (cellSamples[c] == 0)
            return;
        cell[clusterOfCell[c]] = uint32_t(c);
        sampleCount[clusterOfCell[c]] = cellSamples[c];
    }
};

/// Writes the samples of one tile into their clusters' lists, in the order of pixelOfTile.
struct FillTile {
    ClusterGridView grid;
    View<uint32_t> clusterOfSample; ///< the cell of each sample before, its cluster after
    View<const uint32_t> clusterOfCell;
    View<const uint32_t> sampleStart;
    View<uint32_t> filledCount; ///< clusterCount, zero before
    View<uint32_t> samples;

    SDAG_HD void operator()(size_t tile) const {
        const uint32_t x0 = uint32_t(tile % grid.tileCountX) * kTileSize;
        const uint32_t y0 = uint32_t(tile / grid.tileCountX) * kTileSize;
        for (uint32_t i = 0; i < kTileSize * kTileSize; ++i) {
            const glm::uvec2 pixel = pixelOfTile(i);
            const uint32_t x = x0 + pixel.x, y = y0 + pixel.y;
            if (x >= grid.width || y >= grid.height)
                continue;
            const uint32_t sample = y * grid.width + x;
            const uint32_t cell = clusterOfSample[sample];
            if (cell == kNoCluster)
                continue;
            const uint32_t cluster = clusterOfCell[cell];
            samples[sampleStart[cluster] + filledCount[cluster]++] = sample;
            clusterOfSample[sample] = cluster;
        }
    }
};

} // namespace shadowdag
