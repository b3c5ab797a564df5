// SPDX-License-Identifier: Apache-2.0
// The verdict of a compare on made-up rows.
#include "tools/report/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Returns a row of 100 000 pairs whose time varies by 2 ms.
Json row(const std::string& label, double timeMs, int wrongCount) {
    return {{"scene", "s"},
            {"frame", 0},
            {"model", ""},
            {"label", label},
            {"time_ms", timeMs},
            {"time_ms_min", timeMs - 1},
            {"time_ms_max", timeMs + 1},
            {"repeat_count", 5},
            {"pair_count", 100000},
            {"false_shadow_count", wrongCount},
            {"false_light_count", 0}};
}

Json verdict(const std::vector<Json>& rows) {
    return verdictOf({{"provenance", {{"backend", "cpu"}, {"thread_count", 2}, {"cpu", "C"}}},
                      {"experiment", {{"size", "64x36"}}},
                      {"runs", rows}});
}

Json with(Json row, const std::string& key, const Json& value) {
    row[key] = value;
    return row;
}

} // namespace

TEST(Verdict, NamesTheFastestWithinTheBoundThenTheSecond) {
    const Json found = verdict({row("slow", 90, 0), row("fast", 20, 400), row("wrong", 5, 1001)});
    EXPECT_EQ(found["scenes"][0]["use"], "fast");
    EXPECT_EQ(found["scenes"][0]["second"], "slow");
    EXPECT_EQ(
        found["text"],
        "s at 64x36, backend cpu, 2 threads of C: use fast, 20.0 ms (19.0 to 21.0), 0.40 % of "
        "the pairs wrong. Second: slow, 90.0 ms (89.0 to 91.0), no pair wrong. Not trusted: "
        "more than 1.00 % of the pairs are wrong: wrong (1.00 %).");
}

TEST(Verdict, OfTimesThatDifferByLessThanTheirSpreadTheLeastWrongIsTaken) {
    EXPECT_EQ(verdict({row("a", 20, 400), row("b", 20.9, 100)})["scenes"][0]["use"], "b");
    EXPECT_EQ(verdict({row("a", 20, 400), row("b", 21.1, 100)})["scenes"][0]["use"], "a");
}

TEST(Verdict, RoundsInWhichBothWereTimedDecide) {
    // Both vary by half, together: a busy machine. One takes 0.85 of the other's time in each
    // round.
    Json exact = row("exact", 85, 0), embree = row("embree", 100, 50);
    const std::vector<double> busy{1.0, 1.3, 0.9, 1.4, 1.0, 1.0, 0.9, 1.1};
    for (Json* of : {&exact, &embree}) {
        const double timeMs = (*of)["time_ms"];
        for (const double factor : busy)
            (*of)["round_times_ms"].push_back(factor * timeMs);
        (*of)["time_ms_min"] = 0.9 * timeMs;
        (*of)["time_ms_max"] = 1.4 * timeMs;
        (*of)["time_ms_low"] = 0.95 * timeMs;
        (*of)["time_ms_high"] = 1.1 * timeMs;
    }
    EXPECT_EQ(verdict({embree, exact})["scenes"][0]["use"], "exact");
    // A variant that is surely faster, but by less than a user notices, does not win by that.
    Json tie = embree;
    tie["label"] = "tie";
    tie["time_ms"] = 84;
    for (size_t i = 0; i < busy.size(); ++i)
        tie["round_times_ms"][i] = 84 * busy[i];
    EXPECT_EQ(verdict({tie, exact})["scenes"][0]["use"], "exact");
    // Too few rounds to be sure: the spread decides, and the faster one has more wrong pairs.
    for (Json* of : {&exact, &embree})
        (*of)["round_times_ms"] = std::vector<double>{50, 60};
    exact["false_shadow_count"] = 100;
    EXPECT_EQ(verdict({embree, exact})["scenes"][0]["use"], "exact");
}

TEST(Verdict, AWarmFrameNamesTheTimeOfTheFirst) {
    const Json found = verdict({row("maps warm pool 64M", 20, 0), row("maps pool 64M", 90, 0)});
    EXPECT_THAT(found["text"].get<std::string>(),
                HasSubstr("no pair wrong (a later frame of the same view; the first takes 90.0 "
                          "ms). Second: maps pool 64M"));
}

TEST(Verdict, FramesOfAVariantAreOneVariant) {
    Json other = row("a", 40, 2000);
    other["frame"] = 1;
    const Json found = verdict({row("a", 20, 0), other});
    EXPECT_THAT(found["text"].get<std::string>(),
                HasSubstr("use a, 30.0 ms (29.0 to 31.0, mean of 2 frames), 1.00 %"));
}

TEST(Verdict, RowsWhoseNumbersAreNotTrustedAreNamedWithTheReason) {
    const Json found = verdict({row("a", 50, 0), with(row("full", 10, 0), "degrade_divisor", 2.0),
                                with(row("shaky", 45, 0), "time_ms_max", 58),
                                with(row("hybrid oracle", 60, 0), "model", "oracle")});
    EXPECT_EQ(found["scenes"][0]["use"], "a");
    EXPECT_EQ(found["scenes"][0]["second"], Json());
    EXPECT_THAT(
        found["text"].get<std::string>(),
        AllOf(HasSubstr("the page pool was full, so that maps are coarser than requested: full"),
              HasSubstr("the time varies by more than 25.00 % of its median: shaky (31.11 %)"),
              HasSubstr("hybrid measured routes (slower than a, so its costs do not predict")));
}

// The oracle is the fastest row, or it is not called so: in the text, in tables and in charts.
TEST(Verdict, AnOracleThatIsNotTheFastestIsCalledMeasuredRoutes) {
    const auto oracle = [](double timeMs, uint64_t wrongCount) {
        return with(row("hybrid oracle believe none", timeMs, wrongCount), "model", "oracle");
    };
    const auto warm = [](Json of) {
        return with(std::move(of), "parameters", {{"start", "warm"}});
    };
    const auto shown = [](const std::vector<Json>& rows) {
        Json results = {{"runs", rows}};
        nameMeasuredRoutes(results);
        EXPECT_FALSE(results["runs"][0].contains("shown_as"));
        EXPECT_EQ(results["runs"][1]["label"], rows[1]["label"]) << "which identifies the row";
        return results["runs"][1].value("/shown_as/label"_json_pointer, "");
    };
    const std::string name = "hybrid measured routes believe none";
    EXPECT_EQ(shown({row("a", 50, 5), oracle(60, 5)}), name);
    EXPECT_EQ(shown({row("a", 50, 6), oracle(60, 5)}), "") << "more wrong pairs";
    EXPECT_EQ(shown({row("a", 60, 5), oracle(50, 5)}), "") << "the fastest";
    EXPECT_EQ(shown({row("a", 59.5, 5), oracle(60, 5)}), "") << "within the spread";
    EXPECT_EQ(shown({warm(row("a", 20, 5)), oracle(60, 5)}), "") << "its maps were drawn before";
    EXPECT_EQ(shown({warm(row("a", 20, 5)), warm(oracle(60, 5))}), name);
    EXPECT_EQ(shown({row("a", 50, 5), warm(oracle(60, 5))}), name) << "and it has to draw them";
    const Json found = verdict({row("a", 50, 0), oracle(60, 0)});
    EXPECT_THAT(found["text"].get<std::string>(),
                HasSubstr(name + " (slower than a, so its costs"));
    EXPECT_THAT(found["text"].get<std::string>(), Not(HasSubstr("oracle")));
    EXPECT_EQ(found["scenes"][0]["not_trusted"][0]["label"], "hybrid oracle believe none");
}

// The oracle's costs are measured over maps that its frame may not draw.
TEST(Verdict, APoolThatWasFullOnlyForMeasuringCostsMakesNoMapCoarse) {
    const Json found =
        verdict({row("a", 50, 0), with(row("b", 10, 0), "costs_degrade_divisor", 1.41)});
    EXPECT_EQ(found["scenes"][0]["use"], "b");
}

// Even its slowest run is faster than the others': by how much is uncertain, that it is not.
TEST(Verdict, ATimeThatVariesIsTrustedWhereEveryRunIsFasterThanTheOthers) {
    const Json fast = with(row("shaky", 11, 0), "time_ms_max", 15);
    const Json found = verdict({row("a", 50, 20), fast, with(row("b", 45, 0), "time_ms_max", 58)});
    EXPECT_EQ(found["scenes"][0]["use"], "shaky");
    EXPECT_EQ(found["scenes"][0]["second"], "a");
    EXPECT_THAT(
        found["text"].get<std::string>(),
        AllOf(HasSubstr("use shaky, 11.0 ms (10.0 to 15.0), no pair wrong"),
              HasSubstr("the time varies by more than 25.00 % of its median: b (31.11 %)"),
              HasSubstr("Caution: the time of shaky varies by 45.45 % of its median, but")));
}

TEST(Verdict, ACautionAppliesToAllRows) {
    const std::string fine = verdict({row("a", 50, 0)})["text"];
    EXPECT_THAT(fine, Not(HasSubstr("Caution")));
    const std::string text =
        verdict({with(with(with(row("a", 50, 0), "pair_count", 999), "repeat_count", 1),
                      "other_cpu_share", 0.4)})["text"];
    EXPECT_THAT(text,
                AllOf(HasSubstr("use a"), HasSubstr("Caution: s: has only 999 pairs"),
                      HasSubstr("times were measured once"),
                      HasSubstr("other processes took 40 % of the cores that this run uses")));
    const std::string shaky = verdict({with(row("a", 50, 0), "time_ms_max", 90)})["text"];
    EXPECT_THAT(shaky, AllOf(HasSubstr("use a"), HasSubstr("Caution: every time varies")));
}

TEST(Verdict, WithoutAnAccurateVariantTheLeastWrongIsNamed) {
    const Json found = verdict({row("a", 50, 5000), row("b", 60, 4000)});
    EXPECT_EQ(found["scenes"][0]["use"], Json());
    EXPECT_THAT(found["text"].get<std::string>(),
                HasSubstr("no variant can be recommended. The least wrong is b"));
}

} // namespace shadowdag
