// SPDX-License-Identifier: Apache-2.0
// Files of studies: refusals by file and row, and joined and resumed parts.
#include "tools/studies/study.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/study_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

namespace shadowdag {
namespace {

using testing::HasSubstr;

std::string complaintOf(const std::function<void()>& ask) {
    try {
        ask();
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing was refused";
}

/// Returns the message about a changed study of the program.
std::string complaintAbout(const std::string& name, const std::function<void(Json&)>& change) {
    StudyFile file = findStudy(name);
    change(file.json);
    const Console console(true);
    const std::vector<std::string> scenes = name == "real" || name == "adjudication_real"
                                                ? std::vector<std::string>{"builtin:fail-acne"}
                                                : std::vector<std::string>();
    return complaintOf([&] { makeStudy(file, {Backend::kCpu, {}, scenes, "", ""}, console); });
}

// The second would be taken for the first: parts, pictures and the journal go by names.
TEST(Study, ScenesThatWouldHaveOneNameAreRefused) {
    const Console console(true);
    for (const char* other : {"b/x.glb", "builtin:x"}) {
        const std::vector<std::string> scenes{"a/x.glb", other};
        EXPECT_THAT(
            complaintOf([&] {
                makeStudy(findStudy("failures"), {Backend::kCpu, {}, scenes, "", ""}, console);
            }),
            testing::AllOf(testing::HasSubstr("two of the scenes given"),
                           testing::HasSubstr("-x' in the report")))
            << other;
    }
}

TEST(Study, ShippedStudiesAreThoseInTheRepository) {
    EXPECT_EQ(shippedStudies().size(), 8u);
    for (const StudyFile& study : shippedStudies()) {
        EXPECT_EQ(study.json, findStudy(std::string(SDAG_SOURCE_DIR) + "/" + study.path).json);
        EXPECT_EQ(complaintAbout(study.name, [](Json&) {}), "nothing was refused");
    }
    EXPECT_THAT(
        complaintOf([] { findStudy("failure"); }),
        HasSubstr(
            "STUDY 'failure': must be one of ablation, adjudication, adjudication_real, failures, "
            "mutants, real, scale, stability, or a file ending in .json"));
    EXPECT_THAT(complaintOf([] { findStudy("none.json"); }), HasSubstr("none.json"));
}

TEST(Study, ErrorsNameFileRowAndKey) {
    const std::string acne = "scenes/studies/failures.json: row 1, \"acne\": ";
    const auto complain = [&](const char* key, const Json& value) {
        return complaintAbout("failures", [&](Json& json) { json["rows"][0][key] = value; });
    };
    EXPECT_THAT(complain("frames", 0),
                HasSubstr(acne + "key \"frames\" is 0; it must be a whole number from 1 to 1000"));
    EXPECT_THAT(complain("max", 1), HasSubstr(acne + "unknown key \"max\"; the keys are "));
    EXPECT_THAT(complain("scene", 7), HasSubstr(acne + "key \"scene\" is 7; it must be a text"));
    EXPECT_THAT(complain("what", ""), HasSubstr(acne + "key \"what\" is missing"));
    EXPECT_THAT(complain("on", "bais=1"), HasSubstr(acne + "key \"on\": setting 'bais=1'"));
    EXPECT_THAT(complain("on", ""), HasSubstr(acne + "key \"on\" is \"\"; it must be given with"));
    EXPECT_THAT(complain("seen", Json::array({{{"method", "map"}}})),
                HasSubstr(acne + "seen 1: key \"method\" is \"map\"; it must be one of maps, dag"));
    EXPECT_THAT(complain("name", "wires"),
                HasSubstr("\"wires\": key \"name\" is \"wires\"; it is listed twice"));
    EXPECT_THAT(
        complaintAbout("failures", [](Json& json) { json["kind"] = "failure"; }),
        HasSubstr("failures.json: key \"kind\" is \"failure\"; it must be one of ablation"));
    EXPECT_THAT(complaintAbout("failures", [](Json& json) { json["rows"] = 1; }),
                HasSubstr("failures.json: key \"rows\" is 1; it must be a list"));
}

TEST(Study, EveryKindChecksWhatItRefersTo) {
    EXPECT_THAT(
        complaintAbout("stability", [](Json& json) { json["bands"][1]["high"] = "base + q"; }),
        HasSubstr("scenes/studies/stability.json: band 2: key \"high\" is \"base + q\"; it is not "
                  "a formula"));
    EXPECT_THAT(
        complaintAbout("stability", [](Json& json) { json["rows"][0]["part"] = "tiem"; }),
        HasSubstr("row 1, \"time-posts\": key \"part\" is \"tiem\"; it must be one of time"));
    EXPECT_THAT(
        complaintAbout("ablation", [](Json& json) { json["rows"][0]["shown_by"] = {"acme"}; }),
        HasSubstr("row 1, \"explicit-bounds\": key \"shown_by\" is \"acme\"; it must name rows of "
                  "the study \"failures\""));
    EXPECT_THAT(
        complaintAbout("ablation", [](Json& json) { json["rows"][0]["on"] = "offset=1"; }),
        HasSubstr(
            "key \"on\" is \"offset=1\"; it must contain a setting that the row's method reads"));
    EXPECT_THAT(
        complaintAbout("stability", [](Json& json) { json["rows"][6]["kind"] = "outlines"; }),
        HasSubstr("\"numeric-rays\": key \"kind\" is \"outlines\"; it must be rays or faces"));
    EXPECT_THAT(
        complaintAbout("stability", [](Json& json) { json["rows"][6]["sizes"] = {24}; }),
        HasSubstr("key \"sizes\" is 24; it must contain powers of two from 16 on for rays"));
    EXPECT_THAT(complaintAbout("failures",
                               [](Json& json) {
                                   json["rows"][0].erase("off");
                                   json["rows"][0].erase("on");
                               }),
                HasSubstr("it needs a remedy, \"off\" and \"on\""));
    EXPECT_THAT(
        complaintAbout("ablation", [](Json& json) { json["rows"][0]["error_metric"] = "bytes"; }),
        HasSubstr("\"bytes\"; it must be mean_abs_visibility_error or flip"));
    EXPECT_THAT(
        complaintAbout("ablation", [](Json& json) { json["rows"][0]["default_if"] = {"bais=1"}; }),
        HasSubstr("key \"default_if\" is \"bais=1\"; it is not a setting: "));
    EXPECT_THAT(complaintAbout("ablation", [](Json& json) { json["repeats"] = 0; }),
                HasSubstr("should gain time, but times are not measured"));
    EXPECT_THAT(
        complaintAbout("failures", [](Json& json) { json["rows"][0]["on"] = "receiver_plane=1"; }),
        HasSubstr("must be on or off"));
    EXPECT_THAT(
        complaintAbout(
            "real", [](Json& json) { json["rows"][0]["known"][0]["method"] = "dag believe all"; }),
        HasSubstr("known 2: key \"method\" is \"dag believe all\"; it is listed twice"));
}

TEST(Study, WhatWouldCheckNothingIsRefused) {
    for (const char* name : {"failures", "stability"})
        EXPECT_THAT(complaintAbout(name, [](Json& json) { json["rows"] = Json::array(); }),
                    HasSubstr("key \"rows\" is []; it must contain at least one row"));
    EXPECT_THAT(
        complaintAbout("failures", [](Json& json) { json["rows"][0]["seen"][0].erase("factor"); }),
        HasSubstr("row 1, \"acne\": seen 1: key \"factor\" is missing"));
}

// What all checks of a whole run were is taken from recorded results.
TEST(Study, BandsThatMatchNoCheckAreNamed) {
    const Console console(true);
    std::ifstream file(SDAG_SOURCE_DIR "/tests/bench/results/stability.json");
    const Json recorded = Json::parse(file);
    StudyFile study = findStudy("stability");
    const auto lines = [&](const StudyRequest& request) {
        return makeStudy(study, request, console)->brokenLines(recorded);
    };
    EXPECT_THAT(lines({}), testing::IsEmpty());
    study.json["bands"][0]["measure"] = "mean_eror";
    study.json["known"] = Json::array({{{"group", "time-posts"},
                                        {"kind", "still"},
                                        {"method", "dga"},
                                        {"measure", "flicker_rate"},
                                        {"reason", "a misspelt method"}}});
    const std::string id = study.json["bands"][0]["id"];
    EXPECT_THAT(lines({}), testing::IsSupersetOf(
                               {HasSubstr("band " + id + ": matches no check"),
                                HasSubstr("known time-posts, still, by dga, flicker_rate")}));
    StudyRequest some;
    some.names = {"time"};
    EXPECT_THAT(lines(some), testing::Not(testing::Contains(HasSubstr("matches no check"))));
}

/// A study of one scene with two parts, the second of which fails.
struct HalfStudy : Study {
    std::vector<std::string> parts() const override { return {"a", "b"}; }
    std::vector<std::string> scenes() const override { return {scene}; }
    Json measure(size_t part, const StudyRequest&) override {
        ++measuredCounts[part];
        if (part == 1)
            throw Error(ErrorKind::kResource, "part b fails");
        return Json::object();
    }
    std::vector<std::string> brokenLines(const Json&) const override { return {}; }
    std::string judged(const Json&) const override { return ""; }
    std::string csv(const Json&) const override { return ""; }
    Json counts(const Json&) const override { return Json::object(); }

    std::string scene;
    int measuredCounts[2] = {};
};

TEST(Study, APartIsTakenUpOnlyWhileItsScenesAreAsTheyWere) {
    const TemporaryDirectory directory;
    const Console console(true);
    HalfStudy study;
    study.scene = directory / "scene.glb";
    writeGlb(makeBuiltin("fail-contact"), study.scene);
    const auto run = [&](bool resume) {
        return complaintOf([&] {
            runStudy(findStudy("failures"), study, {}, {directory / "report", resume, true},
                     console);
        });
    };
    EXPECT_EQ(run(false), "part b fails");
    EXPECT_EQ(run(true), "part b fails");
    EXPECT_EQ(study.measuredCounts[0], 1) << "it was taken up";
    writeGlb(makeBuiltin("fail-acne"), study.scene);
    EXPECT_THAT(run(true), HasSubstr("belongs to another run: inputs."));
    EXPECT_EQ(study.measuredCounts[0], 1);
}

// Of a directory the files in it, so that these are hashed.
TEST(Study, ScenesAreTheFilesThatAreRead) {
    const TemporaryDirectory directory;
    const std::string file = directory / "scene.glb";
    writeGlb(makeBuiltin("fail-contact"), file);
    const Console console(true);
    StudyRequest request;
    request.scenes = {directory.path()};
    EXPECT_EQ(makeStudy(findStudy("real"), request, console)->scenes(),
              std::vector<std::string>{file});
    for (const char* name : {"failures", "stability", "ablation"}) {
        const auto scenes = makeStudy(findStudy(name), {}, console)->scenes();
        EXPECT_THAT(scenes, testing::Not(testing::IsEmpty())) << name;
        EXPECT_THAT(scenes, testing::Each(testing::StartsWith("builtin:"))) << name;
    }
}

// What a study of a kind leaves is moved into its directory and has a page.
TEST(Study, EveryKindHasItsFilesAndItsPage) {
    std::string usage;
    EXPECT_EQ(runReport({"--help"}, &usage), 0);
    for (const std::string kind : kStudyKinds) {
        EXPECT_THAT(usage, HasSubstr("\n  " + kind + " ")) << "no command makes its page";
        const TemporaryDirectory directory;
        const std::string partial = directory / "partial";
        std::filesystem::create_directory(partial);
        writeText(partial + "/" + kind + ".json", "{\"provenance\": {}}");
        writeText(partial + "/" + kind + ".csv", "");
        swapReport(directory.path());
        EXPECT_TRUE(std::filesystem::exists(directory / (kind + ".json"))) << kind;
        EXPECT_TRUE(std::filesystem::exists(directory / (kind + ".csv"))) << kind;
    }
    for (const StudyFile& study : shippedStudies())
        EXPECT_THAT(kStudyKinds, testing::Contains(study.json["kind"].get<std::string>()));
}

TEST(Study, PartsAreJoinedUnderTheirKeys) {
    const Console console(true);
    const auto study = makeStudy(findStudy("stability"), {}, console);
    const Json joined = study->join({{{"cells", {1, 2}}, {"settings", "a"}},
                                     {{"cells", {3}}, {"settings", "a"}, {"more", {4}}}});
    EXPECT_EQ(joined, (Json{{"cells", {1, 2, 3}}, {"settings", "a"}, {"more", {4}}}));
}

} // namespace
} // namespace shadowdag
