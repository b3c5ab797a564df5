// SPDX-License-Identifier: Apache-2.0
// Computes a frame's pairs again without something that no option removes.
#pragma once

#include "tools/workspace/judge.h"

namespace shadowdag {

/// Removes moving geometry or the receiver's plane from the inputs of the next evaluation, as
/// requested.
void leaveOut(bool hasMovers, bool hasPlane, PairResults& answers);

/// Computes all pairs of a frame with the current answers.method, on the CPU; replaces visibility
/// and missingTapCount.
void askAgain(const World& world, PairResults& answers);

} // namespace shadowdag
