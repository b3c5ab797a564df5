// SPDX-License-Identifier: Apache-2.0
// Large pages for large arrays, where the system has them.
#pragma once

#include <cstddef>

namespace shadowdag {

/// Bytes of a large page, and of the smallest array that is rounded up to whole ones or asks for
/// them by itself.
constexpr size_t kLargePageBytes = size_t(2) << 20, kLeastLargeBytes = 4 * kLargePageBytes;

/// Asks the system for large pages in [data, data + bytes), as far as whole ones fit: the first
/// touch of such an array then takes a third of the time, and scattered reads miss the translation
/// buffer less. Before the memory is touched. A refusal changes nothing; off Linux it does nothing.
void useLargePages(void* data, size_t bytes);

} // namespace shadowdag
