// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare failures` from end to end, two rows of the matrix.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;

TEST(CompareFailures, WritesPagePicturesTableAndJson) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"compare", "failures", "--only", "acne,coplanar", "-o", report, "--json"});
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
                                "acne_maps_on.png", "coplanar_dag_on_error.png"}) {
        EXPECT_TRUE(std::filesystem::exists(report + "/images/" + picture)) << picture;
        EXPECT_THAT(page, HasSubstr(picture));
    }
    EXPECT_THAT(readText(report + "/failures.csv"), HasSubstr("failure,scene,method,remedy"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

TEST(CompareFailures, WhatContradictsItIsRefused) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const auto refuse = [&](std::vector<std::string> arguments, const char* message) {
        arguments.insert(arguments.begin(), {"compare", "-o", report});
        const ProgramResult result = runShadowdag(directory, arguments);
        EXPECT_EQ(result.status, 1) << message;
        EXPECT_THAT(result.err, HasSubstr(message));
    };
    refuse({"failures", "--size", "64x64"}, "--size and compare failures contradict each other");
    refuse({"failures", "--resume"}, "--resume and compare failures contradict each other");
    refuse({"failures", "builtin:atrium"}, "failures stands alone");
    refuse({"failures", "--only", "acme"}, "--only 'acme': must be one of acne");
    refuse({"builtin:fail-acne", "--only", "acne"}, "--only is for compare failures");
}

TEST(CompareReal, WritesAReportOfAnyLitSceneAndRefusesWhatContradictsIt) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"compare", "real", "builtin:fail-coplanar", "-o", report, "--json"});
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
        arguments.insert(arguments.begin(), {"compare", "-o", directory / "other"});
        const ProgramResult refused = runShadowdag(directory, arguments);
        EXPECT_EQ(refused.status, status) << message;
        EXPECT_THAT(refused.err, HasSubstr(message));
    };
    refuse({"real"}, 1, "compare real needs scenes");
    refuse({"real", "builtin:fail-acne", "--taps", "1"}, 1, "--taps and compare real contradict");
    refuse({"real", directory / "none.glb"}, 2, "none.glb");
    refuse({"real", directory.path()}, 1, "no .glb or .gltf file in it has lights");
}

} // namespace
} // namespace shadowdag
