// SPDX-License-Identifier: Apache-2.0
// The ray tracer in GLSL.
#pragma once

#include "gl/program.h"
#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

namespace shadowdag {

/// The GLSL sources of this folder: voxel/dag_trace.glsl, compiled with dagDefines.
GlslTexts voxelGlsl();

/// Returns the definitions of voxel/dag_trace.glsl. @param binding of the DAG's words
inline GlDefines dagDefines(uint32_t binding) {
    return {{"SDAG_DAG_BINDING", std::to_string(binding)},
            {"SDAG_NO_NODE", std::to_string(kNoNode) + "u"},
            {"SDAG_LEAF_LOG2", std::to_string(kLeafLog2) + "u"},
            {"SDAG_MAX_RESOLUTION_LOG2", std::to_string(kMaxResolutionLog2)}};
}

} // namespace shadowdag
