// SPDX-License-Identifier: Apache-2.0
// Compares a method with the truth: confusion per light, explained and unexplained errors.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/frame/shade.h"
#include "hybrid/gbuffer/flip.h"
#include "hybrid/gbuffer/image_metrics.h"
#include "hybrid/gbuffer/tone_map.h"
#include "hybrid/judge/truth.h"

#include <array>
#include <vector>

namespace shadowdag {

/// Counts of pairs. A pair is dark when visibility < kHalfLit; a false shadow is dark where the
/// truth is lit, a false light the reverse.
struct ErrorCounts {
    uint64_t pairCount = 0;
    uint64_t occludedCount = 0; ///< dark in the truth
    uint64_t falseShadowCount = 0;
    uint64_t falseLightCount = 0;
    uint64_t unexplainedFalseShadowCount = 0; ///< none of the other classes
    uint64_t unexplainedFalseLightCount = 0;
    uint64_t settledFalseShadowCount = 0; ///< of the unexplained: "settled" of explain.h
    uint64_t settledFalseLightCount = 0;
    uint64_t tapSettledCount = 0; ///< of the settled: by the truth along the taps' own rays
    uint64_t acneCount = 0;       ///< false shadow whose blocker is the receiver's own surface
    uint64_t contactCount =
        0; ///< false light whose true blockers are nearer to an end than the offset
    uint64_t magnifiedCount = 0;      ///< wrong, displaced by many pixels: "magnified" of explain.h
    double absVisibilityErrorSum = 0; ///< sum |method - truth| in [0, 1] over pairs

    void add(const ErrorCounts& other);
    double meanAbsVisibilityError() const {
        return pairCount ? absVisibilityErrorSum / double(pairCount) : 0.0;
    }
};

/// The classification of one pair; all but the first are wrong pairs. Definitions in explain.h.
/// Settled pairs are unexplained ones that an aimed shift or the taps' own rays confirm.
enum class PairVerdict : uint8_t {
    kRight,
    kExplained,
    kUnexplained,
    kAcne,
    kContact,
    kMagnified,
    kSettled,
    kTapSettled
};

struct ErrorReport {
    ErrorCounts total;
    std::vector<ErrorCounts> perLight;               ///< by world light
    std::array<uint64_t, 256> visibilityHistogram{}; ///< the method's visibility over all pairs
    double nullRate = 0; ///< share of sampled right pairs that the same 32 rays would flip
    /// Right pairs sampled, with replacement, without those whose reverse would be magnified.
    uint64_t nullSampleCount = 0;
    /// The same of right pairs near an outline (isNearOutline), where wrong pairs lie, and by the
    /// servers (ServedBy) of wrong pairs, in their proportions: what the share of explained errors
    /// is to be compared with.
    double outlineNullRate = 0;
    uint64_t outlineNullSampleCount = 0;
    /// How selective settling by the taps' own rays is: the share of the sampled right pairs by
    /// maps that it would settle if they were wrong, that is those for which the truth along the
    /// taps' rays differs. The nearer to 0, the less of it is chance.
    double tapNullRate = 0;
    /// The same for pairs that none of the 32 rays would have flipped: only then are taps tested.
    double tapOnlyNullRate = 0;
    uint64_t tapNullSampleCount = 0;   ///< right pairs by maps among the sampled
    std::vector<PairVerdict> verdicts; ///< per pair
    /// Wrong pairs that triangles decided or a proof, without contact: the method promises the
    /// truth but for rounding. Ascending.
    std::vector<uint64_t> exactWrongPairs;
    /// Wrong pairs that break a promise of rays through voxels (PairJudge::Promises).
    uint64_t beyondBeliefCount = 0, coarserCellCount = 0;

    /// Returns the number of wrong pairs that one of the 32 rays explains.
    uint64_t explainedCount() const;
    /// Returns whether explaining tells wrong pairs from right ones near outlines: it would excuse
    /// half of the right ones at most, and a smaller share of them than of the wrong ones. True if
    /// there are no wrong pairs or no sampled right ones.
    bool explainingHasPower() const;
};

struct ErrorOptions {
    uint64_t seed = 1; ///< of the 32 shifts and of the null sample
    uint32_t nullSampleCount = 20000;
    RayOptions rays;                                       ///< as the frame used
    uint32_t maxFaceTexels = FrameOptions{}.maxFaceTexels; ///< as the frame used
    ShadowMapBias bias;                                    ///< as the frame used
};

/// A frame's visibilities and all inputs needed to trace them again, as views on the host.
/// visibility, pairRoute, pairServer: one per pair (FrameResult). triangles: those of the DAG and
/// of the truth.
struct ErrorInputs {
    GBufferView gbuffer;
    TriangleView triangles;
    View<const Light> lights;
    const PairList& pairs;
    const std::vector<uint8_t>& visibility;
    const std::vector<Route>& pairRoute;
    const std::vector<PairServer>& pairServer;
    VisibilityInputs method;
    /// By map: the face resolution that the equation asks (askedTexels); empty, or 0 for a map:
    /// the one that the map has.
    std::vector<float> askedTexels = {};
    bool hasPlane = true; ///< whether lookups use the receiver's plane
};

/// Returns by drawn map, in the order of shadowMaps(), the face resolution that its clusters
/// request, at most `maxFaceTexels`, the largest that the frame may allocate; 0 for directional
/// lights, whose windows have no faces.
std::vector<float> askedTexels(const std::vector<MapRecord>& maps, uint32_t maxFaceTexels);

/// Returns whether the truth of a light is another one at one of the eight pixels around a
/// sample's, of those that form a pair with that light.
bool isNearOutline(const GBufferView& gbuffer, const PairList& pairs,
                   const std::vector<uint8_t>& truthVisibility, uint32_t sample, uint64_t pair);

/// Returns the comparison of a frame with the truth, pair by pair. Deterministic: integers depend
/// on the inputs and the seed alone.
/// @param truthVisibility from Truth::visibility over the same pairs
ErrorReport computeError(const FrameRenderer& renderer, const FrameResult& frame,
                         const World& world, const Truth& truth,
                         const std::vector<uint8_t>& truthVisibility, const ErrorOptions& options);

/// The same over bare views. `options` gives seed and null sample; offset, level and bias come from
/// inputs.method. Throws Error kUsage when the arrays do not have one entry per pair.
ErrorReport computeError(const ErrorInputs& inputs, const Truth& truth,
                         const std::vector<uint8_t>& truthVisibility, const ErrorOptions& options);

/// Returns the shaded image for these visibilities (for example the truth's): same formula and same
/// order of sums as the frame's shading pass, so the frame's own visibilities give the frame's own
/// image.
std::vector<glm::vec3> shadePairs(const GBufferView& gbuffer, const World& world,
                                  const PairList& pairs, const std::vector<uint8_t>& visibility);

} // namespace shadowdag
