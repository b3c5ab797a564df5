// SPDX-License-Identifier: Apache-2.0
// Lookups in maps and the marks of their pages in plain C++, for processors that have neither AVX2
// nor AVX-512.
#include "hybrid/frame/lookup_marks_kernel.h"
#include "voxel/lanes_portable.h"

namespace shadowdag::stream {

void markPagesPortable(LookupWork& work) {
    markPages<PortableLanes>(work);
}

void lookUpPortable(LookupWork& work) {
    lookUp<PortableLanes>(work);
}

} // namespace shadowdag::stream
