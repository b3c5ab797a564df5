// SPDX-License-Identifier: Apache-2.0
// The most bytes that the heap has held at once: of every malloc and operator new of the process,
// libraries included, but not of memory that is mapped without malloc. memory_meter_malloc.cpp
// replaces malloc; memory_meter_sanitizer.cpp asks AddressSanitizer.
#pragma once

#include <cstdint>

namespace shadowdag::fuzz {

/// Starts a new measurement.
void startMemoryMeter();

/// Returns the most bytes held at once since the start, beyond what was held then.
uint64_t meteredPeakBytes();

} // namespace shadowdag::fuzz
