// SPDX-License-Identifier: Apache-2.0
// Compares the results of a frame with the truth. Embree's results are computed once per frame and
// shared by all configurations, because pairs depend on view and lights alone.
#pragma once

#include "cuda/error.h"
#include "hybrid/judge/adjudicator.h"
#include "hybrid/judge/error.h"
#include "tools/workspace/workspace.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace shadowdag {

/// A frame with the inputs of its pairs, as it was rendered or reevaluated (reevaluate_pairs.h).
/// Views are the renderer's, valid until its next frame.
struct PairResults {
    FrameResult frame;
    GBufferView gbuffer;
    VisibilityInputs method;
    bool hasPlane = true; ///< whether lookups use the receiver's plane when reevaluated
    uint64_t missingTapCount = 0;
    uint32_t maxFaceTexels = FrameOptions{}.maxFaceTexels; ///< as the frame allocated
};

/// Returns the results of a frame that a renderer just made. @param options as it was rendered with
PairResults pairResultsOf(FrameResult frame, const FrameRenderer& renderer,
                          const FrameOptions& options);
/// Returns the results in the form of the error analysis and of the flicker meter; views of both.
ErrorInputs errorInputs(const World& world, const PairResults& answers);

/// Returns the wrong pairs of a frame, counted without explanation; for the truth itself the dark
/// ones. Counts of explanations stay 0.
ErrorCounts countWrong(const PairList& pairs, const std::vector<uint8_t>& visibility,
                       const std::vector<uint8_t>& truthVisibility);

/// Returns the bytes that the rays of a run read besides voxels: triangles with our hierarchy or
/// Embree's. @param renderer that rendered it
uint64_t triangleBytes(const RunParameters& run, const FrameRenderer& renderer);

/// Shares of errors over fewer pairs are not reliable: one pair is more than 0.1 %.
inline constexpr uint64_t kFewPairCount = 1000;

/// Thrown (kInput) for a view without anything to compare; other views may still be comparable.
class NothingToCompare : public Error {
public:
    explicit NothingToCompare(const std::string& message) : Error(ErrorKind::kInput, message) {}
};

/// What a view consists of, on which the remedy depends where no light reaches it.
struct ViewOrigin {
    bool arePlacedLights = false;   ///< by --lights
    bool isCameraAutomatic = false; ///< then another automatic one sees no more
};

/// Returns a warning where a view has fewer than kFewPairCount pairs, else "". Throws
/// NothingToCompare if it has none. @param view the scene's name, its view or frame
std::string fewPairsWarning(const std::string& view, uint64_t pairCount,
                            const ViewOrigin& origin = {});
/// Returns the same for a picture, which nothing is compared with: no pair is a warning, too.
std::string darkPictureWarning(const std::string& view, uint64_t pairCount,
                               const ViewOrigin& origin);
/// Returns the same for every object of results that has a "pair_count", once a view; those without
/// pairs are named, too. @param results objects name their view by "scene" or "group"
std::vector<std::string> fewPairsWarnings(const Json& results);

/// The truth about a frame.
struct FrameTruth {
    std::vector<uint8_t> visibility; ///< by pair: lit or dark
    float exposure = 0;              ///< of its picture, see Judge::picture
    std::vector<glm::vec3> display;  ///< the picture, exposed and tone mapped
};

/// What the adjudicator says of wrong pairs.
struct Adjudication {
    uint64_t askedCount = 0;
    uint64_t provenWrongCount = 0; ///< of these
    uint64_t ambiguousCount = 0;   ///< of these: neither answer is wrong

    static constexpr size_t kMostAsked = 4096;

    /// Returns the counts by their names in results.
    Json json() const;
};

/// Asks the adjudicator about pairs of a frame, kMostAsked at most, evenly spaced. Builds its
/// hierarchy over all triangles of the world unless there are no pairs.
/// @param world at the frame's time @param wrong pairs that the truth answers the other way
Adjudication adjudicate(const World& world, const PairResults& answers,
                        const std::vector<uint64_t>& wrong);

/// Returns the pairs that a frame's triangles decided and the truth answers the other way, without
/// those of maps and proofs. @param answers of a frame whose rays believe no voxel
std::vector<uint64_t> wrongPairsOfExactRays(const PairResults& answers,
                                            const std::vector<uint8_t>& truthVisibility);

/// Judges frames of one workspace. A frame is identified by a number that the caller chooses:
/// another view or time of the world needs another number.
class Judge {
public:
    /// @param workspace outlives the judge
    /// @param seed of the rays that explain errors; @param nullSampleCount as ErrorOptions has it
    explicit Judge(Workspace& workspace, uint64_t seed = 1, uint32_t nullSampleCount = 0)
        : workspace_(workspace), seed_(seed), nullSampleCount_(nullSampleCount) {}

    /// Returns Embree's results for the frame of the workspace; computed once per number. Valid
    /// until forget().
    const FrameTruth& truth(int64_t frame, const GBufferView& gbuffer, const PairList& pairs);
    /// The same with its picture. @param exposure 0: computed by autoExposure
    const FrameTruth& picture(int64_t frame, const GBufferView& gbuffer, const PairList& pairs,
                              float exposure = 0);
    /// Returns the frame's errors: counts, per light and in total, with their explanations.
    ErrorReport judge(int64_t frame, const PairResults& answers);
    /// Forgets the results of all frames.
    void forget() { truths_.clear(); }

private:
    Workspace& workspace_;
    uint64_t seed_;
    uint32_t nullSampleCount_;
    std::map<int64_t, FrameTruth> truths_;
};

} // namespace shadowdag
