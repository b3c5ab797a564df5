// SPDX-License-Identifier: Apache-2.0
// A build with --resume on disks that are full at seeded sizes: what it leaves is taken up when
// there is room. And a disk that is mounted read-only. On a tmpfs of its own, where a mount is
// permitted; faults_test.cpp has failing writes everywhere.
#include "tests/faults/fault_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>

namespace shadowdag {
namespace {

// Prints both statuses; leaves the asset in OUT and the last message in OUT.err.
constexpr const char* kScript = R"(
size=$1; out=$2; shift 2
mount -t tmpfs -o size=${size}k none "$out.disk" || exit 77
"$@" -o "$out.disk/a.svdag" >/dev/null 2>"$out.err"; full=$?
mount -t tmpfs -o remount,size=100m none "$out.disk"
"$@" -o "$out.disk/a.svdag" >/dev/null 2>"$out.err"; resumed=$?
ls "$out.disk"
cp "$out.disk/a.svdag" "$out"
echo "statuses $full $resumed"
)";

TEST(FullDisk, AResumedBuildTakesUpWhatFitted) {
    const TemporaryDirectory directory;
    const uint64_t seed = test::faultSeed();
    test::Random random(seed);
    std::cout << "seed " << seed << std::endl;
    const Arguments build = {"voxelize", "builtin:atrium", "--resolution", "1024"};
    const std::string whole = directory / "whole.svdag", out = directory / "out.svdag";
    Arguments arguments = build;
    arguments.insert(arguments.end(), {"-o", whole});
    ASSERT_EQ(runShadowdag(directory, arguments).status, 0);
    std::filesystem::create_directory(out + ".disk");
    arguments = build;
    arguments.insert(arguments.end(), {"--resume", "--checkpoint", "0.02"});
    int fullCount = 0;
    for (size_t i = 0; i < 10 * test::faultRounds(); ++i) {
        // Both the parts and the asset take some hundred KiB.
        const uint32_t size = 8 + random.below(i % 2 ? 600 : 100);
        SCOPED_TRACE(std::to_string(size) + " KiB");
        ProgramResult result;
        for (const char* spaces : {"-m", "-rm"}) { // the second needs no right but a user namespace
            result = runShadowdag(directory, arguments,
                                  {"/usr/bin/unshare", spaces, "/bin/sh", "-c", kScript, "sh",
                                   std::to_string(size), out});
            if (result.out.find("statuses") != std::string::npos)
                break;
        }
        if (result.out.find("statuses") == std::string::npos)
            GTEST_SKIP() << "no file system can be mounted here: " << result.err;
        EXPECT_THAT(result.out, testing::AnyOf(testing::HasSubstr("statuses 3 0"),
                                               testing::HasSubstr("statuses 0 0")))
            << readText(out + ".err");
        EXPECT_THAT(result.out, testing::Not(testing::HasSubstr("scratch")));
        EXPECT_TRUE(readText(out) == readText(whole));
        fullCount += result.out.find("statuses 3") != std::string::npos;
    }
    EXPECT_GT(fullCount, 0);
    test::recordFaults(10 * test::faultRounds(), seed);
}

/// Makes two files on a disk, which then is mounted read-only, and runs the program there.
constexpr const char* kReadOnlyScript = R"(
disk=$1; shift
mount -t tmpfs none "$disk" || exit 77
echo old > "$disk/a.glb"; chmod "$MODE" "$disk/a.glb"; mkdir "$disk/b"
mount -o remount,ro "$disk" || exit 77
for output in a.glb new.glb; do "$@" -o "$disk/$output" 2>&1; echo "status $?"; done
)";

TEST(ReadOnlyDisk, IsNamedAndNoRemedyThatCannotHelpIs) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory / "disk");
    for (const char* mode : {"0644", "0444"}) {
        setenv("MODE", mode, 1);
        ProgramResult result;
        for (const char* spaces : {"-m", "-rm"}) {
            result = runShadowdag(directory, {"scene", "fail-acne"},
                                  {"/usr/bin/unshare", spaces, "/bin/sh", "-c", kReadOnlyScript,
                                   "sh", directory / "disk"});
            if (result.out.find("status") != std::string::npos)
                break;
        }
        if (result.out.find("status") == std::string::npos)
            GTEST_SKIP() << "no file system can be mounted here: " << result.err;
        EXPECT_THAT(result.out, testing::ContainsRegex("a.glb': its file system is mounted "
                                                       "read-only; choose a place on another one\n"
                                                       "status 3\n.*new.glb: .*: its file system "
                                                       "is mounted read-only"));
        for (const char* vain : {"chmod", "disk space"})
            EXPECT_THAT(result.out, testing::Not(testing::HasSubstr(vain)));
    }
    unsetenv("MODE");
}

} // namespace
} // namespace shadowdag
