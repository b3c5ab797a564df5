// SPDX-License-Identifier: Apache-2.0
// The tracer's GLSL.
#pragma once

#include "gl/glsl.h"

namespace shadowdag {

/// The texts of this room: voxel/dag_trace.glsl. Compile with SDAG_DAG_BINDING, the words' binding.
GlslTexts voxelGlsl();

} // namespace shadowdag
