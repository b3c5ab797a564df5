// SPDX-License-Identifier: Apache-2.0
// The judge: the answers of a frame against the truth. What Embree answers is asked once a frame
// and shared by all configurations, since pairs follow from view and lights alone.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/workspace/workspace.h"

#include <cstdint>
#include <map>
#include <vector>

namespace shadowdag {

/// A frame with what its pairs were answered by, as it was rendered or reevaluated
/// (reevaluate_pairs.h). Views are the renderer's, valid until its next frame.
struct Answers {
    FrameResult frame;
    GBufferView gbuffer;
    VisibilityInputs method;
    bool hasPlane = true; ///< whether lookups are told the receiver's plane when reevaluated
    uint64_t missingTapCount = 0;
};

/// Returns a frame that a renderer just made as answers. @param options as it was rendered with
Answers answersOf(FrameResult frame, const FrameRenderer& renderer, const FrameOptions& options);
/// Returns the answers as the error analysis and the flicker meter take them; views of both.
ErrorInputs errorInputs(const World& world, const Answers& answers);

/// Returns the wrong answers of a frame, counted without asking why; of the truth against itself
/// the dark ones. Counts of explanations stay 0.
ErrorCounts countWrong(const PairList& pairs, const std::vector<uint8_t>& visibility,
                       const std::vector<uint8_t>& truthVisibility);

/// What Embree answers to a frame.
struct FrameTruth {
    std::vector<uint8_t> visibility; ///< by pair: lit or dark
    float exposure = 0;              ///< of its picture, see Judge::picture
    std::vector<glm::vec3> display;  ///< the picture, exposed and tone mapped
};

/// Judges frames of one workspace. Frames are told apart by a number that the caller chooses:
/// whoever renders another view or time of the world gives another number.
class Judge {
public:
    /// @param workspace outlives the judge
    /// @param seed of the rays that explain errors; @param nullSampleCount as ErrorOptions has it
    explicit Judge(Workspace& workspace, uint64_t seed = 1, uint32_t nullSampleCount = 0)
        : workspace_(workspace), seed_(seed), nullSampleCount_(nullSampleCount) {}

    /// Returns what Embree answers to the frame that the workspace shows; asked once a number.
    /// Valid until forget().
    const FrameTruth& truth(int64_t frame, const GBufferView& gbuffer, const PairList& pairs);
    /// The same with its picture. @param exposure 0: found, as autoExposure finds it
    const FrameTruth& picture(int64_t frame, const GBufferView& gbuffer, const PairList& pairs,
                              float exposure = 0);
    /// Returns the frame's errors: counts, of each light and of all, with their explanations.
    ErrorReport judge(int64_t frame, const Answers& answers);
    /// Forgets the answers to all frames.
    void forget() { truths_.clear(); }

private:
    Workspace& workspace_;
    uint64_t seed_;
    uint32_t nullSampleCount_;
    std::map<int64_t, FrameTruth> truths_;
};

} // namespace shadowdag
