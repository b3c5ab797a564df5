// SPDX-License-Identifier: Apache-2.0
// Frames in sequence: the order of frames, the state kept between them, the content of their rows.
#include "tools/workspace/sequence.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tests/tools/workspace/sliding_scene.h"
#include "tools/settings/variants.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Experiment smallExperiment(const std::vector<std::string>& variants) {
    Experiment e = experimentFromJson({{"size", "96x64"},
                                       {"camera", "0.5,3,7,0,0,0"},
                                       {"frames", "0:20:10"},
                                       {"fps", 5},
                                       {"sequence", true},
                                       {"variants", variants},
                                       {"repeats", 1},
                                       {"warmups", 0},
                                       {"flicker_points", 1000}},
                                      "x");
    return e;
}

Json measure(const Experiment& e, Workspace& scene) {
    const TemporaryDirectory directory;
    Journal journal(directory / "journal.json", "key", false);
    MeasureContext context;
    context.directory = directory.path();
    context.journal = &journal;
    context.frames = e.frames;
    return measureSequence(scene, e, configurations(e, {}, 0), context).sequenceRuns;
}

std::vector<double> valuesOf(const Json& rows, const std::string& label, const char* key) {
    std::vector<double> values;
    for (const Json& row : rows)
        if (row["label"] == label)
            values.push_back(row[key].get<double>());
    return values;
}

/// Returns rows without what differs from run to run.
Json withoutTimes(Json rows) {
    for (Json& row : rows)
        for (const char* key :
             {"time_ms", "time_ms_low", "time_ms_high", "time_ms_min", "time_ms_max",
              "round_times_ms", "stages_ms", "other_cpu_share", "time_over_embree",
              "time_over_embree_low", "time_over_embree_high"})
            row.erase(key);
    return rows;
}

} // namespace

TEST(Sequence, FramesAreLedInByTheirPredecessors) {
    EXPECT_THAT(sequenceSteps({10, 20}, 1),
                ElementsAre(SequenceStep{9, false}, SequenceStep{10, true}, SequenceStep{19, false},
                            SequenceStep{20, true}));
    EXPECT_THAT(sequenceSteps({5, 6, 7}, 1),
                ElementsAre(SequenceStep{4, false}, SequenceStep{5, true}, SequenceStep{6, true},
                            SequenceStep{7, true}));
    EXPECT_THAT(sequenceSteps({3, 5}, 4),
                ElementsAre(SequenceStep{0, false}, SequenceStep{1, false}, SequenceStep{2, false},
                            SequenceStep{3, true}, SequenceStep{4, false}, SequenceStep{5, true}));
    EXPECT_THAT(sequenceSteps({0, 30}, 0),
                ElementsAre(SequenceStep{0, true}, SequenceStep{30, true}));
}

TEST(Sequence, RowsHaveTheirTimeOverEmbreesInTheSameFrameAndRound) {
    Workspace scene = slidingWorkspace();
    Experiment experiment = smallExperiment({"PMCD-EB"});
    experiment.repeats = 3;
    const Json rows = measure(experiment, scene);
    ASSERT_EQ(rows.size(), 6u);
    for (size_t i = 0; i < rows.size(); i += 2) {
        ASSERT_EQ(rows[i]["method"], "embree");
        EXPECT_EQ(rows[i]["time_over_embree"], 1.0);
        const Json &embree = rows[i]["round_times_ms"], &maps = rows[i + 1]["round_times_ms"];
        std::vector<double> ratios;
        for (size_t round = 0; round < 3; ++round)
            ratios.push_back(maps[round].get<double>() / embree[round].get<double>());
        std::sort(ratios.begin(), ratios.end());
        EXPECT_DOUBLE_EQ(rows[i + 1]["time_over_embree"], ratios[1]);
        EXPECT_DOUBLE_EQ(rows[i + 1]["time_over_embree_low"], ratios[0]);
        EXPECT_DOUBLE_EQ(rows[i + 1]["time_over_embree_high"], ratios[2]);
    }
}

TEST(Sequence, FrameZeroIsLedInByItself) {
    EXPECT_THAT(sequenceSteps({0, 1}, 3),
                ElementsAre(SequenceStep{0, false}, SequenceStep{0, true}, SequenceStep{1, true}));
}

// Of frames without one before it there is no difference; Embree's frame changes as the truth does,
// and maps of few texels change otherwise.
TEST(Sequence, PicturesAreComparedByTheirChanges) {
    Workspace scene = slidingWorkspace();
    Experiment e = smallExperiment({"PMCD-u4"});
    e.leadIn = 0;
    const Json rows = measure(e, scene);
    ASSERT_EQ(rows.size(), 6u);
    for (const Json& row : rows)
        EXPECT_EQ(row.contains("frame_difference_error"), row["frame"] != 0) << row["label"];
    for (size_t i = 2; i < 6; i += 2) {
        const double embree = rows[i]["frame_difference_error"],
                     maps = rows[i + 1]["frame_difference_error"];
        EXPECT_LT(embree, 1e-3);
        EXPECT_GT(maps, 2 * embree);
        EXPECT_GT(maps, 1e-4);
    }
}

TEST(Sequence, EveryFrameAndVariantHasARowInOrder) {
    Workspace scene = slidingWorkspace();
    const Json rows = measure(smallExperiment({"CFM", "PMCD"}), scene);
    ASSERT_EQ(rows.size(), 9u); // three frames of embree and two variants
    EXPECT_EQ(rows[0]["frame"], 0);
    EXPECT_EQ(rows[8]["frame"], 20);
    EXPECT_EQ(rows[1]["label"], "CFM");
    EXPECT_EQ(rows[1]["parameters"]["variant"], "CFM");
    for (const Json& row : rows) {
        EXPECT_GT(row["time_ms"].get<double>(), 0.0);
        EXPECT_EQ(row["repeat_count"], 1);
        EXPECT_GT(row["pair_count"].get<int>(), 100);
    }
    for (const char* stage : {"batch boxes", "batch hierarchy", "scene update", "page commit",
                              "page clear", "culling query", "culling tests", "shading"})
        EXPECT_TRUE(rows[1]["stages_ms"].contains(stage)) << stage;
    EXPECT_GE(rows[1]["lighting_computation_count"].get<int>(), rows[1]["pair_count"].get<int>());
    EXPECT_EQ(rows[0]["method"], "embree");
    EXPECT_LT(rows[0]["false_shadow_count"], rows[1]["false_shadow_count"]);
}

TEST(Sequence, TheWorldMovesFromFrameToFrame) {
    Workspace scene = slidingWorkspace();
    const Json rows = measure(smallExperiment({"PMCD"}), scene);
    const std::vector<double> dark = valuesOf(rows, "embree", "occluded_count");
    EXPECT_NE(dark[0], dark[2]);
}

TEST(Sequence, MeasuringTwiceGivesTheSameCountsFromAnyTime) {
    Workspace scene = slidingWorkspace();
    const Json first = measure(smallExperiment({"PMCD", "PMCD-SO"}), scene);
    scene.setTime(0.77f);
    const Json second = measure(smallExperiment({"PMCD", "PMCD-SO"}), scene);
    EXPECT_EQ(withoutTimes(first), withoutTimes(second));
}

TEST(Sequence, StaticOptimizationDrawsLessThanItsVariantWithout) {
    Workspace scene = slidingWorkspace();
    const Json rows = measure(smallExperiment({"PMCD", "PMCD-SO"}), scene);
    const std::vector<double> all = valuesOf(rows, "PMCD", "triangle_draw_count"),
                              kept = valuesOf(rows, "PMCD-SO", "triangle_draw_count");
    for (size_t i = 0; i < all.size(); ++i)
        EXPECT_LT(kept[i], all[i]) << i;
    // The same answers: what is kept is what would be drawn.
    EXPECT_EQ(valuesOf(rows, "PMCD", "false_shadow_count"),
              valuesOf(rows, "PMCD-SO", "false_shadow_count"));
    // A still camera and a lead-in: nothing is committed anew but where the crate moves.
    EXPECT_LT(valuesOf(rows, "PMCD-SO", "pages_committed_count")[1],
              valuesOf(rows, "PMCD", "pages_committed_count")[1]);
}

TEST(Sequence, FlickerIsThatOfConsecutiveFrames) {
    Workspace scene = slidingWorkspace();
    const Json rows = measure(smallExperiment({"PMCD"}), scene);
    const std::vector<double> answers = valuesOf(rows, "PMCD", "flicker_answer_count");
    for (const double count : answers)
        EXPECT_GT(count, 500.0);
    // Frame 0 is led in by itself: nothing changes.
    EXPECT_EQ(valuesOf(rows, "PMCD", "flicker_count")[0], 0.0);
    EXPECT_EQ(valuesOf(rows, "PMCD", "flicker_truth_change_count")[0], 0.0);
    EXPECT_GT(valuesOf(rows, "PMCD", "flicker_truth_change_count")[1], 0.0);
}

TEST(Sequence, ResumesAnInterruptedRunWithTheSameResults) {
    struct Interrupted {};
    Workspace scene = slidingWorkspace();
    const Experiment e = smallExperiment({"PMCD", "PMCD-SO"});
    const Json whole = withoutTimes(measure(e, scene));
    const size_t stepCount = sequenceSteps(e.frames, e.leadIn).size();
    ASSERT_EQ(stepCount, 6u);
    for (const size_t stop : {size_t(1), size_t(2), size_t(5), stepCount, stepCount + 3}) {
        SCOPED_TRACE(stop);
        const TemporaryDirectory directory;
        MeasureContext context;
        context.directory = directory.path();
        context.frames = e.frames;
        size_t steps = 0;
        {
            Journal journal(directory / "journal.json", "key", false);
            context.journal = &journal;
            context.progress = [&](double) {
                if (++steps == stop)
                    throw Interrupted();
            };
            EXPECT_THROW(measureSequence(scene, e, configurations(e, {}, 0), context), Interrupted);
        }
        Journal journal(directory / "journal.json", "key", true);
        EXPECT_EQ(journal.takenUpCount(), std::min(stop, stepCount));
        context.journal = &journal;
        context.progress = {};
        const Json rest = measureSequence(scene, e, configurations(e, {}, 0), context).sequenceRuns;
        EXPECT_EQ(withoutTimes(rest), whole);
        // Now it is all there: nothing is rendered, so times are equal, too.
        EXPECT_EQ(measureSequence(scene, e, configurations(e, {}, 0), context).sequenceRuns, rest);
    }
}

TEST(Sequence, AModelThatNeedsCostsIsRefused) {
    Workspace scene = slidingWorkspace();
    Experiment e = smallExperiment({"PMCD"});
    e.variants = {"Hybrid:oracle"};
    try {
        measure(e, scene);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), HasSubstr("model 'oracle' needs measured costs of every frame"));
    }
}

} // namespace shadowdag
