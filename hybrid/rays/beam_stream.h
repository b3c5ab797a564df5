// SPDX-License-Identifier: Apache-2.0
// The kernels of beams (beam_kernel.h) for the processor at hand.
#pragma once

#include "hybrid/rays/beam_work.h"
#include "voxel/dag_stream.h"

namespace shadowdag::stream {

/// Finds the triangles that may block a ray from a box to a light. @param isa hasStreamIsa
void findBeam(StreamIsa isa, BeamWork& work);

/// Finds the samples that beams answer. @param isa hasStreamIsa
void findActive(StreamIsa isa, const ActiveWork& work);

/// Traces rays against the triangles of a list. @param isa hasStreamIsa
void traceListed(StreamIsa isa, ListedWork& work);

} // namespace shadowdag::stream
