// SPDX-License-Identifier: Apache-2.0
// Clusters: the occupied cells of the grid and their samples; cluster_bounds.h bounds them,
// normal_clusters.h divides them by direction. No sort is needed: a cell's samples are all in one
// tile, so one item per tile orders them.
#pragma once

#include "cuda/atomics.h"
#include "cuda/split_work_view.h"
#include "hybrid/clusters/cluster_grid.h"
#include "hybrid/clusters/normal_cells.h"
#include "hybrid/gbuffer/gbuffer.h"
#include "scenes/box.h"

namespace shadowdag {

constexpr uint32_t kNoCluster = 0xffffffffu;

/// A cluster lists its samples by blocks of 8 x 4 pixels, so that neighbours in the list, which are
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

/// The kind of box that a cluster has.
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
///
/// While passes with guessed lengths run (list_length.h), there may be more clusters than occupied
/// cells: their cell is kNoCluster, their box empty, they have no samples; and `samples` may be
/// longer than sampleStart's last.
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
    /// Returns whether entry i of `samples` is used.
    SDAG_HD bool isEntry(size_t i) const { return i < sampleStart[cell.count]; }
};

/// Finds every sample's cell and counts the samples of each cell (cellSamples: cellCount + 1, zero
/// before; the last stays 0).
struct CountCellSamples {
    GBufferView gbuffer;
    ClusterGridView grid;
    View<uint32_t> cellOfSample;
    View<uint32_t> cellSamples;

    size_t itemCount() const { return gbuffer.count(); }
    size_t grain() const { return 4096; }
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

    size_t itemCount() const { return cellSamples.count; }
    size_t grain() const { return 16384; }
    SDAG_HD void operator()(size_t cell) const { clusterOfCell[cell] = cellSamples[cell] != 0; }
};

/// Writes the compact list of occupied cells and their sample counts, up to its capacity.
struct CompactCells {
    View<const uint32_t> cellSamples;
    View<const uint32_t> clusterOfCell;
    View<uint32_t> cell;
    View<uint32_t> sampleCount;

    size_t itemCount() const { return cellSamples.count; }
    size_t grain() const { return 16384; }
    SDAG_HD void operator()(size_t c) const {
        if (cellSamples[c] == 0 || clusterOfCell[c] >= cell.count)
            return;
        cell[clusterOfCell[c]] = uint32_t(c);
        sampleCount[clusterOfCell[c]] = cellSamples[c];
    }
};

/// Writes the samples of a tile into their clusters' lists, in the order of pixelOfTile: one after
/// the other (operator()), or block after block of kGroupLanes pixels, one pixel per lane. A lane's
/// offset is the number of lanes before it with the same cluster; the last lane of a cluster adds
/// their number after the others have read the old value.
struct FillTile {
    ClusterGridView grid;
    View<const uint32_t> cellOfSample;
    View<uint32_t> clusterOfSample; ///< of operator() it may be cellOfSample
    View<const uint32_t> clusterOfCell;
    View<const uint32_t> sampleStart;
    View<uint32_t> filledCount; ///< clusterCount, zero before
    View<uint32_t> samples;

    static constexpr uint32_t kBlockCount = kTileSize * kTileSize / kGroupLanes;

    /// A lane's contribution to the counts.
    struct Placed {
        uint32_t cluster = kNoCluster; ///< kNoCluster: nothing
        uint32_t filledCount = 0;
    };

    /// Returns the cluster of a lane's pixel, and stores it; kNoCluster for none.
    SDAG_HD uint32_t find(size_t tile, uint32_t block, uint32_t lane) const {
        const uint32_t sample = sampleOf(tile, block, lane);
        if (sample == kNoSample)
            return kNoCluster;
        const uint32_t cluster = clusterOf(cellOfSample[sample]);
        clusterOfSample[sample] = cluster;
        return cluster;
    }
    /// Places the pixel of a lane. All lanes of the block do so before the first advances.
    /// @param cluster of the pixel @param before lanes before this one with the same
    /// @param isLast no lane after this one has the same
    SDAG_HD Placed place(size_t tile, uint32_t block, uint32_t lane, uint32_t cluster,
                         uint32_t before, bool isLast) const {
        if (cluster == kNoCluster)
            return {};
        const uint32_t filled = filledCount[cluster] + before;
        samples[sampleStart[cluster] + filled] = sampleOf(tile, block, lane);
        return {isLast ? cluster : kNoCluster, filled + 1};
    }
    SDAG_HD void advance(const Placed& placed) const {
        if (placed.cluster != kNoCluster)
            filledCount[placed.cluster] = placed.filledCount;
    }

    size_t itemCount() const { return grid.tileCount(); }
    size_t grain() const { return 8; }
    /// Processes a whole tile.
    SDAG_HD void operator()(size_t tile) const {
        for (uint32_t block = 0; block < kBlockCount; ++block)
            for (uint32_t lane = 0; lane < kGroupLanes; ++lane) {
                const uint32_t sample = sampleOf(tile, block, lane);
                if (sample == kNoSample)
                    continue;
                const uint32_t cluster = clusterOf(cellOfSample[sample]);
                clusterOfSample[sample] = cluster;
                if (cluster != kNoCluster)
                    samples[sampleStart[cluster] + filledCount[cluster]++] = sample;
            }
    }

private:
    static constexpr uint32_t kNoSample = 0xffffffffu;

    /// Returns the cluster of a cell, none if the list is full: then everything is repeated.
    SDAG_HD uint32_t clusterOf(uint32_t cell) const {
        const uint32_t cluster = cell == kNoCluster ? kNoCluster : clusterOfCell[cell];
        return cluster < filledCount.count ? cluster : kNoCluster;
    }
    SDAG_HD uint32_t sampleOf(size_t tile, uint32_t block, uint32_t lane) const {
        const glm::uvec2 pixel = pixelOfTile(block * kGroupLanes + lane);
        const uint32_t x = uint32_t(tile % grid.tileCountX) * kTileSize + pixel.x;
        const uint32_t y = uint32_t(tile / grid.tileCountX) * kTileSize + pixel.y;
        return x < grid.width && y < grid.height ? y * grid.width + x : kNoSample;
    }
};

} // namespace shadowdag
