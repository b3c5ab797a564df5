// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/beam_stream.h"

#include "voxel/stream_kernel.h"

namespace shadowdag::stream {

void findBeam(StreamIsa isa, BeamWork& work) {
    SDAG_KERNEL_OF(isa, findBeam)(work);
}

void findActive(StreamIsa isa, const ActiveWork& work) {
    SDAG_KERNEL_OF(isa, findActive)(work);
}

void traceListed(StreamIsa isa, ListedWork& work) {
    SDAG_KERNEL_OF(isa, traceListed)(work);
}

} // namespace shadowdag::stream
