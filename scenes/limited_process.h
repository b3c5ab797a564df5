// SPDX-License-Identifier: Apache-2.0
// Runs work on untrusted input in a process of its own, which may crash, or take its limits of
// memory and time, without harm to this one. The process is a fork that executes no other program,
// so that libraries and Python have it, too. Work must take no lock that another thread of this
// process may hold, and start no thread; glibc's malloc may be used.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace shadowdag {

/// What the process may take.
struct ProcessLimits {
    uint64_t memoryBytes; ///< that it may write beyond what this process has (RLIMIT_DATA)
    uint64_t cpuSeconds;
    uint64_t outputBytes; ///< it is killed when it writes more
};

/// How the process ended.
struct ProcessEnd {
    std::string output;                  ///< what it wrote
    int status = 0;                      ///< its exit status, unless a signal ended it
    int signal = 0;                      ///< that ended it; 0: none
    bool wroteTooMuch = false;           ///< more than outputBytes: it was killed for that
    std::string tighterMemoryLimit = {}; ///< "ulimit -v" if that left less than memoryBytes; or ""
};

/// Lowers a soft limit of this process, which stays where it is lower already.
/// @param resource such as RLIMIT_CPU
void lowerLimit(int resource, uint64_t value);

/// Passes bytes to the process that waits.
using ByteSink = std::function<void(const void* data, size_t byteCount)>;

/// Runs `work` in a process of its own and returns how that ended. It has no standard streams
/// and none of this process's open files, and is killed when this process ends. While it runs, this
/// thread waits and can be cancelled (pollCpu), which kills it. With sanitizers, which reserve
/// terabytes for themselves, its memory is not limited.
/// @param what is read, for messages
/// @param work returns its exit status, 0 to 254; an exception of it gives 255
/// Throws Error kResource where no process can be started.
ProcessEnd runInProcess(const std::string& what, const ProcessLimits& limits,
                        const std::function<int(const ByteSink& write)>& work);

} // namespace shadowdag
