// SPDX-License-Identifier: Apache-2.0
// Builds the slice table of the cluster grid.
#include "hybrid/cluster_grid.h"

namespace shadowdag {

std::vector<float> makeSliceTable(const ViewRays& view) {
    const double ratio = 1.0 + kTileSize * view.pixelSize;
    std::vector<float> starts;
    for (double z = view.znear; z < view.zfar || starts.empty(); z *= ratio)
        if (starts.empty() || float(z) > starts.back()) // a tiny tile may not move a float
            starts.push_back(float(z));
    return starts;
}

ClusterGridView clusterGrid(const ViewRays& view, View<const float> sliceStart) {
    return {sliceStart, view.width, view.height, (view.width + kTileSize - 1) / kTileSize,
            (view.height + kTileSize - 1) / kTileSize};
}

} // namespace shadowdag
