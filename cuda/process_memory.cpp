// SPDX-License-Identifier: Apache-2.0
#include "cuda/process_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

namespace shadowdag {

uint64_t processMemoryBytes() {
    uint64_t bytes = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
    for (const auto resource : {RLIMIT_DATA, RLIMIT_AS}) {
        struct rlimit limit {};
        if (getrlimit(resource, &limit) == 0)
            bytes = std::min<uint64_t>(bytes, limit.rlim_cur);
    }
    return bytes;
}

} // namespace shadowdag
