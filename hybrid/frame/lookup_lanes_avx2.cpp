// SPDX-License-Identifier: Apache-2.0
// Lookups in maps and the marks of their pages for processors with AVX2 and FMA (x86-64-v3).
#include "hybrid/frame/lookup_marks_kernel.h"

#if defined(__AVX2__) && defined(__FMA__)
#include "voxel/lanes_avx2.h"

namespace shadowdag::stream {

void markPagesAvx2(LookupWork& work) {
    markPages<Avx2Lanes>(work);
}

void lookUpAvx2(LookupWork& work) {
    lookUp<Avx2Lanes>(work);
}

} // namespace shadowdag::stream

#endif
