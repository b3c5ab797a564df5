// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare --part` and `--join`: parts make the report of one compare, or none.
#include "tests/tools/program/program_runner.h"
#include "tests/tools/program/time_keys.h"
#include "tools/commands/compare_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {

namespace {

using testing::HasSubstr;

/// Two scenes of two views and two frames: eight frames to share out. Something moves in the first,
/// whose cameras are placed.
Arguments tinyCompare(const std::string& output) {
    return {"compare",
            "builtin:fail-mover",
            "builtin:fail-wires",
            "-o",
            output,
            "--size",
            "32x18",
            "--resolution",
            "64",
            "--methods",
            "embree,dag",
            "--repeats",
            "1",
            "--warmups",
            "0",
            "--frames",
            "0:1",
            "--no-charts",
            "--views",
            "2",
            "--json"};
}

Json withoutTimes(const std::string& path) {
    Json results = Json::parse(readText(path));
    for (const char* key : {"thread_count", "parts"})
        results["provenance"].erase(key);
    results.erase("verdict"); // of times
    for (Json& run : results["runs"])
        for (auto entry = run.begin(); entry != run.end();)
            entry = isOfTime(entry.key()) ? run.erase(entry) : std::next(entry);
    return results;
}

/// Measures the parts into directory/K-N.
Arguments measureParts(const TemporaryDirectory& directory, int count) {
    Arguments parts;
    for (int part = 1; part <= count; ++part) {
        const std::string share = std::to_string(part) + "/" + std::to_string(count);
        parts.push_back(directory / (std::to_string(part) + "-" + std::to_string(count)));
        const ProgramResult result =
            runShadowdag(directory, tinyCompare(parts.back()) + Arguments{"--part", share});
        EXPECT_EQ(result.status, 0) << result.err;
        EXPECT_EQ(result.json()["part_file"], parts.back() + "/part.json");
    }
    return parts;
}

} // namespace

TEST(CompareParts, JoinToTheReportOfOneCompare) {
    const TemporaryDirectory directory;
    const std::string whole = directory / "whole", joined = directory / "joined";
    ASSERT_EQ(runShadowdag(directory, tinyCompare(whole)).status, 0);
    // Parts of a scene each and less, and more parts than frames.
    for (const int count : {3, 5}) {
        SCOPED_TRACE(count);
        Arguments parts = measureParts(directory, count);
        std::swap(parts.front(), parts.back()); // any order
        const ProgramResult result = runShadowdag(
            directory,
            Arguments{"compare", "--join", "--no-charts", "--json", "-o", joined} + parts);
        ASSERT_EQ(result.status, 0) << result.err;
        EXPECT_EQ(result.json()["run_count"], 16);
        EXPECT_EQ(Json::parse(readText(joined + "/results.json"))["scenes"][3]["scene"],
                  "builtin:fail-wires auto-2");
        EXPECT_EQ(withoutTimes(joined + "/results.json").dump(1),
                  withoutTimes(whole + "/results.json").dump(1));
        EXPECT_EQ(readText(joined + "/lights.csv"), readText(whole + "/lights.csv"));
        const Json provenance = Json::parse(readText(joined + "/results.json"))["provenance"];
        EXPECT_EQ(provenance["parts"].size(), size_t(count));
        for (const char* machine : {"cpu", "system", "memory_bytes"}) { // may differ
            EXPECT_TRUE(provenance["parts"][0].contains(machine)) << machine;
            EXPECT_FALSE(
                Json::parse(readText(parts.front() + "/part.json"))["key"].contains(machine))
                << machine;
        }
        size_t pictures = 0;
        for (const auto& entry : std::filesystem::directory_iterator(whole + "/images")) {
            const std::string name = entry.path().filename();
            EXPECT_EQ(readText(joined + "/images/" + name), readText(entry.path())) << name;
            ++pictures;
        }
        EXPECT_GT(pictures, 4u);
    }
}

TEST(CompareParts, AMissingRepeatedForeignOrDamagedPartIsNamed) {
    const TemporaryDirectory directory;
    const Arguments parts = measureParts(directory, 2);
    const std::string foreign = directory / "foreign", out = directory / "out";
    Arguments other = tinyCompare(foreign) + Arguments{"--part", "2/2"};
    for (std::string& argument : other)
        if (argument == "32x18")
            argument = "40x20";
    ASSERT_EQ(runShadowdag(directory, other).status, 0);
    const Arguments join = {"compare", "--join", "--no-charts", "-o", out};
    const auto expect = [&](const Arguments& arguments, int status, const std::string& message) {
        const ProgramResult result = runShadowdag(directory, join + arguments);
        EXPECT_EQ(result.status, status) << result.err;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_FALSE(std::filesystem::exists(out + "/results.json"));
    };
    expect({parts[1]}, 2, "of 2 parts of the compare, missing: 1; run compare --part 1/2");
    expect({parts[0], parts[1], parts[0]}, 2, parts[0] + ": is part 1, as is " + parts[0]);
    expect({parts[0], foreign}, 2, foreign + ": belongs to another compare than " + parts[0]);
    expect({parts[0], foreign}, 2, "its experiment_hash is");
    expect({parts[0], directory / "none"}, 2, "is not a finished part of a compare");
    expect({}, 1, "needs the directories of all parts");
    expect({parts[0], parts[1], "--size", "32x18"}, 1, "--size and --join contradict");
    expect({parts[0], parts[1], "--part", "1/2"}, 1, "--part and --join contradict");
    const ProgramResult onto = runShadowdag(
        directory, {"compare", "--join", "--no-charts", parts[0], parts[1], "-o", parts[0]});
    EXPECT_EQ(onto.status, 1);
    EXPECT_THAT(onto.err, HasSubstr("is one of the parts"));

    const ProgramResult whole = runShadowdag(directory, tinyCompare(parts[0]));
    EXPECT_EQ(whole.status, 1);
    EXPECT_THAT(whole.err, HasSubstr("contains a part of a compare"));

    const std::string path = parts[1] + "/part.json", text = readText(path);
    Json commit = Json::parse(text);
    commit["key"]["commit"] = "0123";
    commit["content_hash"] = partHash(commit);
    writeText(path, commit.dump());
    expect(parts, 2, "its commit is \"0123\"");
    writeText(path, text.substr(0, text.size() / 2));
    expect(parts, 2, path + ": ends at line ");
    writeText(path, "{\"key\":" + std::string(101, '[') + std::string(101, ']') + "}");
    expect(parts, 2, path + ": nests deeper than 100 levels");
    writeText(path, "[]");
    expect(parts, 2, path + ": is damaged");
    for (const char* share : {"0/2", "3/2", "1", "1/2/3", "a/b", ""}) {
        const ProgramResult result =
            runShadowdag(directory, tinyCompare(out) + Arguments{"--part", share});
        EXPECT_EQ(result.status, 1) << share;
        EXPECT_THAT(result.err, HasSubstr("--part '" + std::string(share) + "'"));
    }
}

TEST(CompareParts, ADamagedPartIsRefusedWithItsFileNamed) {
    const TemporaryDirectory directory;
    const Arguments parts = measureParts(directory, 2);
    const std::string out = directory / "out", path = parts[0] + "/part.json",
                      text = readText(path);
    const auto expect = [&](const Arguments& of, const std::string& message) {
        SCOPED_TRACE(message);
        const ProgramResult result =
            runShadowdag(directory, Arguments{"compare", "--join", "--no-charts", "-o", out} + of);
        EXPECT_EQ(result.status, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_FALSE(std::filesystem::exists(out + "/results.json"));
        EXPECT_FALSE(std::filesystem::exists(out + "/partial"));
    };
    /// Joins with the part as `edit` leaves it.
    const auto expectEdited = [&](const auto& edit, bool sealed, const std::string& message) {
        Json part = Json::parse(text);
        edit(part);
        if (sealed)
            part["content_hash"] = partHash(part);
        writeText(path, part.dump());
        expect(parts, message);
        expect({parts[0]}, message);
        writeText(path, text);
    };
    const auto set = [](const char* key, Json value) {
        return [key, value](Json& part) { part[key] = value; };
    };
    for (const bool sealed : {false, true}) {
        expectEdited(set("part_count", 0), sealed, path + ": \"part_count\" is 0; it must be");
        expectEdited(set("part_count", 4294967295), sealed, "\"part_count\" is 4294967295;");
        expectEdited(set("part", 4294967297), sealed, path + ": \"part\" is 4294967297;");
        expectEdited(set("part", 3), sealed, path + ": \"part\" is 3;");
        expectEdited(set("part", -1), sealed, path + ": \"part\" is -1;");
        expectEdited(set("part", "1"), sealed, path + ": \"part\" is \"1\";");
    }
    const auto setRun = [](const char* key, Json value) {
        return [key, value](Json& part) { part["runs"][0][key] = value; };
    };
    expectEdited(setRun("false_shadow_count", 999), false, path + ": is damaged or was edited");
    for (const char* key : {"false_shadow_count", "scene", "time_ms", "images"})
        expectEdited(setRun(key, Json::array({1})), true, path + ": was not written by compare");
    expectEdited([](Json& part) { part.erase("files"); }, true,
                 path + ": was not written by compare");

    const std::string image =
        parts[0] + "/" + Json::parse(text)["truth_images"][0]["file"].get<std::string>();
    for (const std::string& file : {image, parts[0] + "/costs.json"}) {
        const std::string bytes = readText(file);
        writeText(file, bytes.substr(0, bytes.size() - 1) + "?");
        expect(parts, file + ": is not the file that its part wrote");
        std::filesystem::remove(file);
        expect(parts, file + ": cannot be read");
        writeText(file, bytes);
    }
    EXPECT_EQ(
        runShadowdag(directory, Arguments{"compare", "--join", "--no-charts", "-o", out} + parts)
            .status,
        0);
}

TEST(CompareParts, AValueSpelledTwoWaysIsListedTwice) {
    const TemporaryDirectory directory;
    for (const auto& [option, list] :
         {std::pair("--lod", "coverage,coverage:0.75"), std::pair("--lod", "footprint:1,footprint"),
          std::pair("--lod", "1,01"), std::pair("--bias", "1,1.0")}) {
        const ProgramResult result =
            runShadowdag(directory, tinyCompare(directory / "out") + Arguments{option, list});
        EXPECT_EQ(result.status, 1) << list;
        EXPECT_THAT(result.err, HasSubstr("is listed twice"));
    }
    writeText(directory / "e.json", "{\"lod\": [\"coverage\", \"coverage:0.75\"]}");
    const ProgramResult result =
        runShadowdag(directory, {"compare", "builtin:fail-mover", "--experiment",
                                 directory / "e.json", "-o", directory / "out"});
    EXPECT_EQ(result.status, 2);
    EXPECT_THAT(result.err,
                HasSubstr("e.json: key \"lod\" 'coverage:0.75': coverage:0.75 is listed"));
}

TEST(CompareParts, APartIsResumedOnlyAsThatPart) {
    const TemporaryDirectory directory;
    const std::string out = directory / "part";
    ASSERT_EQ(
        runShadowdag(directory, tinyCompare(out) + Arguments{"--part", "1/2", "--resume"}).status,
        0);
    std::filesystem::create_directories(out + "/partial");
    writeText(out + "/partial/journal.json", "{\"key\": \"another\", \"parts\": {}}");
    const ProgramResult result =
        runShadowdag(directory, tinyCompare(out) + Arguments{"--part", "1/2", "--resume"});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.err, HasSubstr("belongs to another run"));
    EXPECT_TRUE(std::filesystem::exists(out + "/part.json")) << "the older part is unharmed";
}

TEST(CompareParts, APartReplacesNoOther) {
    const TemporaryDirectory directory;
    const std::string out = directory / "part";
    const Arguments first = tinyCompare(out) + Arguments{"--part", "1/2"};
    ASSERT_EQ(runShadowdag(directory, first).status, 0);
    const std::string part = readText(out + "/part.json");
    for (const char* other : {"2/2", "1/3"}) {
        const ProgramResult result =
            runShadowdag(directory, tinyCompare(out) + Arguments{"--part", other});
        EXPECT_EQ(result.status, 1) << result.err;
        EXPECT_THAT(result.err, HasSubstr("holds part 1 of 2, which this part would replace"));
        EXPECT_EQ(readText(out + "/part.json"), part);
    }
    EXPECT_EQ(runShadowdag(directory, first).status, 0) << "itself it may";
}

} // namespace shadowdag
