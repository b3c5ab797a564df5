// SPDX-License-Identifier: Apache-2.0
// `shadowdag study` from end to end: two rows of failures, real scenes, a user's files, refusals,
// and resumption.
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;

TEST(StudyFailures, WritesPagePicturesTableAndJson) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"study", "failures", "--only", "acne,coplanar", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["cell_count"], 9); // acne: maps twice; coplanar has no remedy
    EXPECT_TRUE(result.json()["broken"].empty());
    const Json json = Json::parse(readText(report + "/failures.json"));
    EXPECT_EQ(json["cells"].size(), 9u);
    EXPECT_EQ(json["remedies"].size(), 1u);
    EXPECT_TRUE(json["provenance"].contains("commit"));
    const std::string page = readText(report + "/index.html");
    EXPECT_THAT(page, HasSubstr("<h2 id=\"acne\">"));
    EXPECT_THAT(page, HasSubstr("receiver_plane=off"));
    for (const char* picture : {"acne_truth.png", "acne_maps_off.png", "acne_maps_off_error.png",
                                "acne_maps_on.png", "coplanar_dag_believe_all_on_error.png"}) {
        EXPECT_TRUE(std::filesystem::exists(report + "/images/" + picture)) << picture;
        EXPECT_THAT(page, HasSubstr(picture));
    }
    EXPECT_THAT(readText(report + "/failures.csv"), HasSubstr("failure,scene,method,remedy"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

// A file of one's own: its bounds are held, and a run that does not hold them ends in status 5.
TEST(StudyFailures, AUsersFileIsRunAndItsBoundsAreChecked) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report", file = directory / "own.json";
    Json study = Json::parse(readText(SDAG_SOURCE_DIR "/scenes/studies/failures.json"));
    Json row = study["rows"][0];
    row["name"] = "mine";
    row.erase("on");
    row.erase("off");
    row.erase("seen");
    row["always"] = "receiver_plane=off";
    row["known"] = Json::array({{{"method", "maps"}, {"false_shadow_count", 1}}});
    study["rows"] = Json::array({row});
    writeText(file, jsonText(study));
    const ProgramResult result = runShadowdag(directory, {"study", file, "-o", report, "--json"});
    EXPECT_EQ(result.status, 5) << result.err;
    EXPECT_THAT(result.err, HasSubstr("mine by maps, remedy none: false_shadow_count is 11186, "
                                      "bound 4"));
    EXPECT_THAT(result.err,
                HasSubstr("mine by dag believe all, remedy none: it has no recorded counts"));
    EXPECT_EQ(Json::parse(readText(report + "/failures.json"))["study"], study);
    study["rows"][0]["frames"] = "four";
    writeText(file, jsonText(study));
    const ProgramResult wrong = runShadowdag(directory, {"study", file, "-o", report});
    EXPECT_EQ(wrong.status, 2);
    EXPECT_THAT(wrong.err,
                HasSubstr(file + ": row 1, \"mine\": key \"frames\" is \"four\"; it must "
                                 "be a whole number from 1 to 1000"));
}

TEST(StudyFailures, ContradictingOptionsAreRefused) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const auto refuse = [&](const std::vector<std::string>& arguments, const char* message) {
        std::vector<std::string> all = arguments;
        all.insert(all.end(), {"-o", report});
        const ProgramResult result = runShadowdag(directory, all);
        EXPECT_EQ(result.status, 1) << message;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_FALSE(std::filesystem::exists(report)) << message;
    };
    refuse({"study", "failures", "--size", "64x64"}, "--size");
    refuse({"study", "failures", "--resume"}, "contains no unfinished study");
    refuse({"study", "failures", "--only", "acme"}, "--only 'acme': must be one of acne");
    refuse({"study", "stability", "--only", "tiem"},
           "--only 'tiem': must be one of time, perturbation");
    refuse({"study", "failure"}, "STUDY 'failure': must be one of ablation, adjudication");
    refuse({"study"}, "study needs a STUDY and -o DIR");
    refuse({"compare", "failures"}, "run by shadowdag study failures -o DIR");
    refuse({"compare", "mechanisms"}, "run by shadowdag study ablation -o DIR");
    const ProgramResult list = runShadowdag(directory, {"study", "--list", "--json"});
    EXPECT_EQ(list.status, 0) << list.err;
    EXPECT_EQ(list.json()["studies"].size(), 8u);
}

TEST(StudyFailures, ScenesThatCannotBeMeasuredAreRefusedBeforeUnfinishedWorkIsDeleted) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report", journal = report + "/partial/journal.json",
                      dark = directory / "dark.glb", file = directory / "own.json";
    std::filesystem::create_directories(report + "/partial");
    const std::string unfinished = "{\"key\": \"a\", \"parts\": {\"b\": 1}}";
    writeText(journal, unfinished);
    Scene scene = makeBuiltin("fail-contact");
    scene.lights.clear();
    for (Node& node : scene.nodes)
        node.light = kNone;
    writeGlb(scene, dark);
    Json study = Json::parse(readText(SDAG_SOURCE_DIR "/scenes/studies/failures.json"));
    study["rows"] = Json::array({study["rows"][0]});
    study["rows"][0]["scene"] = directory / "typo.glb";
    writeText(file, jsonText(study));
    const auto refused = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"study", "-o", report});
        const ProgramResult result = runShadowdag(directory, arguments);
        EXPECT_NE(result.status, 0);
        EXPECT_EQ(readText(journal), unfinished);
        return result.err;
    };
    EXPECT_THAT(refused({"failures", directory / "typo.glb"}), HasSubstr("typo.glb"));
    EXPECT_THAT(refused({file}), HasSubstr("typo.glb"));
    EXPECT_THAT(refused({"failures", dark}), HasSubstr("has no supported light"));
    EXPECT_THAT(refused({"stability", "--only", "time-lights", "builtin:atrium"}),
                HasSubstr("cannot be moved; use a failure scene"));
    EXPECT_THAT(refused({"failures", "--cache", directory / "c"}),
                HasSubstr("--cache is for studies of kind real and adjudication, and study"));
}

TEST(StudyReal, WritesAReportOfAnyLitSceneAndRefusesContradictions) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result =
        runShadowdag(directory, {"study", "real", "builtin:fail-coplanar", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["cell_count"], 4);
    const Json json = Json::parse(readText(report + "/real.json"));
    EXPECT_EQ(json["cells"].size(), 4u);
    EXPECT_EQ(json["cells"][0]["known"], "no");
    EXPECT_THAT(readText(report + "/real.csv"), HasSubstr("scene,geometry_hash"));
    const std::string page = readText(report + "/index.html");
    for (const Json& cell : json["cells"]) {
        const std::string picture = cell["image"].get<std::string>();
        EXPECT_TRUE(std::filesystem::exists(report + "/images/" + picture)) << picture;
        EXPECT_THAT(page, HasSubstr(picture));
    }
    const auto refuse = [&](std::vector<std::string> arguments, int status, const char* message) {
        arguments.insert(arguments.begin(), {"study", "real", "-o", directory / "other"});
        const ProgramResult refused = runShadowdag(directory, arguments);
        EXPECT_EQ(refused.status, status) << message;
        EXPECT_THAT(refused.err, HasSubstr(message));
    };
    refuse({}, 1, "study real needs scenes");
    refuse({"builtin:fail-acne", "--only", "acne"}, 1,
           "--only and a study of kind real contradict");
    refuse({directory / "none.glb"}, 2, "none.glb");
    refuse({directory.path()}, 1, "has no .glb or .gltf file; give another directory, or scenes");
}

} // namespace
} // namespace shadowdag
