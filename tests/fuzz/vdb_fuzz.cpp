// SPDX-License-Identifier: Apache-2.0
// OpenVDB's files, read in a process of its own within its limits, as `import` does: OpenVDB's
// reader may crash on a damaged file, and only that process with it.
#include "cuda/error.h"
#include "scenes/limited_process.h"
#include "tests/fuzz/grid_files.h"
#include "voxel/vdb_file.h"

#include <sys/resource.h>
#include <sys/wait.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

namespace shadowdag::fuzz::vdb {

namespace {

/// Status of the process for an exception that would end the program; sanitizers exit with 1.
constexpr int kUncaught = 9;

/// Reads the file and ends this process: 0 for a grid or a refusal, 3 for memory that is short,
/// which the limits make of a damaged file.
[[noreturn]] void readAndExit(const std::string& path, const VdbLimits& limits) {
#if !defined(SDAG_SANITIZED) // sanitizers reserve terabytes for themselves
    lowerLimit(RLIMIT_DATA, limits.memoryBytes);
#endif
    lowerLimit(RLIMIT_CPU, limits.cpuSeconds);
    lowerLimit(RLIMIT_CORE, 0);
    if (std::freopen("/dev/null", "w", stderr) == nullptr)
        _exit(kUncaught);
    for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP})
        std::signal(signal, SIG_DFL);
    try {
        readVdb(path, {"", true, "0.1"});
    } catch (const Error& error) {
        _exit(error.kind() == ErrorKind::kResource ? 3 : 0);
    } catch (...) {
        _exit(kUncaught);
    }
    _exit(0);
}

void fuzzOne(const uint8_t* data, size_t size) {
    const std::string path = fuzzFolder().write("grid.vdb", data, size);
    const VdbLimits limits = vdbLimits(size, false);
    const pid_t child = fork();
    fuzzCheck(child >= 0, "a process can be started");
    if (child == 0)
        readAndExit(path, limits);
    int status = 0;
    struct rusage usage {};
    while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    fuzzCheck(!WIFEXITED(status) || WEXITSTATUS(status) != kUncaught,
              "every exception is an Error");
#if !defined(SDAG_SANITIZED)
    fuzzCheck(uint64_t(usage.ru_maxrss) << 10 <= limits.memoryBytes + (uint64_t(64) << 20),
              "the process takes no more memory than vdbLimits");
#endif
    fuzzCheck(uint64_t(usage.ru_utime.tv_sec) <= 8, "the process takes no more than 8 s");
}

std::vector<std::string> seeds() {
    return exportedGrids(".vdb");
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "vdb", .maxBytes = 32768, .fuzzOne = fuzzOne, .seeds = seeds, .replayCount = 300});

} // namespace

} // namespace shadowdag::fuzz::vdb
