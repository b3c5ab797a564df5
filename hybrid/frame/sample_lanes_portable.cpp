// SPDX-License-Identifier: Apache-2.0
// Marking and colour of samples in plain C++, for processors that have neither AVX2 nor AVX-512.
#include "hybrid/frame/sample_lanes_kernel.h"
#include "voxel/lanes_portable.h"

namespace shadowdag::stream {

uint32_t markSamplesPortable(const SampleWork& work) {
    return markSamples<PortableLanes>(work);
}

void addLightPortable(const SampleWork& work) {
    addLight<PortableLanes>(work);
}

} // namespace shadowdag::stream
