// SPDX-License-Identifier: Apache-2.0
// Judge: the truth computed once per frame, the same counts as the error analysis.
#include "tools/workspace/judge.h"

#include "cuda/error.h"
#include "tests/tools/workspace/sliding_scene.h"
#include "tools/workspace/reevaluate_pairs.h"
#include "tools/workspace/self_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <numeric>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using testing::Not;
using testing::UnorderedElementsAre;

constexpr uint32_t kLog2 = 5;

class JudgeTest : public testing::Test {
protected:
    JudgeTest() {
        options_.width = 96;
        options_.height = 64;
    }

    PairResults render(const char* model) {
        FrameRenderer& renderer = workspace_.renderer(kLog2);
        renderer.reset();
        return pairResultsOf(renderer.render(workspace_.camera(), *makeCostModel(model), options_),
                             renderer, options_);
    }

    Workspace workspace_ = slidingWorkspace();
    FrameOptions options_;
};

} // namespace

TEST_F(JudgeTest, CountsAreThoseOfTheErrorAnalysis) {
    Judge judge(workspace_, 7, 500);
    const PairResults answers = render("texels:inf");
    const ErrorReport report = judge.judge(0, answers);
    ErrorOptions options;
    options.seed = 7;
    options.nullSampleCount = 500;
    options.rays = options_.rays;
    options.bias = options_.bias;
    const std::vector<uint8_t> visibility = workspace_.truth().visibility(
        answers.gbuffer, workspace_.world().lights(), answers.frame.pairs);
    const ErrorReport asked =
        computeError(workspace_.renderer(kLog2), answers.frame, workspace_.world(),
                     workspace_.truth(), visibility, options);
    EXPECT_GT(report.total.falseShadowCount, 0u);
    EXPECT_EQ(report.total.falseShadowCount, asked.total.falseShadowCount);
    EXPECT_EQ(report.verdicts, asked.verdicts);
    EXPECT_EQ(report.nullRate, asked.nullRate);
    EXPECT_EQ(report.perLight.size(), 1u);
    const ErrorCounts counted =
        countWrong(answers.frame.pairs, answers.frame.visibility, visibility);
    EXPECT_EQ(counted.pairCount, report.total.pairCount);
    EXPECT_EQ(counted.occludedCount, report.total.occludedCount);
    EXPECT_EQ(counted.falseShadowCount, report.total.falseShadowCount);
    EXPECT_EQ(counted.falseLightCount, report.total.falseLightCount);
    EXPECT_EQ(counted.meanAbsVisibilityError(), report.total.meanAbsVisibilityError());
}

TEST_F(JudgeTest, SurfacesThatAreLostBeforeTheBackgroundAreHiddenSamples) {
    options_.rays.believe = 0.0f;
    PairResults answers = render("texels:inf");
    Judge judge(workspace_);
    const ErrorReport report = judge.judge(0, answers);
    EXPECT_EQ(checkFrame(workspace_, answers, report).text(), "");
    std::vector<uint32_t> triangles(answers.gbuffer.triangle.data,
                                    answers.gbuffer.triangle.data + answers.gbuffer.count());
    uint64_t lost = 0;
    for (size_t s = 0; s < triangles.size(); s += 3)
        if (triangles[s] != kBackground) {
            triangles[s] = kBackground;
            ++lost;
        }
    ASSERT_GT(lost, 100u);
    answers.gbuffer.triangle = viewOf(triangles);
    const SelfChecks checks = checkFrame(workspace_, answers, report);
    EXPECT_LE(checks.hiddenSampleCount, lost);
    EXPECT_GE(checks.hiddenSampleCount, lost * 9 / 10); // not of surfaces' edges
}

TEST_F(JudgeTest, TheAdjudicatorIsAskedAboutEvenlySpacedPairsOfMany) {
    options_.width = 384;
    options_.height = 256;
    options_.rays.believe = 0.0f;
    PairResults answers = render("texels:inf");
    std::vector<uint64_t> all(answers.frame.pairs.count());
    std::iota(all.begin(), all.end(), uint64_t(0));
    ASSERT_GT(all.size(), 2 * Adjudication::kMostAsked);
    const Adjudication right = adjudicate(workspace_.world(), answers, all);
    EXPECT_EQ(right.provenWrongCount, 0u);
    for (uint8_t& visibility : answers.frame.visibility)
        visibility = visibility < kHalfLit ? kLit : uint8_t(0);
    const Adjudication wrong = adjudicate(workspace_.world(), answers, all);
    EXPECT_LE(wrong.askedCount, Adjudication::kMostAsked);
    EXPECT_GT(wrong.askedCount, Adjudication::kMostAsked / 2);
    EXPECT_EQ(wrong.ambiguousCount, right.ambiguousCount);
    EXPECT_EQ(wrong.provenWrongCount + wrong.ambiguousCount, wrong.askedCount);
    EXPECT_LT(wrong.ambiguousCount, wrong.askedCount / 100);
    EXPECT_EQ(adjudicate(workspace_.world(), answers, {all.back()}).askedCount, 1u);
}

TEST_F(JudgeTest, TheTruthIsComputedOncePerFrame) {
    Judge judge(workspace_);
    const PairResults rays = render("texels:inf");
    const FrameTruth& first = judge.truth(3, rays.gbuffer, rays.frame.pairs);
    const PairResults maps = render("texels:0");
    EXPECT_EQ(&judge.truth(3, maps.gbuffer, maps.frame.pairs), &first);
    const std::vector<uint8_t> before = first.visibility;
    workspace_.setTime(3);
    const PairResults later = render("texels:0");
    EXPECT_NE(judge.truth(4, later.gbuffer, later.frame.pairs).visibility, before);
    EXPECT_EQ(judge.truth(3, later.gbuffer, later.frame.pairs).visibility, before);
    judge.forget();
    EXPECT_NE(judge.truth(3, later.gbuffer, later.frame.pairs).visibility, before);
}

TEST_F(JudgeTest, ThePictureIsThatOfTheTruth) {
    Judge judge(workspace_);
    const PairResults answers = render("texels:0");
    const FrameTruth& found = judge.picture(0, answers.gbuffer, answers.frame.pairs);
    const std::vector<glm::vec3> color =
        shadePairs(answers.gbuffer, workspace_.world(), answers.frame.pairs, found.visibility);
    EXPECT_EQ(found.exposure, autoExposure(color));
    EXPECT_EQ(found.display, toneMap(color, found.exposure));
    EXPECT_EQ(judge.picture(1, answers.gbuffer, answers.frame.pairs, 2.0f).exposure, 2.0f);
}

TEST_F(JudgeTest, ReevaluatedPairsAreEqual) {
    PairResults answers = render("texels:inf");
    const std::vector<uint8_t> visibility = answers.frame.visibility;
    askAgain(workspace_.world(), answers);
    EXPECT_EQ(answers.frame.visibility, visibility);
    leaveOut(false, true, answers); // the crate that slides no longer casts a shadow
    askAgain(workspace_.world(), answers);
    EXPECT_NE(answers.frame.visibility, visibility);
}

TEST(FewPairs, AreNamedOnceAView) {
    EXPECT_EQ(fewPairsWarning("room", kFewPairCount), "");
    EXPECT_THAT(fewPairsWarning("room", kFewPairCount - 1), HasSubstr("room: has only 999 pairs"));
    EXPECT_THROW(fewPairsWarning("room", 0), Error);
    EXPECT_THAT(darkPictureWarning("a.png", 0, {}), HasSubstr("a.png: no light reaches"));
    EXPECT_THAT(darkPictureWarning("a.png", 0, {}), HasSubstr("--lights"));
    EXPECT_THAT(darkPictureWarning("a.png", 0, {true, false}), Not(HasSubstr("--lights")));
    // An automatic camera is no remedy for itself.
    for (const bool arePlacedLights : {false, true}) {
        const std::string text = darkPictureWarning("a.png", 0, {arePlacedLights, true});
        EXPECT_THAT(text, Not(HasSubstr("--camera auto")));
        EXPECT_THAT(text, HasSubstr("--camera px,py,pz,tx,ty,tz"));
        EXPECT_THAT(text, HasSubstr(arePlacedLights ? "--seed" : "--lights 64"));
    }
    EXPECT_THAT(darkPictureWarning("a.png", 7, {}), HasSubstr("a.png: has only 7 pairs"));
    EXPECT_EQ(darkPictureWarning("a.png", kFewPairCount, {}), "");
    const Json results = Json::parse(R"({
        "cells": [{"scene": "a", "pair_count": 7}, {"scene": "a", "pair_count": 7},
                  {"scene": "b", "pair_count": 1000}],
        "rows": [{"group": "c", "frames": [{"pair_count": 0}]}]})");
    EXPECT_THAT(fewPairsWarnings(results), UnorderedElementsAre(HasSubstr("a: has only 7 pairs"),
                                                                HasSubstr("c: has no pair")));
    EXPECT_TRUE(fewPairsWarnings(Json::object()).empty());
}

} // namespace shadowdag
