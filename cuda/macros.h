// SPDX-License-Identifier: Apache-2.0
// Host/device annotations and the assertion for a programmer's mistakes.
#pragma once

#include <cstdio>
#include <cstdlib>

#if defined(__CUDACC__)
#define SDAG_HD __host__ __device__
#else
/// Marks a function that is compiled for both processors.
#define SDAG_HD
#endif

namespace shadowdag::detail {

/// Prints the failed condition and its location, and aborts.
[[noreturn]] inline void assertionFailed(const char* condition, const char* file, int line) {
    std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
    std::abort();
}

} // namespace shadowdag::detail

/// States a condition that the program itself guarantees. Bad input, files and devices throw Error
/// instead. Checked if the build defines SDAG_ASSERTIONS (its option of that name) or leaves NDEBUG
/// undefined; otherwise the condition is not evaluated.
#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
#if defined(__CUDA_ARCH__)
#define SDAG_ASSERT(condition) ((condition) ? static_cast<void>(0) : __trap())
#else
#define SDAG_ASSERT(condition)                                                                     \
    ((condition) ? static_cast<void>(0)                                                            \
                 : ::shadowdag::detail::assertionFailed(#condition, __FILE__, __LINE__))
#endif
#else
#define SDAG_ASSERT(condition) static_cast<void>(0)
#endif
