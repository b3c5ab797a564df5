// SPDX-License-Identifier: Apache-2.0
#include "cuda/parallel_for.h"

#include "cuda/atomics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace shadowdag {
namespace {

// More threads than most machines have cores, and one: results may not depend on it.
constexpr int kThreadCounts[] = {1, 2, 5};

class ParallelFor : public testing::Test {
protected:
    ~ParallelFor() override { setThreadCount(0); }
};

TEST_F(ParallelFor, VisitsEveryIndexExactlyOnce) {
    for (const int threads : kThreadCounts) {
        setThreadCount(threads);
        for (const size_t count : {0, 1, 255, 256, 257, 1'000, 1'048'577}) {
            for (const size_t grain : {0, 1, 256, 2'000'000}) {
                std::vector<uint32_t> visits(count);
                uint32_t* data = visits.data();
                parallelFor<CpuTag>(
                    count, [data](size_t i) { atomicAddRelaxed(&data[i], 1); }, grain);
                EXPECT_EQ(visits, std::vector<uint32_t>(count, 1)) << count << " / " << grain;
            }
        }
    }
}

TEST_F(ParallelFor, RangesDependOnCountAndGrainOnly) {
    for (const auto& [count, grain] :
         {std::pair<size_t, size_t>{100'000, 7}, {10'000, 64}, {1'000'000, 1}}) {
        std::set<std::pair<size_t, size_t>> expected;
        for (const int threads : kThreadCounts) {
            setThreadCount(threads);
            std::mutex mutex;
            std::set<std::pair<size_t, size_t>> ranges;
            cpuParallelRanges(count, grain, [&](size_t begin, size_t end) {
                const std::lock_guard lock(mutex);
                ranges.emplace(begin, end);
            });
            for (const auto& [begin, end] : ranges)
                EXPECT_TRUE(end - begin >= grain || end == count);
            if (threads == kThreadCounts[0])
                expected = ranges;
            EXPECT_EQ(ranges, expected);
        }
    }
}

TEST_F(ParallelFor, ExceptionReachesTheCallerAndTheThreadsSurvive) {
    for (const int threads : kThreadCounts) {
        setThreadCount(threads);
        EXPECT_THROW(parallelFor<CpuTag>(
                         10'000,
                         [](size_t i) {
                             if (i == 7'777)
                                 throw Error(ErrorKind::kInput, "planted");
                         },
                         16),
                     Error);
        EXPECT_THROW(cpuParallelInvoke([] {}, [] { throw Error(ErrorKind::kInput, "planted"); }),
                     Error);
        uint32_t sum = 0;
        parallelFor<CpuTag>(
            1'000, [&](size_t) { atomicAddRelaxed(&sum, 1); }, 16);
        EXPECT_EQ(sum, 1'000u);
    }
}

uint32_t countLeaves(int depth) {
    if (depth == 0)
        return 1;
    uint32_t a = 0, b = 0;
    cpuParallelInvoke([&] { a = countLeaves(depth - 1); }, [&] { b = countLeaves(depth - 1); });
    return a + b;
}

TEST_F(ParallelFor, NestedCallsFinish) {
    for (const int threads : kThreadCounts) {
        setThreadCount(threads);
        uint32_t sum = 0;
        parallelFor<CpuTag>(
            40,
            [&](size_t) {
                parallelFor<CpuTag>(
                    100, [&](size_t) { atomicAddRelaxed(&sum, 1); }, 1);
            },
            1);
        EXPECT_EQ(sum, 4'000u);
        EXPECT_EQ(countLeaves(10), 1'024u);
    }
}

TEST_F(ParallelFor, UsesNoMoreThreadsThanAllowed) {
    for (const int threads : kThreadCounts) {
        setThreadCount(threads);
        EXPECT_EQ(threadCount(), threads);
        std::mutex mutex;
        std::set<std::thread::id> seen;
        parallelFor<CpuTag>(
            2'000,
            [&](size_t) {
                const std::lock_guard lock(mutex);
                seen.insert(std::this_thread::get_id());
            },
            1);
        EXPECT_LE(seen.size(), size_t(threads));
    }
}

TEST_F(ParallelFor, ZeroThreadsMeansAllCoresAndFewerIsAUsageError) {
    setThreadCount(0);
    EXPECT_GE(threadCount(), 1);
    try {
        setThreadCount(-3);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), testing::HasSubstr("-3"));
    }
}

} // namespace
} // namespace shadowdag
