// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/judge.h"

#include "cuda/error.h"
#include "cuda/macros.h"
#include "cuda/parallel_for.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <utility>

namespace shadowdag {

PairResults pairResultsOf(FrameResult frame, const FrameRenderer& renderer,
                          const FrameOptions& options) {
    PairResults answers;
    answers.missingTapCount = frame.counts.missingTapCount;
    answers.maxFaceTexels = options.maxFaceTexels;
    answers.frame = std::move(frame);
    answers.gbuffer = renderer.gbuffer();
    answers.method = {renderer.rayInputs(options.rays), renderer.shadowMaps(), options.bias};
    return answers;
}

ErrorInputs errorInputs(const World& world, const PairResults& answers) {
    return {answers.gbuffer,
            world.triangles(),
            viewOf(world.lights()),
            answers.frame.pairs,
            answers.frame.visibility,
            answers.frame.pairRoute,
            answers.frame.pairServer,
            answers.method,
            askedTexels(answers.frame.maps, answers.maxFaceTexels),
            answers.hasPlane};
}

ErrorCounts countWrong(const PairList& pairs, const std::vector<uint8_t>& visibility,
                       const std::vector<uint8_t>& truthVisibility) {
    ErrorCounts counts;
    counts.pairCount = pairs.count();
    uint64_t difference = 0; // in 255ths: exact
    for (size_t p = 0; p < pairs.count(); ++p) {
        const bool isDark = visibility[p] < kHalfLit, isTrulyDark = truthVisibility[p] < kHalfLit;
        counts.occludedCount += isTrulyDark;
        counts.falseShadowCount += isDark && !isTrulyDark;
        counts.falseLightCount += !isDark && isTrulyDark;
        difference += uint64_t(std::abs(int(visibility[p]) - int(truthVisibility[p])));
    }
    counts.absVisibilityErrorSum = double(difference) / double(kLit);
    return counts;
}

Json Adjudication::json() const {
    return {{"adjudicated_count", askedCount},
            {"ambiguous_count", ambiguousCount},
            {"proven_wrong_count", provenWrongCount}};
}

Adjudication adjudicate(const World& world, const PairResults& answers,
                        const std::vector<uint64_t>& wrong) {
    Adjudication result;
    if (wrong.empty())
        return result;
    const Adjudicator adjudicator(world.triangles());
    const PairList& pairs = answers.frame.pairs;
    const size_t step = (wrong.size() + Adjudication::kMostAsked - 1) / Adjudication::kMostAsked;
    const size_t count = (wrong.size() + step - 1) / step;
    std::vector<Verdict> verdicts(count);
    cpuParallelRanges(count, 16, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const uint64_t pair = wrong[i * step];
            const uint32_t sample = sampleOfPair(pairs, pair);
            verdicts[i] =
                adjudicator
                    .rule({answers.gbuffer.positionWorld[sample],
                           answers.gbuffer.normalWorld[sample], answers.gbuffer.triangle[sample]},
                          world.lights()[pairs.light[pair]])
                    .verdict;
        }
    });
    for (size_t i = 0; i < count; ++i) {
        const bool saysLit = answers.frame.visibility[wrong[i * step]] >= kHalfLit;
        result.ambiguousCount += verdicts[i] == Verdict::kAmbiguous;
        result.provenWrongCount += verdicts[i] == (saysLit ? Verdict::kDark : Verdict::kLit);
    }
    result.askedCount = count;
    return result;
}

std::vector<uint64_t> wrongPairsOfExactRays(const PairResults& answers,
                                            const std::vector<uint8_t>& truthVisibility) {
    std::vector<uint64_t> wrong;
    SDAG_ASSERT(answers.method.rays.options.believesNone());
    for (uint64_t p = 0; p < answers.frame.visibility.size(); ++p)
        if (answers.frame.pairServer[p].by() == ServedBy::kRays &&
            (answers.frame.visibility[p] < kHalfLit) != (truthVisibility[p] < kHalfLit))
            wrong.push_back(p);
    return wrong;
}

uint64_t triangleBytes(const RunParameters& run, const FrameRenderer& renderer) {
    return run.usesEmbree()      ? renderer.embreeBytes()
           : run.usesTriangles() ? renderer.exactBytes() + renderer.beamBytes()
                                 : 0;
}

namespace {

/// Returns what to do about a view that no light reaches.
std::string remedyOfDarkView(const ViewOrigin& origin) {
    if (!origin.isCameraAutomatic)
        return origin.arePlacedLights
                   ? "; give another --camera, as in --camera auto"
                   : "; give another --camera, as in --camera auto, or place more lights "
                     "with --lights";
    return std::string("; the camera is automatic, and none of the places that it tried sees a lit "
                       "surface: ") +
           (origin.arePlacedLights ? "place lights elsewhere with --seed, or more of them"
                                   : "place lights in the open space with --lights 64") +
           ", or give a place that a light reaches and a point to look at, as in --camera "
           "px,py,pz,tx,ty,tz";
}

} // namespace

std::string fewPairsWarning(const std::string& view, uint64_t pairCount, const ViewOrigin& origin) {
    if (pairCount == 0)
        throw NothingToCompare(view +
                               ": no light reaches what the camera sees, so there is nothing to "
                               "compare" +
                               remedyOfDarkView(origin));
    if (pairCount >= kFewPairCount)
        return "";
    return view + ": has only " + std::to_string(pairCount) +
           " pairs of a visible point and a light; shares of fewer than " +
           std::to_string(kFewPairCount) +
           " are not reliable: use a larger --size, another --camera or several --views";
}

std::string darkPictureWarning(const std::string& view, uint64_t pairCount,
                               const ViewOrigin& origin) {
    return pairCount > 0 ? fewPairsWarning(view, pairCount)
                         : view +
                               ": no light reaches what the camera sees, so the picture is "
                               "black" +
                               remedyOfDarkView(origin);
}

std::vector<std::string> fewPairsWarnings(const Json& results) {
    std::vector<std::string> warnings;
    const std::function<void(const Json&, const std::string&)> visit =
        [&](const Json& value, const std::string& around) {
            std::string view = around;
            if (value.is_object()) {
                for (const char* key : {"group", "scene"})
                    if (value.contains(key) && value[key].is_string())
                        view = value[key].get<std::string>();
                if (value.contains("pair_count") && value["pair_count"].is_number_unsigned()) {
                    const uint64_t count = value["pair_count"].get<uint64_t>();
                    const std::string text =
                        count > 0 ? fewPairsWarning(view, count)
                                  : view + ": has no pair of a visible point and a light, so "
                                           "nothing was compared";
                    if (!text.empty() &&
                        std::find(warnings.begin(), warnings.end(), text) == warnings.end())
                        warnings.push_back(text);
                }
            }
            if (value.is_structured())
                for (const Json& member : value)
                    visit(member, view);
        };
    visit(results, "the study");
    return warnings;
}

const FrameTruth& Judge::truth(int64_t frame, const GBufferView& gbuffer, const PairList& pairs) {
    const auto [found, isNew] = truths_.try_emplace(frame);
    if (isNew) {
        try {
            found->second.visibility =
                workspace_.truth().visibility(gbuffer, workspace_.world().lights(), pairs);
        } catch (...) {
            truths_.erase(found);
            throw;
        }
    }
    return found->second;
}

const FrameTruth& Judge::picture(int64_t frame, const GBufferView& gbuffer, const PairList& pairs,
                                 float exposure) {
    truth(frame, gbuffer, pairs);
    FrameTruth& of = truths_.at(frame);
    if (of.display.empty()) {
        const std::vector<glm::vec3> color =
            shadePairs(gbuffer, workspace_.world(), pairs, of.visibility);
        of.exposure = exposure > 0 ? exposure : autoExposure(color);
        of.display = toneMap(color, of.exposure);
    }
    return of;
}

ErrorReport Judge::judge(int64_t frame, const PairResults& answers) {
    const std::vector<uint8_t>& visibility =
        truth(frame, answers.gbuffer, answers.frame.pairs).visibility;
    ErrorOptions options;
    options.seed = seed_;
    options.nullSampleCount = nullSampleCount_;
    return computeError(errorInputs(workspace_.world(), answers), workspace_.truth(), visibility,
                        options);
}

} // namespace shadowdag
