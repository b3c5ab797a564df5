// SPDX-License-Identifier: Apache-2.0
// Beams in plain C++, for processors that have neither AVX2 nor AVX-512.
#include "hybrid/rays/beam_kernel.h"
#include "voxel/lanes_portable.h"

namespace shadowdag::stream {

void findBeamPortable(BeamWork& work) {
    findBeam<PortableLanes>(work);
}

void findActivePortable(const ActiveWork& work) {
    findActive<PortableLanes>(work);
}

void traceListedPortable(ListedWork& work) {
    traceListed<PortableLanes, PortableLanes>(work);
}

} // namespace shadowdag::stream
