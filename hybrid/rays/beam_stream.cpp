// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/beam_stream.h"

namespace shadowdag::stream {

void findBeam(StreamIsa isa, BeamWork& work) {
#if defined(SDAG_STREAM_X86)
    if (isa == StreamIsa::kAvx512)
        return findBeamAvx512(work);
    if (isa == StreamIsa::kAvx2)
        return findBeamAvx2(work);
#endif
    (void)isa;
    findBeamPortable(work);
}

void findActive(StreamIsa isa, const ActiveWork& work) {
#if defined(SDAG_STREAM_X86)
    if (isa == StreamIsa::kAvx512)
        return findActiveAvx512(work);
    if (isa == StreamIsa::kAvx2)
        return findActiveAvx2(work);
#endif
    (void)isa;
    findActivePortable(work);
}

void traceListed(StreamIsa isa, ListedWork& work) {
#if defined(SDAG_STREAM_X86)
    if (isa == StreamIsa::kAvx512)
        return traceListedAvx512(work);
    if (isa == StreamIsa::kAvx2)
        return traceListedAvx2(work);
#endif
    (void)isa;
    traceListedPortable(work);
}

} // namespace shadowdag::stream
