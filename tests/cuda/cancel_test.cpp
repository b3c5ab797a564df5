// SPDX-License-Identifier: Apache-2.0
#include "cuda/cancel.h"

#include "cuda/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace shadowdag {

namespace {

std::atomic<int> pollCount, nestedCount;
std::atomic<double> largest;

struct PollGuard {
    explicit PollGuard(void (*poll)(double)) { setCpuPoll(poll); }
    ~PollGuard() { setCpuPoll(nullptr); }
};

} // namespace

TEST(CpuPoll, AnExceptionFromItEndsALoopAndIsRethrown) {
    pollCount = 0;
    const PollGuard guard([](double) {
        if (++pollCount == 5)
            throw std::runtime_error("enough");
    });
    std::atomic<int> ranges{0};
    EXPECT_THROW(cpuParallelRanges(1000, 1, [&](size_t, size_t) { ++ranges; }), std::runtime_error);
    EXPECT_LT(ranges, 1000);
    EXPECT_NO_THROW(cpuParallelRanges(1000, 1, [](size_t, size_t) {}));
    pollCount = 4;
    EXPECT_THROW(cpuParallelRanges(1, 1, [&](size_t, size_t) {}), std::runtime_error);
    pollCount = 4;
    EXPECT_THROW(pollCpu(), std::runtime_error);
}

TEST(CpuPoll, IsToldTheFinishedFractionOfTheOutermostLoop) {
    pollCount = nestedCount = 0;
    largest = 0;
    const PollGuard guard([](double fraction) {
        ++(fraction < 0 ? nestedCount : pollCount);
        double seen = largest;
        while (fraction > seen && !largest.compare_exchange_weak(seen, fraction)) {
        }
    });
    cpuParallelRanges(10, 1, [](size_t, size_t) {
        cpuParallelRanges(3, 1, [](size_t, size_t) {});
        pollCpu();
    });
    EXPECT_EQ(pollCount, 10);
    EXPECT_EQ(nestedCount, 40);
    EXPECT_GE(largest, 0.5);
    EXPECT_LT(largest, 1.0);
}

} // namespace shadowdag
