// SPDX-License-Identifier: Apache-2.0
// Answers to a ray set: their files, what is refused, their score by hand, and plug-ins.
#include "tools/workspace/ray_answers.h"

#include "tests/tools/temporary_directory.h"
#include "tests/tools/workspace/complaint.h"
#include "tests/tools/workspace/ray_set_files.h"
#include "tools/workspace/tracer_plugin.h"
#include "tools/workspace/whole_file.h"

#include "scenes/scene_kind.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cfenv>
#include <functional>
#include <utility>

namespace shadowdag {
namespace {

using test::complaintOf;
using testing::HasSubstr;

TEST(RayAnswers, AreReadInBothForms) {
    const TemporaryDirectory directory;
    const RaySet set = makeSmallRaySet();
    const std::vector<NamedArray> arrays = arraysOf(makeRightAnswers(set));
    writeWholeFile(directory / "a.answers", encodeArrays(kAnswersKind, arrays));
    writeWholeFile(directory / "a.npz", encodeNpz(arrays));
    for (const char* name : {"a.answers", "a.npz"}) {
        const RayAnswers read = readAnswers(directory / name, set);
        EXPECT_EQ(read.tracer, "right");
        EXPECT_EQ(read.visibility, (std::vector<float>{0, 1, 1, 1}));
        EXPECT_EQ(read.timeMs, (std::vector<double>{2.0, 1.0, 3.0}));
        EXPECT_EQ(read.buildMs, 0.5);
    }
}

// The scenes' readers know these files without the headers of tools/.
TEST(RayAnswers, ReadersOfScenesKnowTheFilesByTheirBeginning) {
    for (const auto& [begin, name] :
         {std::pair(kRaySetKind, "a set of rays"), std::pair(kAnswersKind, "a tracer's answers")}) {
        const std::string file = encodeArrays(begin, {});
        const auto kind = otherKindOf("unnamed", {file.begin(), file.end()});
        ASSERT_TRUE(kind) << name;
        EXPECT_THAT(kind->name, HasSubstr(name));
    }
}

TEST(RayAnswers, WhatIsWrongWithThemIsSaid) {
    const RaySet set = makeSmallRaySet();
    const auto complaintAbout = [&](const std::function<void(RayAnswers&)>& change) {
        RayAnswers answers = makeRightAnswers(set);
        change(answers);
        return complaintOf([&] {
            const RayAnswers read = answersOf(arraysOf(answers), "a.npz");
            requireAnswersTo(set, set.id(), read, "a.npz");
        });
    };
    EXPECT_EQ(complaintAbout([](RayAnswers&) {}), "nothing was refused");
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.visibility[2] = 1.5f; }),
                HasSubstr("a.npz: array \"visibility\", row 2: is not within 0 and 1"));
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.visibility.push_back(1); }),
                HasSubstr("has answers to 5 pairs; the set has 4"));
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.setId[0] ^= 1; }),
                HasSubstr("not this one, which is " + set.id()));
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.timeMs[1] = -1; }),
                HasSubstr("array \"time_ms\", row 1: is no time in milliseconds"));
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.tracer = ""; }),
                HasSubstr("array \"name\" must be the tracer's name"));
    EXPECT_THAT(complaintAbout([](RayAnswers& a) { a.tracer = "a\nb"; }),
                HasSubstr("array \"name\" must be the tracer's name"));
    const auto withArrays = [&](const std::function<void(std::vector<NamedArray>&)>& change) {
        std::vector<NamedArray> arrays = arraysOf(makeRightAnswers(set));
        change(arrays);
        return complaintOf([&] { answersOf(arrays, "a.npz"); });
    };
    EXPECT_THAT(withArrays([](auto& arrays) { arrays.erase(arrays.begin() + 2); }),
                HasSubstr("has neither an array \"lit\" nor \"visibility\""));
    const uint8_t bits[] = {0, 1, 2, 1};
    EXPECT_THAT(
        withArrays([&](auto& arrays) { arrays[2] = makeArray("lit", ArrayType::kUint8, bits, 4); }),
        HasSubstr("array \"lit\", row 2: is neither 0 nor 1; write the file again, as "));
    EXPECT_THAT(withArrays([&](auto& arrays) {
                    arrays.push_back(makeArray("lit", ArrayType::kUint8, bits, 4));
                }),
                HasSubstr("has both arrays \"lit\" and \"visibility\""));
}

TEST(RayAnswers, TheScoreIsTheOneComputedByHand) {
    const RaySet set = makeSmallRaySet();
    const RaySetTruth truth = judgeRaySet(set);
    EXPECT_EQ(truth.lit, (std::vector<uint8_t>{0, 1, 1, 1}));
    EXPECT_THAT(truth.verdicts,
                testing::ElementsAre(Verdict::kDark, Verdict::kLit, Verdict::kLit, Verdict::kLit));
    Json row = scoreRow(set, truth, makeRightAnswers(set));
    EXPECT_EQ(row["false_shadow_count"], 0);
    EXPECT_EQ(row["false_light_count"], 0);
    EXPECT_EQ(row["proven_count"], 4);
    EXPECT_EQ(row["proven_wrong_count"], 0);
    EXPECT_EQ(row["mean_abs_visibility_error"], 0.0);
    EXPECT_EQ(row["time_ms"], 2.0);
    EXPECT_EQ(row["ns_per_pair"], 2.0 * 1e6 / 4);
    EXPECT_EQ(row["scene"], "small");
    RayAnswers wrong = makeRightAnswers(set);
    wrong.visibility = {1.0f, 0.25f, 0.75f, 1.0f};
    wrong.timeMs.clear();
    row = scoreRow(set, truth, wrong);
    EXPECT_EQ(row["false_light_count"], 1);
    EXPECT_EQ(row["false_shadow_count"], 1);
    EXPECT_EQ(row["proven_wrong_count"], 2);
    EXPECT_EQ(row["mean_abs_visibility_error"], 0.5); // (1 + 0.75 + 0.25) / 4
    EXPECT_FALSE(row.contains("time_ms"));
}

void expectAnswersOf(const char* library, const char* name) {
    RaySet set = makeSmallRaySet();
    set.masks = {}; // plug-ins do not see masks, so the third square blocks
    const TracerPlugin plugin(library);
    EXPECT_EQ(plugin.name(), name);
    const RayAnswers answers = plugin.answer(set, 3);
    EXPECT_EQ(answers.visibility, (std::vector<float>{0, 1, 1, 0}));
    EXPECT_EQ(answers.timeMs.size(), 3u);
    EXPECT_GE(answers.buildMs, 0.0);
    EXPECT_EQ(answers.setId, set.id());
}

TEST(TracerPlugin, EmbreesExampleAnswersTheSet) {
    expectAnswersOf(SDAG_EMBREE_TRACER, "Embree, robust");
}

TEST(TracerPlugin, BulletsExampleAnswersTheSet) {
#if defined(SDAG_BULLET_TRACER)
    expectAnswersOf(SDAG_BULLET_TRACER, "Bullet");
#else
    GTEST_SKIP() << "built without Bullet (libbullet-dev)";
#endif
}

TEST(TracerPlugin, LibrariesThatAreNoTracersAreRefused) {
    const TemporaryDirectory directory;
    EXPECT_THAT(complaintOf([] { TracerPlugin("nowhere.so"); }),
                HasSubstr("--tracer nowhere.so: cannot be opened: No such file"));
    const std::string text = directory / "text.so";
    writeWholeFile(text, "no library");
    EXPECT_THAT(complaintOf([&] { const TracerPlugin plugin(text); }),
                HasSubstr("text.so: cannot be loaded: "));
    const RaySet set = makeSmallRaySet();
    const auto refusal = [&](const char* fault) {
        setenv("SDAG_BAD_TRACER", fault, 1);
        const std::string said = complaintOf([&] {
            const TracerPlugin plugin(SDAG_BAD_TRACER_LIBRARY);
            static_cast<void>(plugin.answer(set, 2));
        });
        unsetenv("SDAG_BAD_TRACER");
        return said;
    };
    EXPECT_EQ(refusal(""), "nothing was refused");
    EXPECT_THAT(refusal("null"), HasSubstr("shadowdag_tracer returns null; build a plug-in as "));
    EXPECT_THAT(refusal("version"), HasSubstr("is of version 99 of the interface"));
    EXPECT_THAT(refusal("table"), HasSubstr("its table lacks name, build, occluded or destroy"));
    EXPECT_THAT(refusal("name"), HasSubstr("its name must have 1 to 64 bytes"));
    EXPECT_THAT(refusal("build"), HasSubstr("cannot build over 6 triangles: no room"));
    EXPECT_THAT(refusal("occluded"), HasSubstr("cannot answer 4 pairs: it gives no reason"));
    EXPECT_THAT(refusal("unanswered"), HasSubstr("leaves pair 3 without an answer of 0 or 1"));
    EXPECT_THAT(refusal("changing"), HasSubstr("answers differ between repetitions"));
    EXPECT_THAT(refusal("throwing"), HasSubstr("throws an exception: out of cells"));
    EXPECT_EQ(refusal("rounding"), "nothing was refused");
    EXPECT_EQ(std::fegetround(), FE_TONEAREST);
    EXPECT_THAT(refusal("writing"), HasSubstr("changes the triangles or segments"));
}

} // namespace
} // namespace shadowdag
