// SPDX-License-Identifier: Apache-2.0
// An allocation that fails: replaces operator new for the whole test binary, libraries included.
#pragma once

namespace shadowdag::test {

/// Counts allocations from 0 again, of all threads; the one of this number throws std::bad_alloc.
/// 0: none does.
void failAllocation(long number);
/// Returns how many there were since.
long allocationCount();

} // namespace shadowdag::test
