// SPDX-License-Identifier: Apache-2.0
// Host/device annotations and the assertion for a programmer's mistakes.
#pragma once

#include <cassert>

#if defined(__CUDACC__)
#define SDAG_HD __host__ __device__
#else
/// Marks a function that both processors compile from the same text.
#define SDAG_HD
#endif

/// States what the program itself guarantees. Bad input, files and devices throw Error instead.
#define SDAG_ASSERT(condition) assert(condition)
