// SPDX-License-Identifier: Apache-2.0
// Faults of the voxels' content (cuda/mutant.h). For the study of mutants alone.
#pragma once

#include "cuda/mutant.h"
#include "voxel/dag.h"

namespace shadowdag {

#if SDAG_HAS_MUTANTS
/// Returns the DAG with the fault of this process in its content, or the DAG itself if the fault is
/// another one. Cost: a sort of all voxels.
Dag withVoxelFault(Dag dag);
#else
inline Dag withVoxelFault(Dag dag) {
    return dag;
}
#endif

} // namespace shadowdag
