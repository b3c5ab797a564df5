// SPDX-License-Identifier: Apache-2.0
// voxelize and merge through the built program.
#include "tests/tools/program/end_by_signal.h"
#include "tests/tools/program/program_refusals.h"
#include "voxel/asset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

namespace shadowdag {
namespace {

using testing::HasSubstr;

const std::string kScene = "builtin:atrium";

/// Builds the parts 1..count of the scene and returns their paths.
Arguments buildParts(const TemporaryDirectory& directory, int count,
                     const std::string& resolution) {
    Arguments paths;
    for (int k = 1; k <= count; ++k) {
        paths.push_back(directory / ("p" + std::to_string(k) + ".svpart"));
        const ProgramResult result = runShadowdag(
            directory, {"voxelize", kScene, "-o", paths.back(), "--resolution", resolution,
                        "--part", std::to_string(k) + "/" + std::to_string(count), "--json"});
        EXPECT_EQ(result.status, 0) << result.err;
        for (const char* key : {"part", "part_count", "task_count", "voxel_count", "part_bytes",
                                "wall_s", "cpu_s", "peak_rss_bytes", "provenance"})
            EXPECT_TRUE(result.json().contains(key)) << key;
        EXPECT_EQ(result.json()["part"], k);
        EXPECT_EQ(result.json()["part_bytes"], std::filesystem::file_size(paths.back()));
    }
    return paths;
}

TEST(ProgramVoxelize, MergedPartsAreTheAssetOfOneBuildBitForBit) {
    const TemporaryDirectory directory;
    const std::string whole = directory / "whole.svdag", merged = directory / "merged.svdag";
    ASSERT_EQ(
        runShadowdag(directory, {"voxelize", kScene, "-o", whole, "--resolution", "1024"}).status,
        0);
    const Arguments parts = buildParts(directory, 3, "1024");
    const ProgramResult result =
        runShadowdag(directory, {"merge", parts[2], parts[0], parts[1], "-o", merged, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["part_count"], 3);
    EXPECT_EQ(result.json()["asset_bytes"], std::filesystem::file_size(merged));
    EXPECT_TRUE(readText(merged) == readText(whole));
}

TEST(ProgramVoxelize, MergeReportsMissingForeignAndDamagedPartsAndWritesNothing) {
    const TemporaryDirectory directory;
    const std::string out = directory / "a.svdag";
    const Arguments parts = buildParts(directory, 2, "256");
    const std::string coarse = directory / "coarse.svpart", damaged = directory / "damaged.svpart";
    ASSERT_EQ(runShadowdag(directory, {"voxelize", kScene, "-o", coarse, "--resolution", "128",
                                       "--part", "2/2"})
                  .status,
              0);
    std::string bytes = readText(parts[1]);
    bytes[bytes.size() / 2] ^= 1;
    writeText(damaged, bytes);
    expectRefused(
        directory,
        {{{"merge", "-o", out}, 1, "required"},
         {{"merge", parts[0], parts[1], "-o", directory / "a.vox"}, 1, ".svdag"},
         {{"merge", parts[0], "-o", out}, 2, "number 2 is missing"},
         {{"merge", parts[0], parts[1], parts[1], "-o", out}, 2, "p2.svpart: is part 2 of 2"},
         {{"merge", parts[0], coarse, "-o", out}, 2, "coarse.svpart: belongs to another build"},
         {{"merge", parts[0], damaged, "-o", out}, 2, "damaged.svpart"},
         {{"merge", parts[0], directory / "none.svpart", "-o", out}, 2, "none.svpart"}});
    EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ProgramVoxelize, WrongOptionsAreNamed) {
    const TemporaryDirectory directory;
    const std::string dag = directory / "a.svdag", part = directory / "a.svpart";
    expectRefused(
        directory,
        {{{"voxelize", kScene, "-o", part}, 1, "assets are .svdag files"},
         {{"voxelize", kScene, "-o", dag, "--part", "1/2"}, 1, "the output is an .svpart file"},
         {{"voxelize", kScene, "-o", part, "--part", "3/2"}, 1, "--part '3/2': must be K/N"},
         {{"voxelize", kScene, "-o", part, "--part", "0/2"}, 1, "--part '0/2'"},
         {{"voxelize", kScene, "-o", part, "--part", "1/2/3"}, 1, "--part '1/2/3'"},
         {{"voxelize", kScene, "-o", part, "--part", "1/70000"}, 1, "at most 65536"},
         {{"voxelize", kScene, "-o", part, "--part", ""}, 1, "--part ''"},
         {{"voxelize", kScene, "-o", dag, "--part", ""}, 1, "--part ''"},
         {{"voxelize", kScene, "-o", dag, "--memory-limit", ""}, 1, "--memory-limit ''"},
         {{"merge", part, "-o", dag, "--memory-limit", ""}, 1, "--memory-limit ''"},
         {{"voxelize", kScene, "-o", dag, "--memory-limit", "lots"}, 1, "--memory-limit 'lots'"},
         {{"voxelize", kScene, "-o", dag, "--memory-limit", "1M"}, 1, "must be 16M or more"},
         {{"voxelize", kScene, "-o", dag, "--packing", "tight"}, 1, "must be fast or compact"},
         {{"voxelize", kScene, "-o", part, "--part", "1/2", "--packing", "fast"},
          1,
          "use it with merge"},
         {{"voxelize", kScene, "-o", dag, "--checkpoint", "5"}, 1, "--checkpoint is for --resume"},
         {{"voxelize", kScene, "-o", dag, "--resume", "--checkpoint", "-1"},
          1,
          "--checkpoint '-1'"},
         {{"merge", part, "-o", dag, "--memory-limit", "1"}, 1, "must be 16M or more"},
         {{"voxelize", kScene, "-o", dag, "--resolution", "4096.5"}, 1, "the nearest is 4096"},
         {{"voxelize", kScene, "-o", dag, "--resolution", "1.5e3"},
          1,
          "the nearest are 1024 and 2048"}});
    EXPECT_FALSE(std::filesystem::exists(dag));
    EXPECT_FALSE(std::filesystem::exists(part));
}

TEST(ProgramVoxelize, AMemoryLimitIsKeptByABuildThatNeedsMoreWithoutIt) {
    if (!std::filesystem::exists("/usr/bin/time"))
        GTEST_SKIP() << "/usr/bin/time is not installed";
    const TemporaryDirectory directory;
    const std::string free = directory / "free.svdag", held = directory / "held.svdag",
                      times = directory / "time.txt";
    const Arguments build = {"voxelize", kScene, "--resolution", "4096", "--json", "-o"};
    const auto with = [&](Arguments more) {
        more.insert(more.begin(), build.begin(), build.end());
        return more;
    };
    const auto timed = [&](const Arguments& more) {
        return runShadowdag(directory, with(more), {"/usr/bin/time", "-v", "-o", times});
    };
    const auto peakKib = [&] {
        const std::string text = readText(times), what = "Maximum resident set size (kbytes): ";
        return std::stol(text.substr(text.find(what) + what.size()));
    };
    constexpr long kLimitMib = 92;
    const ProgramResult limited = timed({held, "--memory-limit", std::to_string(kLimitMib) + "M"});
    ASSERT_EQ(limited.status, 0) << limited.err;
    EXPECT_LE(peakKib(), kLimitMib * 1024);
    const ProgramResult unlimited = timed({free});
    ASSERT_EQ(unlimited.status, 0) << unlimited.err;
    EXPECT_GT(peakKib(), kLimitMib * 1024 * 9 / 8);
    EXPECT_TRUE(readText(held) == readText(free));
    for (const char* key : {"voxel_count", "node_counts", "svo_node_counts", "leaf_count",
                            "asset_bytes", "traced_bytes"})
        EXPECT_EQ(limited.json()[key], unlimited.json()[key]) << key;
    EXPECT_FALSE(std::filesystem::exists(held + ".scratch"));

    const std::string fast = directory / "fast.svdag";
    ASSERT_EQ(runShadowdag(directory, with({fast, "--packing", "fast"})).status, 0);
    EXPECT_GT(std::filesystem::file_size(fast), std::filesystem::file_size(free));
    EXPECT_TRUE(readAsset(fast).dag.words == readAsset(free).dag.words);

    const ProgramResult small =
        runShadowdag(directory, with({directory / "small.svdag", "--memory-limit", "32M"}));
    EXPECT_EQ(small.status, 3);
    EXPECT_THAT(small.err, HasSubstr("under --memory-limit 32M needs more than "));
    EXPECT_FALSE(std::filesystem::exists(directory / "small.svdag"));
    EXPECT_FALSE(std::filesystem::exists(directory / "small.svdag.scratch"));
}

TEST(ProgramVoxelize, AKilledMergeDoesNotHinderTheNext) {
    const TemporaryDirectory directory;
    Arguments merge = buildParts(directory, 2, "1024");
    const std::string merged = directory / "merged.svdag";
    const std::filesystem::path scratch = merged + ".scratch";
    merge.insert(merge.begin(), "merge");
    merge.insert(merge.end(), {"-o", merged, "--memory-limit", "1G"});
    const pid_t child = startProgram(directory, merge, directory / "out", directory / "err");
    while (!std::filesystem::exists(scratch) && kill(child, 0) == 0 &&
           !std::filesystem::exists(merged))
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, SIGKILL);
    waitForProgram(child);
    std::filesystem::create_directories(scratch);
    writeText((scratch / "level-2.nodes").string(), "half");
    const ProgramResult again = runShadowdag(directory, merge);
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_FALSE(std::filesystem::exists(scratch));
    // What voxelize --resume can still use is not merge's to remove.
    std::filesystem::create_directory(scratch);
    writeText((scratch / "00000000.svpart").string(), "part");
    expectRefused(directory, {{merge, 1, "continue it with voxelize --resume"}});
    EXPECT_EQ(readText((scratch / "00000000.svpart").string()), "part");
}

TEST(ProgramVoxelize, ABuildWithoutAFolderRemovesTheOneOfAKilledBuildOrSaysThatItStays) {
    const TemporaryDirectory directory;
    const std::string output = directory / "a.svdag";
    const std::filesystem::path scratch = output + ".scratch";
    Arguments merge = buildParts(directory, 2, "64");
    merge.insert(merge.begin(), "merge");
    merge.insert(merge.end(), {"-o", output});
    for (const Arguments& build :
         {Arguments{"voxelize", kScene, "-o", output, "--resolution", "64"}, merge}) {
        std::filesystem::create_directory(scratch);
        for (const char* name : {"lock", "level-2.nodes", "00000001.svpart.tmp-1-0"})
            writeText((scratch / name).string(), "half");
        const ProgramResult removing = runShadowdag(directory, build);
        EXPECT_EQ(removing.status, 0) << removing.err;
        EXPECT_EQ(removing.err, "");
        EXPECT_FALSE(std::filesystem::exists(scratch));
        std::filesystem::create_directory(scratch);
        writeText((scratch / "00000000.svpart").string(), "part");
        const ProgramResult saying = runShadowdag(directory, build);
        EXPECT_EQ(saying.status, 0) << saying.err;
        EXPECT_THAT(saying.err, HasSubstr("warning: " + scratch.string() +
                                          " holds the files of an unfinished voxelize"));
        EXPECT_EQ(readText((scratch / "00000000.svpart").string()), "part");
        std::filesystem::remove_all(scratch);
    }
}

TEST(ProgramVoxelize, AKilledBuildIsResumedToTheSameFile) {
    const TemporaryDirectory directory;
    const std::string whole = directory / "whole.svdag", killed = directory / "killed.svdag";
    ASSERT_EQ(
        runShadowdag(directory, {"voxelize", kScene, "-o", whole, "--resolution", "1024"}).status,
        0);
    const unsigned seed = std::random_device()();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Arguments resume = {"voxelize", kScene,     "-o",           killed, "--resolution",
                              "1024",     "--resume", "--checkpoint", "0.02"};
    for (int i = 0; i < 6; ++i) {
        const pid_t child = startProgram(directory, resume, directory / "out", directory / "err");
        std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 400));
        kill(child, SIGKILL);
        waitForProgram(child);
        if (std::filesystem::exists(killed)) { // it was done before
            EXPECT_TRUE(readText(killed) == readText(whole));
            std::filesystem::remove(killed);
        }
    }
    const ProgramResult last = runShadowdag(directory, resume);
    ASSERT_EQ(last.status, 0) << last.err;
    EXPECT_TRUE(readText(killed) == readText(whole));
    EXPECT_FALSE(std::filesystem::exists(killed + ".scratch"));
}

TEST(ProgramVoxelize, AFolderOfAnotherBuildIsDescribedWithWhatToDo) {
    const TemporaryDirectory directory;
    const std::string output = directory / "a.svdag", scratch = output + ".scratch";
    std::filesystem::create_directory(scratch);
    const Arguments parts = buildParts(directory, 2, "64");
    std::filesystem::copy_file(parts[0], scratch + "/00000000.svpart");
    const std::string other = " holds the files of an unfinished voxelize, another build, of " +
                              std::string(kScene) + " at 64^3: resolution 64 against 32; delete ";
    Arguments merge = buildParts(directory, 2, "32");
    merge.insert(merge.begin(), {"merge", "-o", output, "--memory-limit", "1G"});
    const Arguments voxelize = {"voxelize", kScene, "-o", output, "--resolution", "32"};
    for (const char* way : {"--resume", "--memory-limit=1G"}) {
        Arguments build = voxelize;
        build.emplace_back(way);
        expectRefused(directory, {{build, 1, scratch + other}});
    }
    expectRefused(directory, {{merge, 1, scratch + other}});
    const ProgramResult built = runShadowdag(directory, voxelize);
    EXPECT_EQ(built.status, 0) << built.err;
    EXPECT_THAT(built.err, HasSubstr("warning: " + scratch + other));
}

TEST(ProgramVoxelize, AnInterruptAdvisesToResumeOnlyWhereFinishedPartsStay) {
    const TemporaryDirectory directory;
    const std::string output = directory / "a.svdag", scratch = output + ".scratch";
    const auto hasPart = [&] {
        std::error_code ignored;
        for (const auto& entry : std::filesystem::directory_iterator(scratch, ignored))
            if (entry.path().extension() == ".svpart")
                return true;
        return false;
    };
    struct Case {
        Arguments more;
        bool waitsForPart, isAdvised;
    };
    for (const Case& build : {Case{{"--resume", "--checkpoint", "1000"}, false, false},
                              Case{{"--memory-limit", "1G", "--checkpoint", "0.05"}, true, false},
                              Case{{"--resume", "--checkpoint", "0.05"}, true, true},
                              Case{{"--resume", "--checkpoint", "1000"}, true, true}}) {
        Arguments arguments = {"voxelize", kScene, "-o", output, "--resolution", "16384"};
        arguments.insert(arguments.end(), build.more.begin(), build.more.end());
        const pid_t child =
            startProgram(directory, arguments, directory / "out", directory / "err");
        for (int i = 0; i < 400 && build.waitsForPart && !hasPart(); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        kill(child, SIGTERM);
        EXPECT_EQ(waitForProgram(child), 128 + SIGTERM) << readText(directory / "err");
        EXPECT_EQ(readText(directory / "err").find("the same command with --resume") !=
                      std::string::npos,
                  build.isAdvised)
            << readText(directory / "err");
        EXPECT_EQ(hasPart(), build.isAdvised);
    }
}

TEST(ProgramVoxelize, AnInterruptEndsItSoonAndLeavesNoFile) {
    const TemporaryDirectory directory;
    for (const bool isLimited : {false, true}) {
        const std::string output = directory / "a.svdag";
        Arguments build = {"voxelize", kScene, "-o", output, "--resolution", "16384"};
        if (isLimited)
            build.insert(build.end(), {"--memory-limit", "1G"});
        const pid_t child = startProgram(directory, build, directory / "out", directory / "err");
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        const test::EndBySignal end = test::endBySignal(child, SIGINT);
        EXPECT_EQ(end.status, 128 + SIGINT);
        EXPECT_LT(end.seconds, 0.5) << end;
        EXPECT_THAT(readText(directory / "err"), HasSubstr("interrupted"));
        for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
            EXPECT_THAT(entry.path().filename().string(), testing::AnyOf("out", "err"));
    }
}

} // namespace
} // namespace shadowdag
