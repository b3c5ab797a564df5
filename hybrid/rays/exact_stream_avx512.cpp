// SPDX-License-Identifier: Apache-2.0
// Exact rays in packets for processors with AVX-512 (F, BW, CD, DQ, VL: x86-64-v4).
#include "hybrid/rays/exact_stream_kernel.h"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__BMI2__)
#include "voxel/lanes_avx2.h"
#include "voxel/lanes_avx512.h"
#include "voxel/lanes_twice.h"

namespace shadowdag::stream {

void traceExactAvx512(ExactWork& work, bool isDirectional) {
    traceAllExactly<Twice<Avx512Lanes>, Avx2Lanes>(work, isDirectional);
}

} // namespace shadowdag::stream

#endif
