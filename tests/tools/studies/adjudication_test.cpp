// SPDX-License-Identifier: Apache-2.0
// The studies of adjudications: their rows are all built-in scenes and the known real ones, the
// committed results are theirs and have no wrong answer of the truth or of exact rays, and the
// tables of docs/adjudicator.md are those of the results.
#include "tools/studies/adjudication.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"
#include "tools/settings/json_file.h"
#include "tools/studies/real_scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

namespace shadowdag {
namespace {

using testing::HasSubstr;

const std::string kFolder = SDAG_SOURCE_DIR "/tests/bench/results/";
const std::string kResults = kFolder + "adjudication.json";
const std::string kRealResults = kFolder + "adjudication_real.json";

TEST(Adjudication, RowsOfTheStudyAreAllBuiltInScenesAndFailuresAreJudgedWhole) {
    const AdjudicationTable table = readAdjudication(findStudy("adjudication"));
    std::set<std::string> scenes;
    for (const AdjudicationRow& row : table.rows) {
        scenes.insert(row.scene);
        if (row.name.starts_with("fail-")) {
            EXPECT_EQ(row.pairLimit, 0u) << row.name;
        }
    }
    for (const BuiltinInfo& scene : builtinScenes())
        EXPECT_THAT(scenes, testing::Contains("builtin:" + scene.name));
    EXPECT_THAT(table.faultless,
                testing::ElementsAre(Tracer::kTruth, Tracer::kExactPackets, Tracer::kExactSingle));
}

TEST(Adjudication, RowsOfTheRealStudyAreThoseOfTheStudyOfRealScenesByHash) {
    const AdjudicationTable table = readAdjudication(findStudy("adjudication_real"));
    const RealTable real = readReal(findStudy("real"));
    EXPECT_EQ(table.placedLightCount, uint32_t(real.placedLightCount));
    std::map<std::string, std::string> hashes;
    for (const AdjudicationRow& row : table.rows) {
        EXPECT_EQ(row.scene, "") << row.name;
        EXPECT_EQ(row.pairLimit, 20000u) << row.name;
        hashes[row.name] = row.geometryHash;
    }
    for (const RealScene& scene : real.scenes)
        EXPECT_EQ(hashes[scene.name], scene.geometryHash) << scene.name;
    EXPECT_THAT(table.faultless,
                testing::ElementsAre(Tracer::kTruth, Tracer::kExactPackets, Tracer::kExactSingle));
}

void expectFaultless(const std::string& name, const std::string& path) {
    SCOPED_TRACE(path);
    const Json results = readJsonFile(path, "run the study");
    EXPECT_EQ(results["study"], findStudy(name).json) << "run shadowdag study " << name << " again";
    EXPECT_EQ(results["broken"], Json::array());
    EXPECT_EQ(results["skipped"], Json::array());
    const AdjudicationTable table = readAdjudication(findStudy(name));
    ASSERT_EQ(results["verdicts"].size(), table.rows.size());
    ASSERT_EQ(results["cells"].size(), table.rows.size() * std::size(kTracerNames));
    uint64_t pairs = 0, exactWrong = 0, othersWrong = 0, disputedFrame = 0;
    for (const Json& scene : results["verdicts"]) {
        pairs += scene["pair_count"].get<uint64_t>();
        EXPECT_EQ(scene["lit_count"].get<uint64_t>() + scene["dark_count"].get<uint64_t>() +
                      scene["ambiguous_count"].get<uint64_t>(),
                  scene["pair_count"].get<uint64_t>());
        const Json& disputed = scene["disputed"];
        disputedFrame += disputed["frame_pair_count"].get<uint64_t>();
        EXPECT_EQ(disputed["count"], disputed["ambiguous_count"]) << scene["scene"];
        EXPECT_EQ(disputed["truth_right_count"], 0) << scene["scene"];
        EXPECT_EQ(disputed["exact_right_count"], 0) << scene["scene"];
    }
    for (const Json& cell : results["cells"]) {
        const bool isFaultless =
            std::any_of(table.faultless.begin(), table.faultless.end(), [&](Tracer tracer) {
                return cell["tracer"] == kTracerNames[size_t(tracer)];
            });
        (isFaultless ? exactWrong : othersWrong) += cell["wrong_count"].get<uint64_t>();
    }
    EXPECT_GT(pairs, 500000u);
    EXPECT_GT(disputedFrame, 10000000u);
    EXPECT_EQ(exactWrong, 0u);
    EXPECT_GT(othersWrong, 1000u) << "a judge that finds nobody wrong judges nothing";
}

TEST(Adjudication, CommittedResultsAreOfTheseStudiesAndNoFaultlessTracerIsWrong) {
    expectFaultless("adjudication", kResults);
    expectFaultless("adjudication_real", kRealResults);
}

TEST(Adjudication, TheTablesOfTheDocumentAreThoseOfTheResults) {
    const std::string document = SDAG_SOURCE_DIR "/docs/adjudicator.md";
    const std::string beside = SDAG_SOURCE_DIR "/tests/bench/results/embree4-adjudication.json";
    EXPECT_EQ(runReport({"adjudicated", document, kResults, "--beside", beside, "--check"}), 0);
    EXPECT_EQ(runReport({"adjudicated", document, kRealResults, "--name", "real", "--check"}), 0);
}

TEST(Adjudication, ASceneIsJudgedAsItWasCommitted) {
    const Console console(true);
    StudyRequest request;
    request.names = {"fail-silhouette"};
    const auto study = makeStudy(findStudy("adjudication"), request, console);
    const Json measured = measureAll(*study, request);
    EXPECT_THAT(study->brokenLines(measured), testing::IsEmpty());
    const Json results = readJsonFile(kResults, "run the study");
    for (const char* list : {"verdicts", "cells"})
        for (const Json& row : measured[list]) {
            const auto same = [&](const Json& other) {
                return other["scene"] == row["scene"] &&
                       other.value("tracer", "") == row.value("tracer", "");
            };
            const auto found = std::find_if(results[list].begin(), results[list].end(), same);
            ASSERT_NE(found, results[list].end());
            // Embree's own packets use the widest instructions of the machine.
            if (row.value("tracer", "").find("rtc") == std::string::npos &&
                row.value("tracer", "") != "embree method") {
                EXPECT_EQ(row, *found);
            }
        }
}

TEST(Adjudication, StudiesThatCannotBeMeasuredAreRefused) {
    const auto complaintAbout = [](const std::function<void(Json&)>& change) -> std::string {
        StudyFile file = findStudy("adjudication");
        change(file.json);
        try {
            readAdjudication(file);
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    EXPECT_EQ(complaintAbout([](Json&) {}), "nothing was refused");
    EXPECT_THAT(complaintAbout([](Json& json) { json["faultless"] = {"embree"}; }),
                HasSubstr("key \"faultless\" is \"embree\""));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"][0]["pairs"] = -1; }),
                HasSubstr("key \"pairs\" is -1; it must be a whole number"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"] = Json::array(); }),
                HasSubstr("must contain at least one row"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["disputed_size"] = "wide"; }),
                HasSubstr("disputed_size 'wide': must be WIDTHxHEIGHT"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"][0]["geometry_hash"] = "ab"; }),
                HasSubstr("key \"scene\" is \"builtin:atrium\"; it must be given, or "
                          "\"geometry_hash\" of a file"));
    const Console console(true);
    StudyRequest request;
    request.scenes = {"builtin:atrium"};
    request.names = {"atrium"};
    EXPECT_THROW(makeStudy(findStudy("adjudication"), request, console), Error);
    request = {};
    request.backend = Backend::kCuda;
    EXPECT_THROW(makeStudy(findStudy("adjudication"), request, console), Error);
}

// A directory that holds one file of a row's name, but another one, and one that is no row.
TEST(Adjudication, RowsWhoseFileIsAbsentOrAnotherAreSkippedWithAReason) {
    const TemporaryDirectory directory;
    const Console console(true);
    StudyFile file = findStudy("adjudication_real");
    StudyRequest request;
    const auto complaint = [&]() -> std::string {
        try {
            makeStudy(file, request, console);
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    EXPECT_THAT(complaint(), HasSubstr("give their folder after the study's name"));
    const Scene scene = makeBuiltin("fail-contact");
    writeGlb(scene, directory / "mine.glb");
    request.scenes = {directory.path()};
    request.names = {"conference"};
    EXPECT_THAT(complaint(), HasSubstr("hold none of the files of its rows, conference"));
    writeGlb(scene, directory / "conference.glb");
    request.names = {"conference", "teapot"};
    EXPECT_EQ(complaint(), "nothing was refused");
    Json measured = measureAll(*makeStudy(file, request, console), request);
    EXPECT_EQ(measured["verdicts"], Json::array());
    ASSERT_EQ(measured["skipped"].size(), 2u);
    EXPECT_EQ(measured["skipped"][0]["scene"], "conference");
    EXPECT_THAT(measured["skipped"][0]["reason"].get<std::string>(),
                HasSubstr("another file of this name"));
    EXPECT_EQ(measured["skipped"][1],
              (Json{{"scene", "teapot"}, {"reason", "its file was not given"}}));
    // The file that was recorded, and one that is no row.
    file.json["pairs_of_given_scenes"] = 500;
    file.json["disputed_size"] = "64x36";
    const std::string reason = measured["skipped"][0]["reason"],
                      before = "another file of this name: its geometry is ";
    file.json["rows"] = Json::array({{{"name", "conference"},
                                      {"geometry_hash", reason.substr(before.size(), 32)},
                                      {"pairs", 400}}});
    request.names = {};
    measured = measureAll(*makeStudy(file, request, console), request);
    EXPECT_EQ(measured["skipped"], Json::array());
    ASSERT_EQ(measured["verdicts"].size(), 2u);
    EXPECT_EQ(measured["verdicts"][0]["scene"], "conference");
    EXPECT_EQ(measured["verdicts"][0]["pair_count"], 400);
    EXPECT_EQ(measured["verdicts"][1]["scene"], "mine");
    EXPECT_EQ(measured["verdicts"][1]["pair_count"], 500);
    EXPECT_GT(measured["verdicts"][1]["disputed"]["frame_pair_count"], 500);
}

TEST(Adjudication, BrokenLinesNameWrongAnswersAndTooManyAmbiguousPairs) {
    const Console console(true);
    const auto study = makeStudy(findStudy("adjudication"), {}, console);
    const auto results = [](uint64_t wrong, const char* tracer, uint64_t ambiguous,
                            uint64_t truthRight = 0, uint64_t exactRight = 0) -> Json {
        return {
            {"verdicts",
             {{{"scene", "a"},
               {"pair_count", 100},
               {"ambiguous_count", ambiguous},
               {"disputed",
                {{"count", 5},
                 {"ambiguous_count", 5 - truthRight - exactRight},
                 {"truth_right_count", truthRight},
                 {"exact_right_count", exactRight}}}}}},
            {"cells",
             {{{"scene", "a"}, {"tracer", tracer}, {"pair_count", 100}, {"wrong_count", wrong}}}}};
    };
    EXPECT_THAT(study->brokenLines(results(0, "truth", 0)), testing::IsEmpty());
    EXPECT_THAT(study->brokenLines(results(9, "maps", 0)), testing::IsEmpty());
    EXPECT_THAT(study->brokenLines(results(1, "truth", 0)),
                testing::ElementsAre("a by truth: 1 of 100 pairs are proven wrong; none may be"));
    EXPECT_THAT(study->brokenLines(results(0, "exact single", 1)),
                testing::ElementsAre(HasSubstr("a: 1 of 100 pairs are ambiguous")));
    // Of disputed pairs that are not ambiguous one of the two is wrong.
    EXPECT_THAT(study->brokenLines(results(0, "maps", 0, 2, 1)),
                testing::ElementsAre(
                    "a by truth: 1 of 5 disputed pairs are proven wrong; none may be",
                    "a by exact packets: 2 of 5 disputed pairs are proven wrong; none may be"));
}

} // namespace
} // namespace shadowdag
