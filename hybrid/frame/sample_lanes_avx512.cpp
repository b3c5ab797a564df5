// SPDX-License-Identifier: Apache-2.0
// Marking and colour of samples for processors with AVX-512 (x86-64-v4).
#include "hybrid/frame/sample_lanes_kernel.h"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#include "voxel/lanes_avx512.h"

namespace shadowdag::stream {

uint32_t markSamplesAvx512(const SampleWork& work) {
    return markSamples<Avx512Lanes>(work);
}

void addLightAvx512(const SampleWork& work) {
    addLight<Avx512Lanes>(work);
}

} // namespace shadowdag::stream

#endif
