// SPDX-License-Identifier: Apache-2.0
// A grid as the .vdb and .nvdb readers pass it to readVdb.
#pragma once

#include "voxel/vdb_tags.h"
#include "voxel/vdb_topology.h"

#include <string>
#include <vector>

namespace shadowdag {

struct VdbSource {
    std::string gridName, gridType;
    VdbDagBuilder topology;
    glm::dmat3 worldFromIndexLinear{1.0}; ///< columns are the images of the index axes
    glm::dvec3 worldFromIndexOffset{0.0}; ///< the image of index 0
    bool isLinear = true;                 ///< false: a frustum; then the two above mean nothing
    bool isOurs = false;                  ///< says that writeVdb wrote it
    VdbTags tags;
};

/// Returns the requested grid's name, or the only one if none is requested. Throws Error kUsage
/// listing the existing ones.
size_t chooseGrid(const std::vector<std::string>& names, const std::string& asked,
                  const std::string& file);

} // namespace shadowdag
