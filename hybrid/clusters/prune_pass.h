// SPDX-License-Identifier: Apache-2.0
// The pruning passes.
#pragma once

#include "cuda/pass.h"
#include "hybrid/clusters/prune.h"
#include "hybrid/rays/shadow_rays.h"

namespace shadowdag {

/// Does PruneFacing for all clusters. All views live on the backend.
inline void pruneFacing(Backend backend, const PruneFacing& work) {
    runPass(backend, work);
}

/// Gives the record kProvenLit to those of the other entries (record != kProvenLit) whose pairs are
/// all lit by voxel rays of level 0, where shafts and, for small groups, rays show it; entries that
/// are lit but not shown to be so stay. Does nothing for lights that movers may shadow, or through
/// a DAG without its wide form. On the CPU.
/// @param rays the DAG, the ray offset and the movers
void pruneLit(const PruneFacing& work, const RayInputs& rays);

} // namespace shadowdag
