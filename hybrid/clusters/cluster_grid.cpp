// SPDX-License-Identifier: Apache-2.0
// Builds the slice table of the cluster grid.
#include "hybrid/clusters/cluster_grid.h"

#include "cuda/error.h"

#include <cmath>
#include <string>

namespace shadowdag {

void checkClusterGrid(const ViewRays& view) {
    const double sliceCount =
        std::ceil(std::log(view.zfar / view.znear) / std::log1p(kTileSize * view.pixelSize));
    const double cellCount = sliceCount * clusterGrid(view, {}).tileCount();
    if (!(cellCount <= double(kMaxCellCount)))
        throw Error(ErrorKind::kResource,
                    "cluster grid of about " + std::to_string(cellCount) + " cells for " +
                        std::to_string(view.width) + "x" + std::to_string(view.height) +
                        " pixels of " + std::to_string(view.pixelSize) + " at depth 1, from " +
                        std::to_string(view.znear) + " to " + std::to_string(view.zfar) +
                        " m; at most " + std::to_string(kMaxCellCount) +
                        " are supported: widen the field of view, bring the planes together, or "
                        "use fewer pixels");
}

std::vector<float> makeSliceTable(const ViewRays& view) {
    // Before the loop, which would take time proportional to the table, or be endless at a ratio
    // of 1.
    checkClusterGrid(view);
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
