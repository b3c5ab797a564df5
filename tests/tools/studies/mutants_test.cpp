// SPDX-License-Identifier: Apache-2.0
// The study of mutants: its rows are all faults, the committed results are theirs, and the table of
// docs/mutants.md is that of the results.
#include "tools/studies/mutants.h"

#include "cuda/error.h"
#include "tests/tools/report/report_runner.h"
#include "tools/settings/console.h"
#include "tools/settings/json_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <iterator>

namespace shadowdag {
namespace {

using testing::ElementsAreArray;
using testing::HasSubstr;

const std::string kResults = SDAG_SOURCE_DIR "/tests/bench/results/mutants.json";

std::vector<std::string> faults() {
    std::vector<std::string> names;
    for (const MutantText& text : kMutantTexts)
        names.push_back(text.name);
    return names;
}

TEST(Mutants, RowsOfTheStudyAreAllFaultsInOrder) {
    const MutantTable table = readMutants(findStudy("mutants"));
    std::vector<std::string> names;
    for (const MutantRow& row : table.rows)
        names.push_back(row.name);
    EXPECT_THAT(names, ElementsAreArray(faults()));
}

TEST(Mutants, CommittedResultsAreOfTheseFaultsAndEachIsNoticed) {
    const Json results = readJsonFile(kResults, "run the study");
    EXPECT_EQ(results["study"], findStudy("mutants").json) << "run shadowdag study mutants again";
    std::vector<std::string> names = faults(), measured;
    names.insert(names.begin(), kNoMutant);
    for (const Json& mutant : results["mutants"]) {
        measured.push_back(mutant["name"]);
        for (const MutantText& text : kMutantTexts)
            if (mutant["name"] == text.name) {
                EXPECT_EQ(mutant["what"], text.what) << "run shadowdag study mutants again";
            }
    }
    EXPECT_THAT(measured, ElementsAreArray(names));
    EXPECT_EQ(results["broken"], Json::array());
    size_t faultCount = 0, addingCount = 0;
    for (const Json& mutant : results["mutants"]) {
        faultCount += mutant["name"] != kNoMutant && mutant["harmless"] == "";
        addingCount += !mutant.at("excess").empty();
        EXPECT_TRUE(mutant["name"] != kNoMutant || mutant.at("excess").empty());
    }
    EXPECT_GE(faultCount, 30u);
    EXPECT_GE(addingCount, 30u);
}

// By hand: of 10 wrong pairs more in one cell 7 more are explained, of 5 in another 1 fewer; cells
// with fewer wrong pairs, or without a healthy one, do not count.
TEST(Mutants, ExcessIsWhatCellsHaveBeyondThoseOfTheRunWithoutAFault) {
    const auto cell = [](const char* row, const char* method, int wrong, int explained) -> Json {
        return {{"row", row},
                {"method", method},
                {"remedy", "on"},
                {"wrong_count", wrong},
                {"explained_count", explained}};
    };
    const Json fault = {{"name", "dag-eaten"},
                        {"cells",
                         {cell("a", "maps", 30, 25), cell("a", "dag", 6, 1),
                          cell("b", "maps", 1, 0), cell("c", "maps", 9, 9)}}};
    const Json healthy = {
        {"name", kNoMutant},
        {"cells", {cell("a", "maps", 20, 18), cell("a", "dag", 1, 2), cell("b", "maps", 4, 4)}}};
    Json mutants = Json::array({healthy, fault});
    setExcess(mutants);
    EXPECT_EQ(mutants[0]["excess"], Json::array());
    EXPECT_EQ(mutants[1]["excess"],
              Json::array({{{"row", "a"}, {"wrong_count", 15}, {"explained_count", 6}}}));
    EXPECT_FALSE(mutants[1].contains("cells"));
    Json alone = Json::array({fault}); // a process of its own leaves the cells to the study
    setExcess(alone);
    EXPECT_EQ(alone[0], fault);
}

TEST(Mutants, TheTableOfTheDocumentIsThatOfTheResults) {
    EXPECT_EQ(runReport({"mutation", SDAG_SOURCE_DIR "/docs/mutants.md", kResults, "--check"}), 0);
}

TEST(Mutants, AStudyNamesFaultsAndRowsThatExist) {
    const auto complaintAbout = [](const std::function<void(Json&)>& change) -> std::string {
        StudyFile file = findStudy("mutants");
        change(file.json);
        try {
            readMutants(file);
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    EXPECT_EQ(complaintAbout([](Json&) {}), "nothing was refused");
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"][0]["name"] = "dag-eaten"; }),
                HasSubstr("key \"name\" is \"dag-eaten\"; it must be a fault of cuda/mutant.h"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["judges"] = {"acme"}; }),
                HasSubstr("key \"judges\" is \"acme\"; it must name rows of the study"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"] = Json::array(); }),
                HasSubstr("must contain at least one row"));
}

TEST(Mutants, ABuildWithoutAssertionsSaysWhichOneHasThem) {
    const Console console(true);
    if (kHasMutants)
        GTEST_SKIP() << "built with assertions";
    try {
        makeStudy(findStudy("mutants"), {}, console);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("cmake --preset ci"));
    }
}

} // namespace
} // namespace shadowdag
