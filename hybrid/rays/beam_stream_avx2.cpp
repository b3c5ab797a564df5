// SPDX-License-Identifier: Apache-2.0
// Beams for processors with AVX2, FMA and BMI2.
#include "hybrid/rays/beam_kernel.h"

#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#include "voxel/lanes_avx2.h"
#include "voxel/lanes_twice.h"

namespace shadowdag::stream {

void findBeamAvx2(BeamWork& work) {
    findBeam<Avx2Lanes>(work);
}

void findActiveAvx2(const ActiveWork& work) {
    findActive<Avx2Lanes>(work);
}

void traceListedAvx2(ListedWork& work) {
    traceListed<Twice<Avx2Lanes>, Avx2Lanes>(work);
}

} // namespace shadowdag::stream

#endif
