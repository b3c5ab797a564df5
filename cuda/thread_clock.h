// SPDX-License-Identifier: Apache-2.0
// Processor time of the calling thread. Rates per core are measured with it, because the load of
// other programs then affects only caches and not the time itself.
#pragma once

#include <time.h>

namespace shadowdag {

/// Returns the seconds that the calling thread has spent on a processor so far. Cost: a fraction of
/// a microsecond. Not for work that other threads share.
inline double threadSeconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

} // namespace shadowdag
