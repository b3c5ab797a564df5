// SPDX-License-Identifier: Apache-2.0
// Calibrations as files, and the program that writes and reads them.
#include "tests/tools/program/program_refusals.h"
#include "tools/settings/setting.h"
#include "tools/workspace/cost_file.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

namespace {

using testing::HasSubstr;

constexpr const char* kSmall[] = {"--size", "64x36", "--resolution", "64", "--repeats", "1"};

std::string messageOf(const std::function<void()>& act, ErrorKind kind) {
    try {
        act();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), kind) << error.what();
        return error.what();
    }
    return "no error";
}

const char* const kCalibration =
    R"({"calibration": {"rays": [{"term": "samples", "ms": 1e-4}], "map": [{"term": "maps", "ms": 2.5}]},
        "provenance": {"cpu": "another", "backend": "cpu", "thread_count": 2, "device": null}})";

} // namespace

TEST(CalibrationFile, RoundTripsExactly) {
    const CostCalibration calibration{
        {{findCostTerm("maps"), 0.1}, {findCostTerm("samples"), 1.0 / 3}},
        {{findCostTerm("pages"), 2.5}}};
    const CostCalibration back = calibrationFromJson(toJson(calibration), "c.json");
    ASSERT_EQ(back.rays.size(), 2u);
    EXPECT_EQ(back.rays[1].term, findCostTerm("samples"));
    EXPECT_EQ(back.rays[1].ms, 1.0 / 3);
    EXPECT_EQ(back.map[0].ms, 2.5);
    EXPECT_EQ(back.counts(), uint32_t(kCountsPages));
}

TEST(CalibrationFile, DamagedOnesAreReportedWithTheError) {
    const auto message = [](const char* text) {
        return messageOf([&] { calibrationFromJson(Json::parse(text), "c.json"); },
                         ErrorKind::kInput);
    };
    EXPECT_THAT(message("{}"), AllOf(HasSubstr("c.json"), HasSubstr("is not a calibration"),
                                     Not(HasSubstr("json.exception"))));
    EXPECT_THAT(message(R"({"rays": [], "map": []})"), HasSubstr("without terms"));
    EXPECT_THAT(message(R"({"rays": [{"term": "moonlight", "ms": 1}], "map": []})"),
                AllOf(HasSubstr("unknown term 'moonlight'"), HasSubstr("samples")));
    EXPECT_THAT(message(R"({"rays": [{"term": "samples", "ms": -1}], "map": []})"),
                AllOf(HasSubstr("-1"), HasSubstr("not a cost")));
    EXPECT_THAT(message(R"({"rays": [{"term": "samples"}], "map": []})"),
                HasSubstr("is not a calibration"));
}

TEST(CalibrationFile, ReportsRunsWithOtherSettingsThanTheFit) {
    CostSource source;
    source.path = "c.json";
    RunParameters run;
    run.method = "hybrid";
    run.model = "cost";
    run.resolution = 4096;
    run.frame.width = 640;
    run.frame.height = 360;
    EXPECT_EQ(otherSettings(source, run), "") << "a file that does not say";
    Experiment fitted;
    fitted.resolutionLog2 = {12};
    fitted.believe = {run.frame.rays.believe};
    source.fittedWith = toJson(fitted);
    source.fittedWith["sizes"] = "320x180,640x360";
    EXPECT_EQ(otherSettings(source, run), "");
    const RunParameters same = run;
    run.frame.bias.taps = 1;
    run.frame.width = 1920;
    run.frame.height = 1080;
    run.frame.maps.pageTexels = 64;
    run.resolution = 1024;
    EXPECT_THAT(otherSettings(source, run),
                AllOf(HasSubstr("size 1920x1080 instead of 320x180 or 640x360"),
                      HasSubstr("resolution 1024 instead of 4096"), HasSubstr("page_size 64"),
                      HasSubstr("taps 1 instead of 4"), Not(HasSubstr("undersample"))));
    for (const Setting* setting : frameSettings()) {
        RunParameters other = same;
        for (const char* text : {"2", "0.5", "1", "32", "512M", "warm"})
            try {
                setting->setFrame(other.frame, setting->option, text);
                if (setting->frameText(other.frame) != setting->frameText(same.frame))
                    break;
            } catch (const Error&) {
                continue; // it is no value of this setting
            }
        if (setting->readBy == ReadBy::kExactRays)
            other.frame.rays.believe = 0.0f;
        const std::string said = setting->key + " ";
        if (setting->readBy == ReadBy::kHybrid) // routes, not what maps cost
            EXPECT_THAT(otherSettings(source, other), Not(HasSubstr(said)));
        else
            EXPECT_THAT(otherSettings(source, other), HasSubstr(said));
    }
    source.calibration = CostCalibration{{{findCostTerm("maps"), 1}}, {{findCostTerm("maps"), 2}}};
    EXPECT_THAT(remarksOn(source, {run, run}),
                testing::ElementsAre(HasSubstr("was calibrated with other settings (size 1920")));
    run.model = "texels:96";
    EXPECT_THAT(remarksOn(source, {run}), testing::IsEmpty());
    EXPECT_THAT(messageOf([&] { refuseUnusedOptions(source, {run}); }, ErrorKind::kUsage),
                HasSubstr("is a calibration, which no run uses for routing"));
}

TEST(CalibrationFile, IsDistinguishedFromCostsOfMapsAndFromAnotherMachine) {
    const TemporaryDirectory directory;
    writeText(directory / "c.json", kCalibration);
    writeText(directory / "costs.json", R"({"costs": []})");
    const Json here = {
        {"cpu", "this"}, {"backend", "cpu"}, {"thread_count", 2}, {"device", Json()}};
    const CostSource calibration = readCostSource(directory / "c.json", here);
    EXPECT_TRUE(calibration.calibration && !calibration.table);
    EXPECT_THAT(calibration.otherMachine,
                AllOf(HasSubstr("cpu"), HasSubstr("another"), Not(HasSubstr("thread_count"))));
    Json of = Json::parse(kCalibration), avx2 = here;
    avx2["vector_instructions"] = "AVX2";
    EXPECT_THAT(readCostSource(directory / "c.json", avx2).otherMachine, Not(HasSubstr("vector")))
        << "the file does not say";
    of["provenance"]["vector_instructions"] = "AVX-512";
    writeText(directory / "wide.json", of.dump());
    EXPECT_THAT(readCostSource(directory / "wide.json", avx2).otherMachine,
                HasSubstr("vector_instructions \"AVX-512\" instead of \"AVX2\""));
    const CostSource unsaid = readCostSource(directory / "costs.json", here);
    EXPECT_TRUE(unsaid.table);
    EXPECT_EQ(unsaid.otherMachine, "") << "the file does not say";
    const auto model = makeCostModel("cost");
    giveCalibration(*model, calibration);
    EXPECT_FALSE(model->needsCalibration());
    EXPECT_THAT(messageOf([&] { giveCalibration(*makeCostModel("cost"), {}); }, ErrorKind::kUsage),
                HasSubstr("--costs C.json"));
}

// Times of one device say nothing about another, be it the processor beside it.
TEST(CostFile, RecordsTheDeviceOfTheMeasurement) {
    const TemporaryDirectory directory;
    const Json cpu = {{"cpu", "this"}, {"backend", "cpu"}, {"thread_count", 2}, {"device", Json()}};
    Json cuda = cpu, other = cpu;
    cuda["backend"] = "cuda";
    cuda["device"] = "NVIDIA H200";
    other = cuda;
    other["device"] = "NVIDIA A100";
    CostTable table;
    table[{"a", 0}] = {FrameCosts{0, {{0, 0, 1, 2}}}, {{"size", "1x1"}}};
    writeText(directory / "costs.json", jsonText(toJson(table, cuda, Json::object())));
    const CostSource here = readCostSource(directory / "costs.json", cuda);
    ASSERT_TRUE(here.table);
    EXPECT_EQ(findCosts(*here.table, "", {"a", 0}).maps.size(), 1u);
    EXPECT_EQ(here.otherMachine, "");
    EXPECT_THAT(remarksOn(here, {}), testing::IsEmpty());
    const CostSource onCpu = readCostSource(directory / "costs.json", cpu);
    EXPECT_EQ(onCpu.otherMachine,
              "device \"NVIDIA H200\" instead of null, backend \"cuda\" instead of \"cpu\"");
    EXPECT_THAT(remarksOn(onCpu, {}),
                testing::ElementsAre(AllOf(HasSubstr("was measured elsewhere (device"),
                                           HasSubstr("measure on this machine for good routes"))));
    EXPECT_EQ(readCostSource(directory / "costs.json", other).otherMachine,
              "device \"NVIDIA H200\" instead of \"NVIDIA A100\"");
}

TEST(CalibrationFile, RecordsTheDeviceOfTheFit) {
    const TemporaryDirectory directory;
    writeText(directory / "c.json", kCalibration);
    const Json cuda = {
        {"cpu", "another"}, {"backend", "cuda"}, {"thread_count", 2}, {"device", "NVIDIA H200"}};
    const CostSource source = readCostSource(directory / "c.json", cuda);
    EXPECT_EQ(source.otherMachine,
              "device null instead of \"NVIDIA H200\", backend \"cpu\" instead of \"cuda\"");
    EXPECT_THAT(remarksOn(source, {}),
                testing::ElementsAre(HasSubstr("was calibrated elsewhere (device null")));
}

TEST(Observations, RoundTripIsExactAndDamagedOnesAreReported) {
    ObservedFrame frame;
    frame.scene = "s";
    frame.view = "v";
    frame.frame = 7;
    frame.countMs = {1, 2, 3, 4};
    MapQuantities map;
    map.light = 5;
    map.pairs = 1ull << 40;
    map.movers = 6;
    map.moverCrossings = 0.25f;
    frame.maps = {map};
    frame.costs = {{5, 0, 1.5, 2.5}};
    const Json good = toJson(std::vector<ObservedFrame>{frame});
    const ObservedFrame back = observationsFromJson(good, "o.json").at(0);
    EXPECT_EQ(back.countMs, frame.countMs);
    EXPECT_EQ(back.maps.at(0).pairs, map.pairs);
    EXPECT_EQ(back.maps[0].movers, 6u);
    EXPECT_EQ(back.maps[0].moverCrossings, 0.25f);
    EXPECT_EQ(back.costs.at(0).mapMs, 2.5);
    const auto message = [&](const char* key, const Json& value) {
        Json bad = good;
        bad[0]["maps"][0][key] = value;
        return messageOf([&] { observationsFromJson(bad, "o.json"); }, ErrorKind::kInput);
    };
    EXPECT_THAT(message("pages", -1), AllOf(HasSubstr("o.json"), HasSubstr("\"pages\" is -1")));
    EXPECT_THAT(message("pages", 1e10), HasSubstr("whole number"));
    EXPECT_THAT(message("pages", 4294967296ull), HasSubstr("4294967295"));
    EXPECT_THAT(message("rays_ms", "much"), HasSubstr("\"rays_ms\" is \"much\""));
    EXPECT_THAT(message("map_ms", -0.5), HasSubstr("from 0 to 1e15"));
    EXPECT_THAT(message("map_ms", 1e300), HasSubstr("from 0 to 1e15"));
    EXPECT_THAT(message("texels", Json()), HasSubstr("null"));
}

TEST(ProgramCalibrate, WritesTheCalibrationForHybrid) {
    const TemporaryDirectory directory;
    const std::string file = directory / "c.json", seen = directory / "o.json";
    std::vector<std::string> arguments{"calibrate",
                                       "builtin:fail-unequal-ranges",
                                       "-o",
                                       file,
                                       "--observations",
                                       seen,
                                       "--frames",
                                       "0",
                                       "--json"};
    for (const char* word : kSmall)
        arguments.push_back(word);
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["frame_count"], 1);
    EXPECT_THAT(result.err, AllOf(HasSubstr("held-out regret"), HasSubstr("sum of maps alone"),
                                  HasSubstr("nothing to hold out")));
    const Json json = Json::parse(readText(file));
    EXPECT_FALSE(json["provenance"]["commit"].get<std::string>().empty());
    EXPECT_FALSE(json["calibration"]["rays"].empty());
    EXPECT_EQ(json["held_out_regret"]["trials"][0]["rays"], "maps");
    EXPECT_EQ(json["frames"].size(), 1u);
    EXPECT_GT(json["frames"][0]["rays_ms"], 0);
    EXPECT_TRUE(json["held_out_regret"]["judged_by"].is_null());
    EXPECT_TRUE(json["held_out_regret"]["by_frame"].is_null());

    // The same observations give the same file but for who wrote it.
    const ProgramResult again =
        runShadowdag(directory, {"calibrate", "--from", seen, "-o", directory / "again.json"});
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(Json::parse(readText(directory / "again.json"))["calibration"], json["calibration"]);

    const ProgramResult frame = runShadowdag(
        directory, {"render", "builtin:fail-unequal-ranges", "-o", directory / "a.png", "--size",
                    "64x36", "--resolution", "64", "--model", "cost", "--costs", file, "--json"});
    ASSERT_EQ(frame.status, 0) << frame.err;
    EXPECT_THAT(frame.err, Not(HasSubstr("calibrated elsewhere")));
    const Json rendered = frame.json()["frames"][0];
    EXPECT_GT(rendered["traced_map_count"].get<int>() + rendered["drawn_map_count"].get<int>(), 0);
}

TEST(ProgramCalibrate, ACalibrationOfAnotherMachineIsUsedAndReported) {
    const TemporaryDirectory directory;
    writeText(directory / "c.json", kCalibration);
    const ProgramResult result =
        runShadowdag(directory, {"render", "builtin:fail-unequal-ranges", "-o", directory / "a.png",
                                 "--size", "32x18", "--resolution", "32", "--model", "cost",
                                 "--costs", directory / "c.json"});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr("was calibrated elsewhere"), HasSubstr("another")));
}

TEST(ProgramCalibrate, RefusesInvalidInputByName) {
    const TemporaryDirectory directory;
    const std::string file = directory / "c.json", png = directory / "a.png";
    writeText(directory / "broken.json", "{\"calibration\": {\"rays\": 3}}");
    writeText(directory / "good.json", kCalibration);
    writeText(directory / "costs.json", R"({"costs": []})");
    writeText(directory / "cut.json", R"({"observations": [{"scene": "a", "vi)");
    writeText(directory / "list.json", "[]");
    writeText(directory / "empty.json", "{}");
    const std::string results = directory / "results.json";
    writeText(results, R"({"runs": [], "map_costs": []})");
    const char* scene = "builtin:fail-unequal-ranges";
    expectRefused(
        directory,
        {{{"calibrate"}, 1, "required"},
         {{"calibrate", "builtin:nowhere", "-o", file}, 1, "nowhere"},
         {{"calibrate", scene, "-o", file, "--size", "64"}, 1, "--size '64'"},
         {{"calibrate", scene, "-o", file, "--repeats", "0"}, 1, "--repeats '0'"},
         {{"calibrate", scene, "-o", file, "--taps", "1,4"}, 1, "calibrate takes one value"},
         {{"calibrate", scene, "-o", results},
          1,
          "results.json': would replace results of compare"},
         {{"calibrate", scene, "-o", file, "--observations", results}, 1, "would replace results"},
         {{"calibrate", "-o", file, "--from", directory / "none.json"}, 2, "none.json"},
         {{"calibrate", "-o", file, "--from", directory / "broken.json"}, 2, "no observations"},
         {{"calibrate", "-o", file, "--from", directory.path()}, 2, "is a directory"},
         {{"calibrate", "-o", file, "--from", directory / "cut.json"}, 2, "is truncated"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory.path()},
          2,
          "is a directory; give a cost file"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory / "list.json"},
          2,
          "is not a cost file"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory / "empty.json"},
          2,
          "neither \"costs\", a list, nor \"calibration\""},
         {{"compare", scene, "-o", directory / "report", "--model", "oracle", "--costs",
           directory / "good.json", "--no-charts"},
          1,
          "is a calibration, which no run uses for routing"},
         {{"calibrate", scene, "-o", file, "--from", directory / "broken.json"},
          1,
          "SCENE and --from contradict"},
         {{"calibrate", "-o", directory / "no/such/c.json"}, 3, "no/such"},
         {{"render", scene, "-o", png, "--model", "cost"}, 1, "give --costs C.json"},
         {{"render", scene, "-o", png, "--model", "cost:7"}, 1, "takes no argument"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory / "none.json"},
          2,
          "none.json: cannot be opened"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory / "broken.json"},
          2,
          "broken.json"},
         {{"render", scene, "-o", png, "--model", "cost", "--costs", directory / "costs.json"},
          1,
          "contains costs of maps"},
         {{"render", scene, "-o", png, "--model", "oracle", "--costs", directory / "good.json"},
          1,
          "is a calibration for --model cost"},
         {{"render", scene, "-o", png, "--model", "texels:9", "--costs", directory / "good.json"},
          1,
          "--model cost or oracle"},
         {{"compare", scene, "-o", directory / "report", "--model", "cost", "--no-charts"},
          1,
          "give --costs C.json"}});
}

} // namespace shadowdag
