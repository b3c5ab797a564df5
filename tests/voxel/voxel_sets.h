// SPDX-License-Identifier: Apache-2.0
// Small dense grids, from which DAGs are built and with which they are compared.
#pragma once

#include "voxel/dag_builder.h"
#include "voxel/dag_stream.h"

#include <algorithm>
#include <random>
#include <vector>

namespace shadowdag {

/// A dense grid of 2^log2 voxels an axis.
struct DenseGrid {
    uint32_t log2;
    std::vector<bool> bits;

    explicit DenseGrid(uint32_t l) : log2(l), bits(size_t(1) << (3 * l)) {}
    uint32_t size() const { return 1u << log2; }
    size_t index(uint32_t x, uint32_t y, uint32_t z) const {
        return (size_t(z) << (2 * log2)) + (size_t(y) << log2) + x;
    }
    bool at(uint32_t x, uint32_t y, uint32_t z) const {
        return x < size() && y < size() && z < size() && bits[index(x, y, z)];
    }
    void set(uint32_t x, uint32_t y, uint32_t z) { bits[index(x, y, z)] = true; }
    size_t count() const { return size_t(std::count(bits.begin(), bits.end(), true)); }
};

inline DenseGrid randomGrid(uint32_t log2, double density, std::mt19937& random) {
    DenseGrid grid(log2);
    std::bernoulli_distribution on(density);
    for (size_t i = 0; i < grid.bits.size(); ++i)
        grid.bits[i] = on(random);
    return grid;
}

inline uint32_t addCell(DagBuilder& builder, const DenseGrid& grid, uint32_t level, uint32_t x,
                        uint32_t y, uint32_t z) {
    if (level == kLeafLog2) {
        uint64_t voxels = 0;
        for (uint32_t o = 0; o < 8; ++o)
            for (uint32_t s = 0; s < 8; ++s)
                if (grid.at(x + 2 * (o & 1) + (s & 1), y + 2 * (o >> 1 & 1) + (s >> 1 & 1),
                            z + 2 * (o >> 2) + (s >> 2)))
                    voxels |= uint64_t(1) << (8 * o + s);
        return builder.addLeaf(voxels);
    }
    uint32_t children[8];
    const uint32_t half = 1u << (level - 1);
    for (uint32_t c = 0; c < 8; ++c)
        children[c] = addCell(builder, grid, level - 1, x + half * (c & 1), y + half * (c >> 1 & 1),
                              z + half * (c >> 2));
    return builder.addInner(level, children);
}

/// Returns the DAG of a dense grid whose voxel space is world space.
inline Dag dagOf(const DenseGrid& grid) {
    const uint32_t rootLevel = std::max(grid.log2, kLeafLog2);
    DagBuilder builder(rootLevel);
    VoxelGrid voxelGrid;
    voxelGrid.resolutionLog2 = grid.log2;
    return builder.finish(rootLevel, addCell(builder, grid, rootLevel, 0, 0, 0), voxelGrid);
}

/// A DAG with its wide form.
struct TwoForms {
    Dag dag;
    WideDag wide;
    explicit TwoForms(Dag d) : dag(std::move(d)), wide(buildWideDag(dag)) {}
    DagView view() const {
        DagView v = dag.view();
        v.wide = wide.view();
        return v;
    }
    /// Returns the wide form's root as a cut.
    std::vector<WideCell> root() const {
        return {WideCell{wide.rootAddress, wide.rootLevel, {0, 0, 0}}};
    }
};

} // namespace shadowdag
