// SPDX-License-Identifier: Apache-2.0
// Gathers the samples of a G-buffer into clusters.
#pragma once

#include "cuda/fill_pass.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "hybrid/clusters/cluster_bounds.h"
#include "hybrid/clusters/normal_clusters.h"

#include <algorithm>
#include <utility>

namespace shadowdag {

/// The arrays of a frame's clusters on one backend.
struct ClusterSet {
    explicit ClusterSet(Backend backend)
        : cellSamples(backend, "cluster cell samples"), clusterOfCell(backend, "cluster of cell"),
          cellOfSample(backend, "cluster cell of sample"),
          clusterOfSample(backend, "cluster of sample"), cell(backend, "cluster cell"),
          filledCount(backend, "cluster fill"), sampleStart(backend, "cluster sample start"),
          samples(backend, "cluster samples"), boxesWorld(backend, "cluster boxes"),
          sliceStart(backend, "cluster slices"), tenths(backend, "cluster tenths"),
          normalCell(backend, "cluster normals"), parts(backend) {}

    Buffer<uint32_t> cellSamples;
    Buffer<uint32_t> clusterOfCell;
    Buffer<uint32_t> cellOfSample; ///< on CUDA; the CPU keeps it in clusterOfSample meanwhile
    Buffer<uint32_t> clusterOfSample;
    Buffer<uint32_t> cell;
    Buffer<uint32_t> filledCount;
    Buffer<uint32_t> sampleStart;
    Buffer<uint32_t> samples;
    Buffer<Box> boxesWorld;
    Buffer<float> sliceStart;
    Buffer<uint32_t> tenths;     ///< of explicit bounds
    Buffer<uint32_t> normalCell; ///< by cluster; empty without normal clustering
    uint32_t normalCellsPerEdge = 0;

    /// Input and output of the division by normals; `cell`, `sampleStart`, `samples` are swapped
    /// in.
    struct Parts {
        explicit Parts(Backend backend)
            : normalCellOfEntry(backend, "sample normals"), start(backend, "cluster part start"),
              cell(backend, "cluster part cell"),
              sampleStart(backend, "cluster part samples start"),
              samples(backend, "cluster part samples") {}
        Buffer<uint32_t> normalCellOfEntry, start, cell, sampleStart, samples;
    } parts;

    ClusterView view() const {
        return {cell.view(),    boxesWorld.view(),      sampleStart.view(),
                samples.view(), clusterOfSample.view(), {normalCell.view(), normalCellsPerEdge}};
    }
};

/// One warp per tile, and one per cluster: cluster_cuda.cu.
void launchPass(CudaTag, const FillTile& work);
void launchPass(CudaTag, const BoundBySamples& work);

/// Divides the clusters by position of `set` by the normals of their samples.
/// @param k 1..kMaxNormalCellsPerEdge
inline void partByNormals(Backend backend, const GBufferView& gbuffer, uint32_t k,
                          ClusterSet& set) {
    ClusterSet::Parts& parts = set.parts;
    const size_t before = set.cell.size();
    const size_t sampleCount = set.samples.size();
    parts.normalCellOfEntry.resize(sampleCount);
    parts.start.resize(before + 1);
    parts.start.fill(0);
    runPass(backend, CountNormalCells{gbuffer, set.view(), k, parts.normalCellOfEntry.view(),
                                      parts.start.view()});
    const size_t count = exclusiveScan(backend, parts.start.view(), parts.start.view());
    parts.cell.resize(count);
    set.normalCell.resize(count);
    parts.sampleStart.resize(count + 1);
    parts.sampleStart.fill(0); // without clusters, no pass writes the end
    parts.samples.resize(sampleCount);
    runPass(backend,
            SplitByNormals{set.view(), parts.normalCellOfEntry.view(), parts.start.view(),
                           parts.cell.view(), set.normalCell.view(), parts.sampleStart.view(),
                           parts.samples.view(), set.clusterOfSample.view()});
    std::swap(set.cell, parts.cell);
    std::swap(set.sampleStart, parts.sampleStart);
    std::swap(set.samples, parts.samples);
    set.normalCellsPerEdge = k;
}

/// Sets the boxes of the clusters of `set`.
inline void boundClusters(Backend backend, const GBufferView& gbuffer, const ClusterGridView& grid,
                          const ViewRays& view, ClusterBounds bounds, ClusterSet& set) {
    set.boxesWorld.resize(set.cell.size());
    if (bounds == ClusterBounds::kTight) {
        runPass(backend, BoundBySamples{gbuffer, set.view(), set.boxesWorld.view()});
        return;
    }
    runPass(backend, BoundByCell{grid, view, set.cell.view(), set.boxesWorld.view()});
    if (bounds == ClusterBounds::kImplicit)
        return;
    set.tenths.resize(set.cell.size());
    set.tenths.fill(0);
    runPass(backend, JoinTenths{gbuffer, set.view(), set.tenths.view()});
    runPass(backend, ShrinkBounds{set.tenths.view(), set.boxesWorld.view()});
}

/// Replaces `set` by the clusters of a G-buffer of the same view. Every sample that sees geometry
/// is in exactly one. Deterministic, order included. Cost: linear in samples and cells; with
/// normals in samples times the normal cells of their cluster.
/// @param normalCellsPerEdge the k of Nk clustering, at most kMaxNormalCellsPerEdge; 0: by position
/// alone
/// @param guess number of clusters to allocate without waiting for the actual number (ClusterView
/// then has empty ones; clusters beyond are left out); 0: waits. Normals need the number, and wait
/// @returns the actual number, as a word on the backend: valid until the set changes
inline View<const uint32_t> buildClusters(Backend backend, const GBufferView& gbuffer,
                                          const ViewRays& view, ClusterBounds bounds,
                                          ClusterSet& set, uint32_t normalCellsPerEdge = 0,
                                          size_t guess = 0) {
    set.sliceStart.upload(makeSliceTable(view));
    const ClusterGridView grid = clusterGrid(view, set.sliceStart.view());

    // One element more than there are cells, so that the scan ends with the total.
    set.cellSamples.resize(grid.cellCount() + 1);
    set.cellSamples.fill(0);
    set.clusterOfSample.resize(gbuffer.count());
    Buffer<uint32_t>& cellOfSample =
        backend == Backend::kCuda ? set.cellOfSample : set.clusterOfSample;
    cellOfSample.resize(gbuffer.count());
    runPass(backend, CountCellSamples{gbuffer, grid, cellOfSample.view(), set.cellSamples.view()});

    set.clusterOfCell.resize(grid.cellCount() + 1);
    runPass(backend, MarkOccupiedCells{set.cellSamples.view(), set.clusterOfCell.view()});
    prefixSums(backend, set.clusterOfCell.view(), set.clusterOfCell.view());
    const bool isGuessed = guess > 0 && normalCellsPerEdge == 0;
    const size_t count = isGuessed ? std::min({guess, size_t(grid.cellCount()), gbuffer.count()})
                                   : set.clusterOfCell.at(grid.cellCount());

    set.cell.resize(count);
    // One element more here, too.
    set.sampleStart.resize(count + 1);
    set.filledCount.resize(count);
    fillAll(backend, {{set.cell, 0xff}, set.sampleStart, set.filledCount}); // kNoCluster
    runPass(backend, CompactCells{set.cellSamples.view(), set.clusterOfCell.view(), set.cell.view(),
                                  set.sampleStart.view()});
    prefixSums(backend, set.sampleStart.view(), set.sampleStart.view());

    set.samples.resize(isGuessed ? gbuffer.count() : set.sampleStart.at(count));
    runPass(backend, FillTile{grid, cellOfSample.view(), set.clusterOfSample.view(),
                              set.clusterOfCell.view(), set.sampleStart.view(),
                              set.filledCount.view(), set.samples.view()});

    set.normalCell.resize(0);
    set.normalCellsPerEdge = 0;
    if (normalCellsPerEdge > 0)
        partByNormals(backend, gbuffer, normalCellsPerEdge, set);
    boundClusters(backend, gbuffer, grid, view, bounds, set);
    return {std::as_const(set.clusterOfCell).view().data + grid.cellCount(), 1};
}

/// Removes the empty clusters of a set that was built with a guess.
/// @param count,sampleCount the actual numbers
inline void trimClusters(size_t count, size_t sampleCount, ClusterSet& set) {
    set.cell.resize(count);
    set.filledCount.resize(count);
    set.sampleStart.resize(count + 1);
    set.samples.resize(sampleCount);
    set.boxesWorld.resize(count);
    set.tenths.resize(std::min(count, set.tenths.size()));
}

} // namespace shadowdag
