// SPDX-License-Identifier: Apache-2.0
// The measurements of a sequence: frames in order, with the renderer's state kept from frame to
// frame, so that static optimization, retained pages and held resolutions take effect.
//
// Every configuration has its own renderer for its state. The scene's shared data (batches, levels
// of detail, voxels in the form of rays, moving geometry) is made once and updated once per frame,
// as are the pairs and the truth; the time of an update is part of the time of every configuration
// that needs it. A frame is shown to one configuration after the other, each frame starting with
// another one, so that a machine that slows down affects all equally. Before each frame come the
// `lead_in` frames before it at the fixed clock, rendered but not counted: frames with a step
// between them then have true predecessors. Frame 0 has none and is preceded by itself, so that it
// starts warm.
// The whole sequence is rendered once with recording, for counts, errors and flicker, then
// `warmups` times uncounted, then `repeats` times for times alone, each time from the beginning.
// Times include the update of moved instances (FrameRenderer::worldChanged).
//
// The journal stores every frame of the recording and every round of times. A resumed recording
// continues at the first missing frame: the renderers' state of earlier frames is rendered again
// without recording.
#pragma once

#include "tools/workspace/measure.h"

namespace shadowdag {

/// One frame of the sequence.
struct SequenceStep {
    uint32_t frame;
    bool isCounted; ///< otherwise it is a lead-in frame
    bool operator==(const SequenceStep&) const = default;
};

/// Returns the frames to show, in order. @param frames ascending
std::vector<SequenceStep> sequenceSteps(const std::vector<uint32_t>& frames, uint32_t leadIn);

/// Throws Error kUsage for the first run whose model needs the costs of every frame: a sequence has
/// none.
void refuseModelsOfCosts(const std::vector<RunParameters>& runs);

/// Measures every configuration over the experiment's frames and fills `sequenceRuns` of the
/// result, one object per frame and configuration, frame by frame. Besides times and counts as in
/// compare's runs each has confusion counts, "lighting_computation_count" (samples times lights of
/// their clusters) and, since the frame shown before it, flicker_* and "frame_difference_error"
/// (computeFrameDifferenceError of pictures at the exposure of the sequence's first frame; absent
/// where no frame was shown before). Throws as refuseModelsOfCosts.
SceneMeasurement measureSequence(Workspace& workspace, const Experiment& experiment,
                                 const std::vector<RunParameters>& runs,
                                 const MeasureContext& context);

} // namespace shadowdag
