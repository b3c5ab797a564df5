// SPDX-License-Identifier: Apache-2.0
// The difference of two results: the committed ones against themselves, and planted changes.
#include "tools/report/results_diff.h"

#include "cuda/error.h"
#include "tests/tools/report/report_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const std::string kResults = SDAG_SOURCE_DIR "/tests/bench/results/";

Json committed(const std::string& name) {
    return Json::parse(readText(kResults + name));
}

Json diffOf(const Json& a, const Json& b, const DiffOptions& options = {}) {
    return diffResults("a.json", a, "b.json", b, options);
}

std::string refusalOf(const Json& a, const Json& b, const DiffOptions& options = {}) {
    try {
        diffOf(a, b, options);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

/// Returns results with one run of a time.
Json timed(const Json& times) {
    Json run = {{"scene", "s"}, {"frame", 0}, {"label", "maps"}, {"method", "maps"}};
    run.update(times);
    return {{"provenance", {{"cpu", "c"}, {"commit", "1"}}},
            {"experiment", {{"size", "1x1"}, {"title", "t"}}},
            {"scenes", {{{"scene", "s"}, {"scene_hash", "h"}}}},
            {"runs", Json::array({run})},
            {"map_costs", Json::array()}};
}

TEST(ResultsDiff, EveryCommittedResultEqualsItself) {
    size_t comparedCount = 0;
    for (const auto& entry : std::filesystem::directory_iterator(kResults)) {
        const std::string name = entry.path().filename();
        SCOPED_TRACE(name);
        const Json results = committed(name);
        const Json diff = diffOf(results, results);
        EXPECT_THAT(diff["changes"], IsEmpty());
        EXPECT_THAT(diff["only_in_a"], IsEmpty());
        EXPECT_THAT(diff["only_in_b"], IsEmpty());
        EXPECT_THAT(diff["differences"], IsEmpty());
        EXPECT_GT(diff["value_count"], 10);
        ++comparedCount;
    }
    EXPECT_GE(comparedCount, 65u);
}

/// Returns the changes of a result after a change of one of its values.
Json changesAfter(const Json& results, const std::string& pointer, const Json& value) {
    Json changed = results;
    changed[Json::json_pointer(pointer)] = value;
    return diffOf(results, changed)["changes"];
}

TEST(ResultsDiff, PlantedCountsAreFoundExactly) {
    const Json atrium = committed("compare-atrium.json");
    const Json changes = changesAfter(atrium, "/runs/1/false_shadow_count",
                                      atrium["runs"][1]["false_shadow_count"].get<uint64_t>() + 1);
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0]["verdict"], "worse");
    EXPECT_EQ(changes[0]["key"], "false_shadow_count");
    EXPECT_EQ(changes[0]["row"], "builtin:atrium, frame 0, " +
                                     atrium["runs"][1]["label"].get<std::string>() + ", " +
                                     atrium["runs"][1]["method"].get<std::string>());
    const auto verdictOf = [&](const std::string& pointer, const Json& value) {
        const Json found = changesAfter(atrium, pointer, value);
        return found.size() == 1 ? found[0]["verdict"].get<std::string>() : "none";
    };
    EXPECT_EQ(verdictOf("/runs/1/false_shadow_count", 0), "better");
    EXPECT_EQ(verdictOf("/runs/1/page_count", 1), "changed");
    EXPECT_EQ(verdictOf("/runs/1/map_bytes", uint64_t(1) << 40), "worse");
    const double error = atrium["runs"][1]["mean_abs_visibility_error"];
    EXPECT_EQ(verdictOf("/runs/1/mean_abs_visibility_error", error * (1 + 1e-12)), "none");
    EXPECT_EQ(verdictOf("/runs/1/shown_as", {{"label", "x"}}), "none") << "a name for reading";
    EXPECT_EQ(verdictOf("/runs/1/mean_abs_visibility_error", error * 1.001), "worse");
}

TEST(ResultsDiff, ErrorsOfOtherNumbersOfPairsAreComparedByShare) {
    const auto verdictAfter = [](uint64_t pairs, uint64_t wrong) {
        const auto row = [](uint64_t pairCount, uint64_t falseCount) {
            return timed({{"pair_count", pairCount}, {"false_light_count", falseCount}});
        };
        const Json diff = diffOf(row(1000, 10), row(pairs, wrong));
        for (const Json& change : diff["changes"])
            if (change["key"] == "false_light_count")
                return change["verdict"].get<std::string>();
        return std::string("none");
    };
    EXPECT_EQ(verdictAfter(1000, 11), "worse");
    EXPECT_EQ(verdictAfter(2000, 11), "better");
    EXPECT_EQ(verdictAfter(2000, 20), "changed") << "the same share";
    EXPECT_EQ(verdictAfter(500, 9), "worse");
    EXPECT_EQ(verdictAfter(500, 10), "worse") << "as many of fewer pairs";
    EXPECT_EQ(verdictAfter(3000, 0), "better");
}

TEST(ResultsDiff, ARowWithoutPairsIsWorseAndAPartIsRefused) {
    const Json some = timed({{"pair_count", 9}, {"false_light_count", 4}}),
               none = timed({{"pair_count", 0}, {"false_light_count", 0}});
    const Json diff = diffOf(some, none);
    EXPECT_EQ(diff["worse_count"], 1);
    EXPECT_EQ(diff["better_count"], 0);
    Json part = some;
    part["part_count"] = 2;
    EXPECT_THAT(refusalOf(some, part), HasSubstr("b.json: is a part of a compare"));
}

TEST(ResultsDiff, AShareOfOthersThatIsNotKnownIsTaken) {
    const Json unknown = timed({{"other_cpu_share", nullptr}, {"pair_count", 9}}),
               known = timed({{"other_cpu_share", 0.1}, {"pair_count", 9}});
    EXPECT_EQ(refusalOf(unknown, known), "");
    EXPECT_EQ(diffOf(known, unknown)["lost_value_count"], 0);
}

TEST(ResultsDiff, MoreWrongOrDarkPairsThanPairsAreRefused) {
    const Json possible = timed({{"pair_count", 9},
                                 {"false_light_count", 4},
                                 {"false_shadow_count", 5},
                                 {"occluded_count", 9}});
    EXPECT_EQ(refusalOf(possible, possible), "");
    Json wrong = possible, dark = possible;
    wrong["runs"][0]["false_light_count"] = 5;
    dark["runs"][0]["occluded_count"] = 10;
    EXPECT_THAT(refusalOf(possible, wrong), HasSubstr("10 of 9 pairs are wrong"));
    EXPECT_THAT(refusalOf(dark, possible), HasSubstr("10 of 9 pairs are dark"));
}

TEST(ResultsDiff, ScenesInAnotherOrderAreTheSame) {
    Json a = timed({{"pair_count", 9}}), b = a;
    a["experiment"]["scenes"] = {"s", "t"};
    b["experiment"]["scenes"] = {"t", "s"};
    EXPECT_EQ(refusalOf(a, b), "");
    b["experiment"]["scenes"] = {"t", "u"};
    EXPECT_THAT(refusalOf(a, b), HasSubstr("different experiments: scenes"));
}

TEST(ResultsDiff, SpellingsOfOneExperimentAreTheSame) {
    Json a = timed({{"pair_count", 9}}), b = a;
    const auto refusalOfFrames = [&](const char* before, const char* now) {
        a["experiment"]["frames"] = before;
        b["experiment"]["frames"] = now;
        return refusalOf(a, b);
    };
    EXPECT_EQ(refusalOfFrames("0", "0:0"), "");
    EXPECT_EQ(refusalOfFrames("30,0,60", "0:60:30"), "");
    EXPECT_EQ(refusalOfFrames("0:1,5", "0,1,5"), "");
    EXPECT_EQ(refusalOfFrames("no frames", "no frames"), "") << "of an edited file";
    EXPECT_THAT(refusalOfFrames("0:0", "0:1"), HasSubstr("frames was \"0\" and is \"0:1\""));
    EXPECT_THAT(refusalOfFrames("0:9:3", "0,3,8"),
                HasSubstr("frames was \"0:9:3\" and is \"0,3,8\""));
    EXPECT_THAT(refusalOfFrames("0", "no frames"), HasSubstr("is \"no frames\""));
    b["experiment"]["frames"] = a["experiment"]["frames"];
    a["experiment"]["methods"] = {"dag", "maps"};
    b["experiment"]["methods"] = {"maps", "dag"};
    EXPECT_EQ(refusalOf(a, b), "");
    b["experiment"]["methods"] = {"maps"};
    EXPECT_THAT(refusalOf(a, b), HasSubstr("methods was"));
}

TEST(ResultsDiff, AllDifferencesOfExperimentsAreNamed) {
    Json a = timed({{"pair_count", 9}}), b = a;
    b["experiment"]["size"] = "2x2";
    b["experiment"]["seed"] = 7;
    EXPECT_THAT(refusalOf(a, b), testing::AllOf(HasSubstr("size was \"1x1\" and is \"2x2\""),
                                                HasSubstr("seed was ")));
}

TEST(ResultsDiff, FailuresOfStudiesAreWorse) {
    const Json stability = committed("stability.json");
    const Json changes = changesAfter(stability, "/checks/3/holds", false);
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0]["verdict"], "worse");
    Json mutants = committed("mutants.json");
    for (size_t i = 0; i < mutants["mutants"].size(); ++i)
        if (!mutants["mutants"][i]["notices"].empty()) {
            const Json lost =
                changesAfter(mutants, "/mutants/" + std::to_string(i) + "/notices", Json::array());
            ASSERT_EQ(lost.size(), 1u);
            EXPECT_EQ(lost[0]["key"], "noticed by");
            EXPECT_EQ(lost[0]["verdict"], "worse");
            break;
        }
}

TEST(ResultsDiff, AFaultThatOneCheckNoticesNoMoreIsWorse) {
    const Json mutants = committed("mutants.json");
    size_t most = 0;
    for (size_t i = 0; i < mutants["mutants"].size(); ++i)
        if (mutants["mutants"][i]["notices"].size() > mutants["mutants"][most]["notices"].size())
            most = i;
    const std::string pointer = "/mutants/" + std::to_string(most) + "/notices";
    const Json& all = mutants[Json::json_pointer(pointer)];
    ASSERT_GE(all.size(), 12u);
    const Json lost = changesAfter(mutants, pointer, Json::array({all[0]}));
    ASSERT_EQ(lost.size(), 1u);
    EXPECT_EQ(lost[0]["verdict"], "worse");
    EXPECT_EQ(lost[0]["b"], 1);
    EXPECT_EQ(lost[0]["lost"].size(), lost[0]["a"].get<size_t>() - 1);
    Json fewer = all;
    fewer.erase(3);
    Json changed = mutants;
    changed[Json::json_pointer(pointer)] = fewer;
    const Json diff = diffOf(mutants, changed);
    EXPECT_EQ(diff["worse_count"], 1);
    EXPECT_THAT(diffText(diff), HasSubstr("; lost: " + all[3]["check"].get<std::string>()));
    EXPECT_EQ(diffOf(changed, mutants)["better_count"], 1);
    EXPECT_EQ(diffOf(changed, mutants)["worse_count"], 0);
    // What is noticed where no fault was planted is none the better for it.
    for (size_t i = 0; i < mutants["mutants"].size(); ++i)
        if (mutants["mutants"][i]["name"] == "none") {
            const Json alarm =
                changesAfter(mutants, "/mutants/" + std::to_string(i) + "/notices", all);
            ASSERT_EQ(alarm.size(), 1u);
            EXPECT_EQ(alarm[0]["verdict"], "worse");
        }
    changed[Json::json_pointer(pointer)] = Json::array({7});
    EXPECT_THAT(refusalOf(mutants, changed), HasSubstr("\"notices\" holds 7"));
}

/// A change of one value of a committed result, and its verdict.
struct PlantedChange {
    const char *file, *pointer;
    double by;
    const char* verdict;
};

TEST(ResultsDiff, PlantedChangesOfEveryKindAreFound) {
    constexpr PlantedChange kChanges[] = {
        {"tracers-atrium.json", "/runs/0/proven_wrong_count", 1, "worse"},
        {"tracers-atrium.json", "/runs/0/false_light_count", -1, "better"},
        {"validate-atrium-maps.json", "/self_checks/hidden_sample_count", 500, "worse"},
        {"validate-atrium-maps.json", "/self_checks/misplaced_sample_count", 1, "worse"},
        {"validate-atrium-maps.json", "/self_checks/coarser_map_count", 1, "worse"},
        {"validate-atrium-maps.json", "/self_checks/coarser_cell_count", 1, "worse"},
        {"validate-atrium-maps.json", "/self_checks/beyond_belief_count", 1, "worse"},
        {"regret.json", "/scenes/1/frames/0/cost_drawn_map_count", 1, "changed"},
        {"calibration.json", "/frames/3/map_count", 1, "changed"},
        {"gpu.json", "/rays/0/nanovdb_difference_count", 1, "worse"},
        {"gpu.json", "/frames/0/pair_count", 1, "changed"},
        {"gpu_profiles.json", "/profiles/0/kernels/0/launches", 1, "changed"},
        {"filters.json", "/filters/4/false_shadow_count", 1, "worse"},
        {"filters.json", "/acne/9/dark_count", 1, "changed"},
        {"layouts.json", "/traced/5/traced_bytes", 1, "worse"},
        {"determinism.json", "/rows/6/hash", 0, "changed"},
        {"faults.json", "/Faults.AFailedCallLosesNothing~1compare/failed_count", 1, "worse"},
        {"fuzzing.json", "/camera/ended_count", 1, "worse"},
        {"bench-raster-atrium.json", "/checks/differing_count", 1, "worse"},
        {"bench-voxel-atrium-4096.json", "/frame/exact_wrong_count", 1, "worse"},
        {"bench-voxel-atrium-4096.json", "/frame/methods/1/disagreement_count", 1, "worse"}};
    for (const PlantedChange& planted : kChanges) {
        SCOPED_TRACE(std::string(planted.file) + planted.pointer);
        const Json results = committed(planted.file);
        const Json& before = results[Json::json_pointer(planted.pointer)];
        const Json changes = before.is_string()
                                 ? changesAfter(results, planted.pointer, "another")
                                 : changesAfter(results, planted.pointer,
                                                before.get<int64_t>() + int64_t(planted.by));
        ASSERT_EQ(changes.size(), 1u);
        EXPECT_EQ(changes[0]["verdict"], planted.verdict);
    }
}

TEST(ResultsDiff, RegretsChangeBeyondTheirIntervals) {
    const Json regret = committed("regret.json");
    Json worse = regret;
    Json& frame = worse["scenes"][0]["frames"][0];
    frame["regret"]["cost"] = 7;
    frame["regret_intervals"]["cost"] = {6, 8};
    EXPECT_EQ(diffOf(regret, worse)["worse_count"], 1);
    frame["regret"]["cost"] = 0.1;
    frame["regret_intervals"]["cost"] = {-0.04, 0.2};
    EXPECT_THAT(diffOf(regret, worse)["changes"], IsEmpty()) << "the intervals overlap";
    frame["regret"]["cost"] = "much";
    EXPECT_THAT(refusalOf(regret, worse), HasSubstr("the regret of 'cost' is \"much\""));
}

Json measured(double time, double low, double high, double confidence) {
    return timed({{"time_ms", time},
                  {"time_ms_low", low},
                  {"time_ms_high", high},
                  {"time_ms_confidence", confidence}});
}

TEST(ResultsDiff, TimesChangeBeyondTheirIntervals) {
    const Json base = measured(10, 9, 11, 0.97);
    const auto verdictOf = [&](const Json& other) {
        const Json changes = diffOf(base, other)["changes"];
        return changes.empty() ? std::string("none") : changes[0]["verdict"].get<std::string>();
    };
    EXPECT_EQ(verdictOf(measured(12, 11, 13, 0.97)), "none") << "they touch";
    EXPECT_EQ(verdictOf(measured(12, 11.1, 13, 0.97)), "worse");
    EXPECT_EQ(verdictOf(measured(8, 7, 8.9, 0.97)), "better");
    EXPECT_EQ(verdictOf(measured(12, 11.1, 13, 0.94)), "uncertain") << "five repeats";
    // Older results: the least and the greatest of n.
    const auto older = [](double time, int repeats) {
        return timed({{"time_ms", time},
                      {"time_ms_min", time - 1},
                      {"time_ms_max", time + 1},
                      {"repeat_count", repeats}});
    };
    EXPECT_EQ(verdictOf(older(20, 6)), "worse");
    EXPECT_EQ(verdictOf(older(20, 5)), "uncertain");
    EXPECT_EQ(verdictOf(older(20, 1)), "uncertain");
}

TEST(ResultsDiff, TimesOfStagesHaveNoSpreadAndAreLeftOut) {
    EXPECT_THAT(changesAfter(committed("compare-atrium.json"), "/runs/1/stages_ms/shading", 1e6),
                IsEmpty());
}

TEST(ResultsDiff, RowsOfOneAloneAreListed) {
    const Json atrium = committed("compare-atrium.json");
    Json shorter = atrium;
    shorter["runs"].erase(2);
    const Json lost = diffOf(atrium, shorter), added = diffOf(shorter, atrium);
    ASSERT_EQ(lost["only_in_a"].size(), 1u);
    EXPECT_EQ(lost["lost_row_count"], 1);
    EXPECT_THAT(diffText(lost), HasSubstr("only in a.json: runs, builtin:atrium, frame 0, " +
                                          atrium["runs"][2]["label"].get<std::string>()));
    EXPECT_EQ(added["only_in_b"].size(), 1u);
    EXPECT_EQ(added["lost_row_count"], 0);
    DiffOptions any;
    any.allowsExperiment = true;
    EXPECT_EQ(diffOf(atrium, shorter, any)["lost_row_count"], 0);
}

TEST(ResultsDiff, ValuesThatTheSecondLacksAreListed) {
    const Json atrium = committed("compare-atrium.json");
    Json lesser = atrium;
    for (Json& run : lesser["runs"]) {
        run.erase("flip");
        run.erase("time_ms");
    }
    const Json lost = diffOf(atrium, lesser), added = diffOf(lesser, atrium);
    EXPECT_EQ(lost["lost_value_count"], 2 * atrium["runs"].size());
    EXPECT_EQ(lost["lost_row_count"], 0);
    EXPECT_THAT(diffText(lost), HasSubstr("only in a.json: runs, builtin:atrium, frame 0, " +
                                          atrium["runs"][0]["label"].get<std::string>()));
    EXPECT_THAT(diffText(lost), HasSubstr(": flip\n"));
    EXPECT_EQ(added["lost_value_count"], 0);
    DiffOptions any;
    any.allowsExperiment = true;
    EXPECT_EQ(diffOf(atrium, lesser, any)["lost_value_count"], 0);
}

TEST(ResultsDiff, ValuesOfAnotherTypeOrRangeAreRefusedWithTheirPlace) {
    const Json atrium = committed("compare-atrium.json");
    const std::string place = "b.json: \"runs\", row 'builtin:atrium, frame 0, ";
    const auto refusalAfter = [&](const std::string& pointer, const Json& value) {
        Json changed = atrium;
        changed[Json::json_pointer(pointer)] = value;
        return refusalOf(atrium, changed);
    };
    for (const char* key : {"flip", "false_shadow_count", "time_ms", "map_bytes", "time_ms_high"})
        for (const Json& value : {Json(), Json("5"), Json(-5), Json(true), Json::array()}) {
            SCOPED_TRACE(key + jsonText(value));
            const std::string refusal = refusalAfter(std::string("/runs/1/") + key, value);
            EXPECT_THAT(refusal, HasSubstr(place));
            EXPECT_THAT(refusal, HasSubstr(std::string("\"") + key + "\" is " + value.dump()));
        }
    EXPECT_THAT(refusalAfter("/runs/1/time_ms", 1e9), HasSubstr("outside its interval"));
    EXPECT_THAT(refusalAfter("/runs/1/false_shadow_count", 0.5),
                HasSubstr("must be a whole number"));
    for (const char* key : {"mean_abs_visibility_error", "flip", "null_rate", "time_ms_confidence"})
        EXPECT_THAT(refusalAfter(std::string("/runs/1/") + key, 1.5), HasSubstr("at most 1"));
    EXPECT_THAT(refusalAfter("/runs/1/stages_ms/shading", "1"), HasSubstr("\"shading\" is \"1\""));
    for (const Json& value : {Json(7), Json("x"), Json::array({1}), Json()})
        EXPECT_THAT(refusalAfter("/runs/1/stages_ms", value), HasSubstr("must be an object"));
    for (const Json& value : {Json(7), Json("x"), Json::object(), Json()})
        EXPECT_THAT(refusalAfter("/runs/1/round_times_ms", value), HasSubstr("must be a list"));
    for (const Json& value : {Json("x"), Json(-5)})
        EXPECT_THAT(refusalAfter("/runs/1/round_times_ms", Json::array({value})),
                    HasSubstr("\"round_times_ms\" is " + value.dump()));
    EXPECT_THAT(refusalAfter("/runs/1/time_ms_confidence", "x"),
                HasSubstr("\"time_ms_confidence\" is \"x\""));
    for (const char* list : {"runs", "map_costs", "scenes", "sequence_runs"}) {
        EXPECT_THAT(refusalAfter(std::string("/") + list, Json::object()),
                    HasSubstr("it must be a list"));
        EXPECT_THAT(refusalAfter(std::string("/") + list, 7),
                    HasSubstr(std::string("b.json: \"") + list + "\" is 7; it must be a list"));
    }
    EXPECT_THAT(refusalAfter("/runs/1", 7), HasSubstr("\"runs\" holds 7"));
}

TEST(ResultsDiff, OtherExperimentsScenesAndMachinesAreRefusedUnlessAllowed) {
    const Json base = measured(10, 9, 11, 0.97);
    const auto with = [&](const std::string& pointer, const Json& value) {
        Json other = base;
        other[Json::json_pointer(pointer)] = value;
        return other;
    };
    const Json size = with("/experiment/size", "2x2"), scene = with("/scenes/0/scene_hash", "g"),
               machine = with("/provenance/cpu", "d");
    EXPECT_THAT(refusalOf(base, size), HasSubstr("a.json and b.json: are of different experiments: "
                                                 "size was \"1x1\" and is \"2x2\""));
    EXPECT_THAT(refusalOf(base, size), HasSubstr("--allow experiment"));
    EXPECT_THAT(refusalOf(base, scene), HasSubstr("different scenes: s has the hash"));
    const Json lit = with("/scenes/0/content_hash", "l"),
               dark = with("/scenes/0/content_hash", "d");
    EXPECT_THAT(refusalOf(lit, dark), HasSubstr("different scenes: s has the content hash"));
    EXPECT_EQ(refusalOf(base, lit), "") << "results of programs that did not write it";
    EXPECT_THAT(refusalOf(base, machine), HasSubstr("different machines: cpu was \"c\""));
    EXPECT_EQ(refusalOf(base, with("/experiment/title", "u")), "") << "a text for readers";
    EXPECT_EQ(refusalOf(base, with("/provenance/commit", "2")), "");
    DiffOptions options;
    options.allowsExperiment = options.allowsScene = options.allowsMachine = true;
    EXPECT_EQ(refusalOf(base, size, options), "");
    EXPECT_THAT(diffText(diffOf(base, machine, options)), HasSubstr("the machine differs: cpu"));
    DiffOptions counts;
    counts.comparesTimes = false;
    EXPECT_THAT(diffOf(base, with("/provenance/cpu", "d"), counts)["changes"], IsEmpty());
    EXPECT_THAT(refusalOf(base, with("/experiment/repeats", 1)),
                HasSubstr("different experiments"));
    EXPECT_EQ(refusalOf(base, with("/experiment/repeats", 1), counts), "") << "no count needs them";
    EXPECT_THAT(refusalOf(base, committed("stability.json")),
                HasSubstr("one is a result of compare, the other of study stability"));
}

TEST(ResultsDiff, ARowTwiceIsRefused) {
    Json twice = measured(10, 9, 11, 0.97);
    twice["runs"].push_back(twice["runs"][0]);
    EXPECT_THAT(refusalOf(twice, twice), HasSubstr("\"runs\" has two rows 's, frame 0, maps"));
}

} // namespace
} // namespace shadowdag
