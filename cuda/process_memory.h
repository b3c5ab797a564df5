// SPDX-License-Identifier: Apache-2.0
// How much memory this process may take at most.
#pragma once

#include <cstdint>

namespace shadowdag {

/// Returns the bytes that the process may take: the machine's memory, or less by a limit of the
/// process (ulimit -d, -v). What others use now is not subtracted.
uint64_t processMemoryBytes();

} // namespace shadowdag
