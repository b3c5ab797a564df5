// SPDX-License-Identifier: Apache-2.0
// A frame's pairs asked once more, with something left out that no option leaves out.
#pragma once

#include "tools/studies/failures.h"

#include <vector>

namespace shadowdag {

/// A frame's answers, by the frame itself or asked again. Views are the renderer's, valid until its
/// next frame.
struct Answers {
    FrameResult frame;
    GBufferView gbuffer;
    VisibilityInputs method;
    bool hasPlane = true; ///< whether lookups are told the receiver's plane when asked again
    uint64_t missingTapCount = 0;
};

/// Takes movers and the receiver's plane out of what answers will be asked of, where the setup says
/// so.
void leaveOut(const CellSetup& setup, Answers& answers);

/// Asks all pairs of a frame of what answers.method now is, on the CPU; replaces visibility and
/// missingTapCount.
void askAgain(const World& world, Answers& answers);

} // namespace shadowdag
