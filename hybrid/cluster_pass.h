// SPDX-License-Identifier: Apache-2.0
// Gathers the samples of a G-buffer into clusters.
#pragma once

#include "cuda/scan_sort.h"
#include "hybrid/clusters.h"

namespace shadowdag {

/// The arrays of a frame's clusters on one backend.
struct ClusterSet {
    explicit ClusterSet(Backend backend)
        : cellSamples(backend, "cluster cell samples"), clusterOfCell(backend, "cluster of cell"),
          clusterOfSample(backend, "cluster of sample"), cell(backend, "cluster cell"),
          filledCount(backend, "cluster fill"), sampleStart(backend, "cluster sample start"),
          samples(backend, "cluster samples"), boxesWorld(backend, "cluster boxes"),
          sliceStart(backend, "cluster slices") {}

    Buffer<uint32_t> cellSamples;
    Buffer<uint32_t> clusterOfCell;
    Buffer<uint32_t> clusterOfSample;
    Buffer<uint32_t> cell;
    Buffer<uint32_t> filledCount;
    Buffer<uint32_t> sampleStart;
    Buffer<uint32_t> samples;
    Buffer<Box> boxesWorld;
    Buffer<float> sliceStart;

    ClusterView view() const {
        return {cell.view(), boxesWorld.view(), sampleStart.view(), samples.view(),
                clusterOfSample.view()};
    }
};

namespace cpu {
void countCellSamples(const CountCellSamples& work);
void markOccupiedCells(const MarkOccupiedCells& work);
void compactCells(const CompactCells& work);
void fillTiles(const FillTile& work);
void boundClusters(const BoundClusters& work);
} // namespace cpu
namespace cuda {
void countCellSamples(const CountCellSamples& work);
void markOccupiedCells(const MarkOccupiedCells& work);
void compactCells(const CompactCells& work);
void fillTiles(const FillTile& work);
void boundClusters(const BoundClusters& work);
} // namespace cuda

/// Replaces `set` by the clusters of a G-buffer of the same view. Every sample that sees geometry
/// is in exactly one. Deterministic, order included. Cost: linear in samples and cells.
inline void buildClusters(Backend backend, const GBufferView& gbuffer, const ViewRays& view,
                          ClusterBounds bounds, ClusterSet& set) {
    set.sliceStart.upload(makeSliceTable(view));
    const ClusterGridView grid = clusterGrid(view, set.sliceStart.view());

    set.cellSamples.resize(grid.cellCount());
    set.cellSamples.fill(0);
    set.clusterOfSample.resize(gbuffer.count());
    SDAG_DISPATCH(backend, countCellSamples,
                  {gbuffer, grid, set.clusterOfSample.view(), set.cellSamples.view()});

    set.clusterOfCell.resize(grid.cellCount());
    SDAG_DISPATCH(backend, markOccupiedCells, {set.cellSamples.view(), set.clusterOfCell.view()});
    const size_t count = exclusiveScan(backend, set.clusterOfCell.view(), set.clusterOfCell.view());

    // One element more than there are clusters: the scan then ends with the total.
    set.cell.resize(count);
    set.sampleStart.resize(count + 1);
    set.sampleStart.fill(0);
    SDAG_DISPATCH(backend, compactCells,
                  {set.cellSamples.view(), set.clusterOfCell.view(), set.cell.view(),
                   set.sampleStart.view()});
    const size_t sampleCount =
        exclusiveScan(backend, set.sampleStart.view(), set.sampleStart.view());

    set.samples.resize(sampleCount);
    set.filledCount.resize(count);
    set.filledCount.fill(0);
    SDAG_DISPATCH(backend, fillTiles,
                  {grid, set.clusterOfSample.view(), set.clusterOfCell.view(),
                   set.sampleStart.view(), set.filledCount.view(), set.samples.view()});

    set.boxesWorld.resize(count);
    SDAG_DISPATCH(
        backend, boundClusters,
        {gbuffer, grid, view, set.view(), set.boxesWorld.view(), bounds == ClusterBounds::kTight});
}

} // namespace shadowdag
