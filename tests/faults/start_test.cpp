// SPDX-License-Identifier: Apache-2.0
// The program where not even its libraries get the memory and the threads that they start with.
#include "tests/faults/fault_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace shadowdag {
namespace {

TEST(Start, WithoutMemoryOrThreadsEndsWithAMessage) {
    const TemporaryDirectory directory;
    constexpr int kLoader = 127; // a library does not fit
    std::map<int, int> counts;
    // From less than the libraries take to more than all needs.
    const std::string asset = directory / "a.svdag", grid = directory / "a.vdb";
    ASSERT_EQ(runShadowdag(directory,
                           {"voxelize", "builtin:fail-wires", "-o", asset, "--resolution", "64"})
                  .status,
              0);
    for (const Arguments& arguments :
         {Arguments{"--version"}, Arguments{"export", asset, "-o", grid, "--threads", "1"}})
        for (int megabytes = 50; megabytes <= 400; megabytes += 5) {
            const ProgramResult result =
                runShadowdag(directory, arguments,
                             {"/usr/bin/timeout", "-s", "USR1", "60", // status 124: it hangs
                              "/usr/bin/prlimit", "--as=" + std::to_string(megabytes) + "000000"});
            ++counts[result.status];
            EXPECT_THAT(result.status, testing::AnyOf(0, 3, kLoader))
                << arguments[0] << megabytes << result.err;
            if (result.status == 3) {
                EXPECT_THAT(result.err, testing::StartsWith("shadowdag: error: ")) << megabytes;
            }
        }
    EXPECT_GT(counts[0], 0);
    EXPECT_GT(counts[3], 0);
}

/// Returns the words of a shell that sets its limit of the stack, in KiB, before it starts another.
std::vector<std::string> withStack(const std::string& limit) {
    return {"/bin/bash", "-c", "ulimit " + limit + "; exec \"$@\"", "bash"};
}

TEST(Start, ASmallStackIsRaisedAndOneThatMayNotBeIsRefused) {
    const TemporaryDirectory directory;
    const std::string asset = directory / "a.svdag", grid = directory / "a.vdb";
    const std::vector<std::vector<std::string>> commands = {
        {"voxelize", "builtin:fail-wires", "-o", asset, "--resolution", "64"},
        {"info", asset},
        {"export", asset, "-o", grid},
        {"import", grid, "-o", asset},
        {"render", "builtin:fail-wires", "-o", directory / "a.exr", "--size", "32x18"}};
    // 16 KiB end one start of 15 before any code of ours; 2048 are left as they are.
    for (const char* limit : {"-S -s 32", "-s 2048"})
        for (const auto& command : commands) {
            const ProgramResult result = runShadowdag(directory, command, withStack(limit));
            EXPECT_EQ(result.status, 0) << limit << ", " << command[0] << ": " << result.err;
        }
    for (const char* limit : {"-s 64", "-s 2047"})
        for (const auto& command : commands) {
            const ProgramResult result = runShadowdag(directory, command, withStack(limit));
            EXPECT_EQ(result.status, 3) << limit << ", " << command[0];
            EXPECT_EQ(result.err, "shadowdag: error: the stack is limited to less than the 2 MiB "
                                  "that the program needs; raise the limit of the shell (ulimit -s "
                                  "8192)\n");
        }
}

} // namespace
} // namespace shadowdag
