// SPDX-License-Identifier: Apache-2.0
// The most bytes that operator new has held at once: replaces it for the whole test binary,
// libraries included.
#pragma once

#include <cstddef>

namespace shadowdag::test {

/// Starts a new measurement.
void resetAllocationPeak();
/// Returns the most bytes held at once since the reset, beyond what was held then.
size_t allocationPeakBytes();

} // namespace shadowdag::test
