// SPDX-License-Identifier: Apache-2.0
// Lookups in maps in plain C++, for processors that have neither AVX2 nor AVX-512.
#include "hybrid/frame/lookup_lanes_kernel.h"
#include "voxel/lanes_portable.h"

namespace shadowdag::stream {

void lookUpPortable(LookupWork& work) {
    lookUp<PortableLanes>(work);
}

} // namespace shadowdag::stream
