// SPDX-License-Identifier: Apache-2.0
// The study of failures: every cell within its bounds, every remedy visible, the rows and their
// texts.
#include "tools/studies/failures.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "scenes/fail_scenes.h"
#include "tools/settings/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace shadowdag {

void PrintTo(const Failure& failure, std::ostream* out) {
    *out << failure.name;
}

namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const FailureTable& failureTable() {
    static const FailureTable read = readFailures(findStudy("failures"));
    return read;
}

std::unique_ptr<Study> studyOf(const std::vector<std::string>& names,
                               const std::vector<std::string>& scenes = {}) {
    static const Console console(true);
    return makeStudy(findStudy("failures"), {Backend::kCpu, names, scenes, "", ""}, console);
}

class FailureMatrix : public testing::TestWithParam<Failure> {};

// A cell may fail, but not worse than is known; and what is known must not be far off either, or a
// change for the worse would go unnoticed.
TEST_P(FailureMatrix, KeepsItsBoundsWhichAreTight) {
    const Json results = measureAll(*studyOf({GetParam().name}), {});
    EXPECT_THAT(failureLines(results), IsEmpty());
    for (const Json& cell : results["cells"]) {
        CellCounts counts;
        for (size_t m = 0; m < counts.size(); ++m)
            counts[m] = cell[kCellMeasureNames[m]].get<uint64_t>();
        for (const KnownCell& known : GetParam().known) {
            if (cell["method"] != kMatrixMethodNames[size_t(known.method)] ||
                known.isOn != (cell["remedy"] != "off"))
                continue;
            for (size_t m = 0; m < counts.size(); ++m)
                EXPECT_LE(known.counts[m], boundOf(counts, failureTable().slack)[m])
                    << cell["method"] << ", remedy " << cell["remedy"] << ": "
                    << kCellMeasureNames[m]
                    << " is better than the study says; run tools/studies/update_known.py";
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, FailureMatrix, testing::ValuesIn(failureTable().rows),
                         [](const auto& info) {
                             std::string name = info.param.name;
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });

TEST(Failures, TableHoldsEveryListedRowAndEveryScene) {
    std::set<std::string> listed, scenes, names;
    const auto add = [&](const std::string& rows) {
        std::istringstream words(rows);
        for (std::string word; words >> word;)
            listed.insert(word.substr(0, word.find(',')));
    };
    for (const Failure& failure : failureTable().rows) {
        EXPECT_TRUE(names.insert(failure.name).second) << failure.name << " is there twice";
        EXPECT_EQ(failure.hasRemedy(), !failure.seen.empty()) << failure.name;
        EXPECT_EQ(failure.off.empty(), failure.on.empty()) << failure.name;
        EXPECT_FALSE(failure.what.empty() || failure.remedy.empty() || failure.source.empty());
        add(failure.listed);
        scenes.insert(failure.scene);
    }
    for (const UnitTestedFailure& test : failureTable().tests)
        add(test.listed);
    for (int row = 1; row <= 29; ++row)
        EXPECT_TRUE(listed.contains(std::to_string(row))) << "row " << row;
    for (const FailScene& scene : failScenes())
        EXPECT_TRUE(scenes.contains("builtin:" + scene.name)) << scene.name;
}

// The page names tests as evidence: each stands in the tests' sources under that very name.
TEST(Failures, TestsNamedByRowsExist) {
    std::set<std::string> found;
    const std::regex declared(R"(\bTEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\))");
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(std::string(SDAG_SOURCE_DIR) + "/tests")) {
        if (entry.path().extension() != ".cpp")
            continue;
        std::ifstream file(entry.path());
        std::stringstream text;
        text << file.rdbuf();
        const std::string source = text.str();
        for (std::sregex_iterator it(source.begin(), source.end(), declared), end; it != end; ++it)
            found.insert((*it)[1].str() + "." + (*it)[2].str());
    }
    EXPECT_GT(found.size(), 500u);
    for (const UnitTestedFailure& test : failureTable().tests)
        EXPECT_TRUE(found.contains(test.test)) << test.test << " is nowhere in tests/";
}

// By hand: 5 % of 200 are 10, of 10 nothing.
TEST(Failures, BoundIsATwentiethAndThreeMore) {
    CellCounts known{};
    known[size_t(CellMeasure::kFalseLight)] = 200;
    known[size_t(CellMeasure::kAcne)] = 10;
    known[size_t(CellMeasure::kMeanError)] = 1000;
    const CellCounts bound = boundOf(known, {});
    EXPECT_EQ(bound[size_t(CellMeasure::kFalseShadow)], 3u);
    EXPECT_EQ(bound[size_t(CellMeasure::kFalseLight)], 213u);
    EXPECT_EQ(bound[size_t(CellMeasure::kAcne)], 13u);
    EXPECT_EQ(bound[size_t(CellMeasure::kMeanError)], 1070u);
}

TEST(Failures, SettingsAreReadInOrderAndRefusedByName) {
    const CellSetup setup = cellSetup({"bias=2 taps=4", "bias=0.25 movers=off resolution=64"});
    EXPECT_EQ(setup.frame.bias.constantTexels, 0.25f);
    EXPECT_EQ(setup.frame.bias.taps, 4u);
    EXPECT_EQ(setup.frame.maps.taps, 4u);
    EXPECT_FALSE(setup.hasMovers);
    EXPECT_EQ(setup.resolutionLog2, 6u);
    EXPECT_TRUE(readsAny(MatrixMethod::kMaps, "bias=2 offset=1"));
    EXPECT_FALSE(readsAny(MatrixMethod::kDagAll, "bias=2"));
    EXPECT_FALSE(readsAny(MatrixMethod::kDagNone, "bias=2 offset=1"));
    for (const char* wrong : {"bais=2", "bias", "movers=yes", "resolution=65",
                              "resolution_rule=cube", "taps=5", "offset=-1"})
        try {
            cellSetup({wrong});
            FAIL() << wrong << " was taken";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_THAT(error.what(), HasSubstr("must be"));
        }
}

Json matrixOf(uint64_t acneCount, bool isSeen) {
    Json cell = {{"failure", "acne"},
                 {"method", "maps"},
                 {"remedy", "on"},
                 {"acne_count", acneCount},
                 {"bounds", {{"acne_count", 3}}},
                 {"broken", Json::array()}};
    if (acneCount > 3)
        cell["broken"].push_back("acne_count");
    return {{"cells", {cell}},
            {"remedies",
             {{{"failure", "acne"},
               {"method", "maps"},
               {"measure", "acne_count"},
               {"off", 7},
               {"on", acneCount},
               {"factor", 2.0},
               {"is_seen", isSeen}}}},
            {"pictures", Json::array()}};
}

TEST(Failures, ExceededBoundsAreReportedWithTheirNumbers) {
    EXPECT_THAT(failureLines(matrixOf(3, true)), IsEmpty());
    const std::vector<std::string> lines = failureLines(matrixOf(4, false));
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0], "acne by maps, remedy on: acne_count is 4, bound 3");
    EXPECT_THAT(lines[1], HasSubstr("acne by maps: the remedy is not visible, acne_count is 7"));
}

TEST(Failures, UnknownNamesAreRefusedWithTheKnownOnes) {
    try {
        studyOf({"acme"});
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("'acme': must be one of acne, detached-shadow"));
    }
}

TEST(Failures, CountsDoNotDependOnTheThreadCount) {
    const std::vector<std::string> names = {"thin-wall", "light-touching", "stale-pages"};
    const Json many = measureAll(*studyOf(names), {});
    setThreadCount(1);
    const Json one = measureAll(*studyOf(names), {});
    setThreadCount(0);
    EXPECT_EQ(many, one);
}

// Nothing is known of a scene of the user's: it has neither bounds nor remedies that must be seen.
TEST(Failures, ARowIsMeasuredOnAnotherSceneWithoutBounds) {
    const Json results = measureAll(*studyOf({"acne"}, {"builtin:fail-coplanar"}), {});
    EXPECT_EQ(results["cells"].size(), 5u);
    EXPECT_TRUE(results["remedies"].empty());
    for (const Json& cell : results["cells"]) {
        EXPECT_EQ(cell["failure"], "acne-fail-coplanar");
        EXPECT_EQ(cell["scene"], "fail-coplanar");
        EXPECT_TRUE(cell["bounds"].empty());
        EXPECT_TRUE(cell["broken"].empty());
    }
}

} // namespace
} // namespace shadowdag
