// SPDX-License-Identifier: Apache-2.0
// Files of studies: what is refused, by file and row, and parts that are joined and taken up.
#include "tools/studies/study.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

/// Returns what is said of a study of the program's that was changed.
std::string complaintAbout(const std::string& name, const std::function<void(Json&)>& change) {
    StudyFile file = findStudy(name);
    change(file.json);
    const Console console(true);
    const std::vector<std::string> scenes =
        name == "real" ? std::vector<std::string>{"builtin:fail-acne"} : std::vector<std::string>();
    return complaintOf([&] { makeStudy(file, {Backend::kCpu, {}, scenes, "", ""}, console); });
}

TEST(Study, ThoseThatComeWithTheProgramAreThoseInTheTree) {
    EXPECT_EQ(shippedStudies().size(), 4u);
    for (const StudyFile& study : shippedStudies()) {
        EXPECT_EQ(study.json, findStudy(std::string(SDAG_SOURCE_DIR) + "/" + study.path).json);
        EXPECT_EQ(complaintAbout(study.name, [](Json&) {}), "nothing was refused");
    }
    EXPECT_THAT(complaintOf([] { findStudy("failure"); }),
                HasSubstr("STUDY 'failure': must be one of ablation, failures, real, stability, or "
                          "a file ending in .json"));
    EXPECT_THAT(complaintOf([] { findStudy("none.json"); }), HasSubstr("none.json"));
}

TEST(Study, WhatIsWrongIsNamedByFileRowAndKey) {
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
    EXPECT_THAT(complain("on", ""), HasSubstr(acne + "key \"on\" is \"\"; it must be there with"));
    EXPECT_THAT(complain("seen", Json::array({{{"method", "map"}}})),
                HasSubstr(acne + "seen 1: key \"method\" is \"map\"; it must be one of maps, dag"));
    EXPECT_THAT(complain("name", "wires"),
                HasSubstr("\"wires\": key \"name\" is \"wires\"; it stands there twice"));
    EXPECT_THAT(
        complaintAbout("failures", [](Json& json) { json["kind"] = "failure"; }),
        HasSubstr("failures.json: key \"kind\" is \"failure\"; it must be one of ablation"));
    EXPECT_THAT(complaintAbout("failures", [](Json& json) { json["rows"] = 1; }),
                HasSubstr("failures.json: key \"rows\" is 1; it must be a list"));
}

TEST(Study, EveryKindChecksWhatItRefersTo) {
    EXPECT_THAT(
        complaintAbout("stability", [](Json& json) { json["bands"][1]["high"] = "base + q"; }),
        HasSubstr("scenes/studies/stability.json: band 2: key \"high\" is \"base + q\"; it is no "
                  "formula"));
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
            "key \"on\" is \"offset=1\"; it must hold a setting that the row's method reads"));
    EXPECT_THAT(
        complaintAbout("real", [](Json& json) { json["rows"][0]["known"][0]["method"] = "dag"; }),
        HasSubstr("known 2: key \"method\" is \"dag\"; it stands there twice"));
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
