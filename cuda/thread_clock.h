// SPDX-License-Identifier: Apache-2.0
// Processor time of the calling thread: what rates a core are measured with, since another
// program's load then costs caches but no seconds.
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
