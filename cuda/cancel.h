// SPDX-License-Identifier: Apache-2.0
// Lets long work on the CPU be cancelled and its progress be shown: the program sets a function
// that loops call, and that throws once the user asks it to end.
#pragma once

namespace shadowdag {

/// Sets the function that parallel loops call before each of their ranges (cuda/parallel_for.h),
/// and long serial loops from time to time: on the thread that works, several at a time. An
/// exception from it ends the loop, which rethrows it; what the loop writes is then undefined. For
/// the whole process; null, as it is at first: work is never cancelled.
/// @param poll receives the share of a loop's ranges that were begun before, below 1; -1 for loops
/// inside of others and for serial ones
void setCpuPoll(void (*poll)(double fraction));

/// Calls that function, if there is one. For loops that may take more than a tenth of a second.
void pollCpu(double fraction = -1);

} // namespace shadowdag
