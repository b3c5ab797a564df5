// SPDX-License-Identifier: Apache-2.0
// Clusters: the occupied cells of the grid, their samples and their bounds. Sorting is not needed:
// a cell's samples all lie in one tile, so one item a tile puts them in order.
#pragma once

#include "cuda/atomics.h"
#include "hybrid/cluster_grid.h"
#include "hybrid/gbuffer.h"
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
    kTight,    ///< of its samples
};

/// The clusters of a frame, ascending by cell.
/// cell, boxesWorld: clusterCount; sampleStart: clusterCount + 1, into samples; samples:
/// sampleCount sample indices, within a cluster in the order of pixelOfTile; clusterOfSample: width
/// * height, kNoCluster for background.
struct ClusterView {
    View<const uint32_t> cell;
    View<const Box> boxesWorld;
    View<const uint32_t> sampleStart;
    View<const uint32_t> samples;
    View<const uint32_t> clusterOfSample;

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

/// Returns the box around a cell: the part of the view behind its tile between its slice's two
/// depths (to the far plane for the last slice), grown by the rounding of sample positions so that
/// it holds every sample of the cell.
SDAG_HD inline Box implicitBounds(const ClusterGridView& grid, const ViewRays& view,
                                  uint32_t cell) {
    const uint32_t tile = grid.tileOfCell(cell), slice = grid.sliceOfCell(cell);
    const double nearZ = slice == 0 ? view.znear : double(grid.sliceStart[slice]);
    const double farZ =
        slice + 1 == grid.sliceCount() ? view.zfar : double(grid.sliceStart[slice + 1]);
    const double x0 = double(tile % grid.tileCountX) * kTileSize - 0.5;
    const double y0 = double(tile / grid.tileCountX) * kTileSize - 0.5;
    const double x1 = glm::min(x0 + kTileSize, double(grid.width) - 0.5);
    const double y1 = glm::min(y0 + kTileSize, double(grid.height) - 0.5);
    glm::dvec3 low(1e300), high(-1e300);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 d = view.first + ((corner & 1) ? x1 : x0) * view.stepX +
                             ((corner & 2) ? y1 : y0) * view.stepY;
        const glm::dvec3 p = view.origin + ((corner & 4) ? farZ : nearZ) * d;
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    // Positions and depths are rounded to float once each: half a unit in the last place of either;
    // four units are granted because this box is rounded as well.
    constexpr double kGrow = 4.0 / (1 << 23);
    const glm::dvec3 grow = kGrow * (glm::abs(view.origin) +
                                     glm::max(glm::abs(low), glm::abs(high)) + glm::dvec3(farZ));
    Box box;
    box.min = glm::vec3(low - grow);
    box.max = glm::vec3(high + grow);
    return box;
}

/// Bounds of every cluster: the smallest box of its samples, or the cell's. A minimum does not
/// depend on order.
struct BoundClusters {
    GBufferView gbuffer;
    ClusterGridView grid;
    ViewRays view;
    ClusterView clusters; ///< boxesWorld not read
    View<Box> boxesWorld;
    bool isTight;

    SDAG_HD void operator()(size_t cluster) const {
        if (!isTight) {
            boxesWorld[cluster] = implicitBounds(grid, view, clusters.cell[cluster]);
            return;
        }
        Box box;
        for (uint32_t i = clusters.sampleStart[cluster]; i < clusters.sampleStart[cluster + 1]; ++i)
            box.add(gbuffer.positionWorld[clusters.samples[i]]);
        boxesWorld[cluster] = box;
    }
};

} // namespace shadowdag
