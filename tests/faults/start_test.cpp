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
    for (int megabytes = 100; megabytes <= 300; megabytes += 5) {
        const ProgramResult result =
            runShadowdag(directory, {"--version"},
                         {"/usr/bin/prlimit", "--as=" + std::to_string(megabytes) + "000000"});
        ++counts[result.status];
        EXPECT_THAT(result.status, testing::AnyOf(0, 3, kLoader)) << megabytes << result.err;
        if (result.status == 3) {
            EXPECT_THAT(result.err, testing::StartsWith("shadowdag: error: ")) << megabytes;
        }
    }
    EXPECT_GT(counts[0], 0);
    EXPECT_GT(counts[3], 0);
}

} // namespace
} // namespace shadowdag
