// SPDX-License-Identifier: Apache-2.0
// Voxels in Python: class Dag.
#pragma once

#include "voxel/asset.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>

namespace shadowdag::python {

/// A DAG with its provenance; the DAG may be a scene's, which its pointer keeps alive.
struct DagObject {
    std::shared_ptr<const Dag> dag;
    AssetProvenance provenance;
    uint64_t fileBytes = 0; ///< of the file that it was read from or written to last; 0: none
    std::mutex wideMutex = {};
    std::unique_ptr<const WideDag> wide = {}; ///< built at the first call of occluded

    DagObject(std::shared_ptr<const Dag> dag_, AssetProvenance provenance_, uint64_t fileBytes_ = 0)
        : dag(std::move(dag_)), provenance(std::move(provenance_)), fileBytes(fileBytes_) {}
};

/// Adds class Dag and load_asset() to the scope.
void addDag(pybind11::module_& scope);

} // namespace shadowdag::python
