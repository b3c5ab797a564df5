// SPDX-License-Identifier: Apache-2.0
// The measurements of a sequence: frames in order, what a renderer keeps from frame to frame kept,
// so that static optimization, retained pages and held resolutions do what they are for.
//
// Every configuration has a renderer of its own, for what it keeps; what stands for the scene
// (batches, levels of detail, voxels as rays read them, what moves) is made once and follows each
// frame once, as are the pairs and the truth about them; what following took is part of the time of
// every configuration that needs it. A frame is shown to one configuration after the other, each
// frame starting with another one, so that a machine that slows down slows all alike.
// Before each frame come the `lead_in` frames before it at the fixed clock, rendered but not
// counted: frames with a step between them then have true predecessors. Frame 0 has none and is led
// in by itself, so that it starts warm.
//
// The whole sequence is rendered once with recording, for counts, errors and flicker, then
// `warmups` times uncounted, then `repeats` times for time alone, each time from nothing. Times
// hold what following the moved instances takes (FrameRenderer::worldChanged).
//
// The journal keeps every frame of the recording and every round of times. Taken up, a recording
// goes on at the first frame that is missing: what renderers keep of those before is rendered again
// without recording.
#pragma once

#include "tools/workspace/measure.h"

namespace shadowdag {

/// One frame as it is shown.
struct SequenceStep {
    uint32_t frame;
    bool isCounted; ///< otherwise it leads in
    bool operator==(const SequenceStep&) const = default;
};

/// Returns the frames to show, in order. @param frames ascending
std::vector<SequenceStep> sequenceSteps(const std::vector<uint32_t>& frames, uint32_t leadIn);

/// Measures every configuration over the experiment's frames; `sequenceRuns` of what it returns is
/// filled, one object a frame and configuration, frame by frame. Beside times and counts as in
/// compare's runs each has confusion counts, "lighting_computation_count" (samples times lights of
/// their clusters) and flicker_* since the frame shown before it. Throws Error kUsage for a model
/// that needs costs.
SceneMeasurement measureSequence(Workspace& workspace, const Experiment& experiment,
                                 const std::vector<RunParameters>& runs,
                                 const MeasureContext& context);

} // namespace shadowdag
