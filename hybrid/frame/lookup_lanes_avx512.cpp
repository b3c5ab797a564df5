// SPDX-License-Identifier: Apache-2.0
// Lookups in maps and the marks of their pages for processors with AVX-512 (x86-64-v4).
#include "hybrid/frame/lookup_marks_kernel.h"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#include "voxel/lanes_avx512.h"

namespace shadowdag::stream {

void markPagesAvx512(LookupWork& work) {
    markPages<Avx512Lanes>(work);
}

void lookUpAvx512(LookupWork& work) {
    lookUp<Avx512Lanes>(work);
}

} // namespace shadowdag::stream

#endif
