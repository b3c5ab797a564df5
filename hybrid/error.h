// SPDX-License-Identifier: Apache-2.0
// A method held against the truth: confusion per light, explained and unexplained errors, image metrics.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/truth.h"

#include <array>
#include <vector>

namespace shadowdag {

/// Counts of pairs; see the words in the interface description: dark is visibility < kHalfLit, a false shadow is dark
/// where the truth is lit, a false light the reverse.
struct ErrorCounts {
    uint64_t pairCount = 0;
    uint64_t occludedCount = 0;               ///< dark by the truth
    uint64_t falseShadowCount = 0;
    uint64_t falseLightCount = 0;
    uint64_t unexplainedFalseShadowCount = 0; ///< neither explained, nor acne, nor contact
    uint64_t unexplainedFalseLightCount = 0;
    uint64_t acneCount = 0;                   ///< false shadow whose blocker is the receiver's own surface
    uint64_t contactCount = 0;                ///< false light whose true blocker is nearer to an end than the offset
    double absVisibilityErrorSum = 0;         ///< sum |method - truth| in [0, 1] over pairs

    void add(const ErrorCounts& other);
    double meanAbsVisibilityError() const { return pairCount ? absVisibilityErrorSum / double(pairCount) : 0.0; }
};

/// What became of one wrong pair.
enum class PairVerdict : uint8_t { kRight, kExplained, kUnexplained, kAcne, kContact };

struct ErrorReport {
    ErrorCounts total;
    std::vector<ErrorCounts> perLight;             ///< by world light
    std::array<uint64_t, 256> visibilityHistogram{}; ///< the method's visibility over all pairs
    double nullRate = 0;                           ///< share of sampled right answers that the same 32 rays would flip
    uint64_t nullSampleCount = 0;
    std::vector<PairVerdict> verdicts;             ///< per pair
};

struct ErrorOptions {
    uint64_t seed = 1;            ///< of the 32 shifts and of the null sample
    uint32_t nullSampleCount = 20000;
    float dagOffset = 1.0f;       ///< as the frame used
    uint32_t dagLevel = 0;
    ShadowMapBias bias;           ///< as the frame used
};

/// Returns the comparison of a frame with the truth, pair by pair. Deterministic.
/// @param truthVisibility from Truth::visibility over the same pairs
ErrorReport computeError(const FrameRenderer& renderer, const FrameResult& frame, const World& world, const Dag& dag, const Truth& truth,
                         const std::vector<uint8_t>& truthVisibility, const ErrorOptions& options);

/// Returns the image that shading gives with these visibilities (the truth's, say): same formula as the frame's shading pass.
std::vector<glm::vec3> shadePairs(const GBufferView& gbuffer, const World& world, const PairList& pairs, const std::vector<uint8_t>& visibility);

/// Maps linear radiance to display sRGB in [0, 1]: exposure, then the filmic curve stated in the source, then the sRGB transfer.
std::vector<glm::vec3> toneMap(const std::vector<glm::vec3>& linear, float exposure);
/// Returns the exposure that puts the log-average luminance of an image at 0.18; 1 for a black image.
float autoExposure(const std::vector<glm::vec3>& linear);

/// Returns the root of the mean squared difference over pixels and channels of two display images.
double computeRmse(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);
/// Returns the mean FLIP difference of two display images (67 pixels per degree) and, in `map` when not null, the value
/// per pixel. Source: Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, FLIP: A Difference Evaluator for Alternating Images, HPG 2020.
double computeFlip(const std::vector<glm::vec3>& reference, const std::vector<glm::vec3>& test, uint32_t width, uint32_t height,
                   std::vector<float>* map = nullptr);

} // namespace shadowdag
