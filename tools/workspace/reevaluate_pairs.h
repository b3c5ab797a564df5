// SPDX-License-Identifier: Apache-2.0
// A frame's pairs answered once more, with something left out that no option leaves out.
#pragma once

#include "tools/workspace/judge.h"

namespace shadowdag {

/// Takes movers and the receiver's plane out of what the pairs are answered by next, where they are
/// not to be there.
void leaveOut(bool hasMovers, bool hasPlane, Answers& answers);

/// Answers all pairs of a frame by what answers.method now is, on the CPU; replaces visibility and
/// missingTapCount.
void askAgain(const World& world, Answers& answers);

} // namespace shadowdag
