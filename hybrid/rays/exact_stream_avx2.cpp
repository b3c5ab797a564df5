// SPDX-License-Identifier: Apache-2.0
// Exact rays in packets for processors with AVX2, FMA and BMI2.
#include "hybrid/rays/exact_stream_kernel.h"

#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#include "voxel/lanes_avx2.h"
#include "voxel/lanes_twice.h"

namespace shadowdag::stream {

void traceExactAvx2(ExactWork& work, bool isDirectional) {
    traceAllExactly<Twice<Avx2Lanes>, Avx2Lanes>(work, isDirectional);
}

} // namespace shadowdag::stream

#endif
