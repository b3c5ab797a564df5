// SPDX-License-Identifier: Apache-2.0
// Exact rays in packets in plain C++, for processors that have neither AVX2 nor AVX-512.
#include "hybrid/rays/exact_stream_kernel.h"
#include "voxel/lanes_portable.h"

namespace shadowdag::stream {

void traceExactPortable(ExactWork& work, bool isDirectional) {
    traceAllExactly<PortableLanes, PortableLanes>(work, isDirectional);
}

} // namespace shadowdag::stream
