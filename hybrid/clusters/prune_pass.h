// SPDX-License-Identifier: Apache-2.0
// The pruning passes.
#pragma once

#include "cuda/pass.h"
#include "hybrid/clusters/prune.h"
#include "hybrid/rays/shadow_rays.h"

namespace shadowdag {

/// Runs PruneFacing for all clusters. All views are on the backend.
inline void pruneFacing(Backend backend, const PruneFacing& work) {
    runPass(backend, work);
}

/// Gives the record kProvenLit to those of the other entries (record != kProvenLit) for which
/// shafts and, for small groups, rays prove that voxel rays of level 0 light all pairs; entries
/// that are lit without a proof are unchanged. Does nothing for lights that moving objects may
/// shadow, or for a DAG without its wide form. On the CPU.
/// @param rays the DAG, the ray offset and the movers
void pruneLit(const PruneFacing& work, const RayInputs& rays);

} // namespace shadowdag
