// SPDX-License-Identifier: Apache-2.0
// Marking and colour of samples for processors with AVX2 and FMA (x86-64-v3).
#include "hybrid/frame/sample_lanes_kernel.h"

#if defined(__AVX2__) && defined(__FMA__)
#include "voxel/lanes_avx2.h"

namespace shadowdag::stream {

uint32_t markSamplesAvx2(const SampleWork& work) {
    return markSamples<Avx2Lanes>(work);
}

void addLightAvx2(const SampleWork& work) {
    addLight<Avx2Lanes>(work);
}

} // namespace shadowdag::stream

#endif
