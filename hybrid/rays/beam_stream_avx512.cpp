// SPDX-License-Identifier: Apache-2.0
// Beams for processors with AVX-512 (F, BW, CD, DQ, VL: x86-64-v4).
#include "hybrid/rays/beam_kernel.h"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__BMI2__)
#include "voxel/lanes_avx2.h"
#include "voxel/lanes_avx512.h"
#include "voxel/lanes_twice.h"

namespace shadowdag::stream {

void findBeamAvx512(BeamWork& work) {
    findBeam<Avx2Lanes>(work);
}

void findActiveAvx512(const ActiveWork& work) {
    findActive<Avx512Lanes>(work);
}

void traceListedAvx512(ListedWork& work) {
    traceListed<Twice<Avx512Lanes>, Avx2Lanes>(work);
}

} // namespace shadowdag::stream

#endif
