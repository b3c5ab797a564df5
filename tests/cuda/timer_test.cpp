// SPDX-License-Identifier: Apache-2.0
#include "cuda/timer.h"

#include "cuda/buffer.h"
#include "cuda/error.h"
#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace shadowdag {
namespace {

TEST(StageTimes, KeepTheOrderOfFirstEndsAndAddUp) {
    StageTimes times;
    times.add("cull", 1.5);
    times.add("rasterize", 2.0);
    times.add("cull", 0.5);
    ASSERT_EQ(times.stagesMs.size(), 2u);
    EXPECT_EQ(times.stagesMs[0], std::make_pair(std::string("cull"), 2.0));
    EXPECT_EQ(times.stagesMs[1], std::make_pair(std::string("rasterize"), 2.0));
    EXPECT_EQ(times.totalMs(), 4.0);
}

TEST(StageTimer, MeasuresAtLeastWhatPassed) {
    StageTimes times;
    {
        const StageTimer timer(Backend::kCpu, times, "sleep");
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ASSERT_EQ(times.stagesMs.size(), 1u);
    EXPECT_GE(times.stagesMs[0].second, 20.0);
    EXPECT_LT(times.stagesMs[0].second, 20'000.0); // milliseconds, not microseconds
}

TEST(StageTimer, LetsAnotherExceptionPassAndAddsNoTime) {
    StageTimes times;
    try {
        const StageTimer timer(Backend::kCpu, times, "draw");
        throw std::logic_error("first");
    } catch (const std::logic_error&) {
    }
    EXPECT_TRUE(times.stagesMs.empty());
}

// As the device's stages come in: places first, times at settle().
TEST(StageTimes, SettleAddsPendingTimesOnceInTheirPlaces) {
    StageTimes times;
    int waitCount = 0;
    times.addLater("draw", [&] {
        ++waitCount;
        return 2.5;
    });
    times.add("host", 1.0);
    times.addLater("draw", [&] {
        ++waitCount;
        return 0.5;
    });
    EXPECT_EQ(waitCount, 0);
    const std::vector<std::pair<std::string, double>> unsettled{{"draw", 0.0}, {"host", 1.0}};
    EXPECT_EQ(times.stagesMs, unsettled);
    times.settle();
    times.settle();
    EXPECT_EQ(waitCount, 2);
    const std::vector<std::pair<std::string, double>> settled{{"draw", 3.0}, {"host", 1.0}};
    EXPECT_EQ(times.stagesMs, settled);
}

TEST(StageTimes, SettleRethrowsFailuresAndAddsNoTimeForThem) {
    StageTimes times;
    times.addLater("draw", [] { return 1.0; });
    times.addLater("shade", []() -> double { throw Error(ErrorKind::kDevice, "a kernel failed"); });
    EXPECT_THROW(times.settle(), Error);
    EXPECT_EQ(times.stageMs("draw"), 1.0);
    EXPECT_EQ(times.stageMs("shade"), 0.0);
    times.settle(); // fetches no time twice
    EXPECT_EQ(times.totalMs(), 1.0);
}

class StageTimerOn : public OnBackend {};

// Queueing fills takes a device's host microseconds; the fills take what memory can do, of which
// there is none of 50 TB a second.
TEST_P(StageTimerOn, CoversTheWorkQueuedWithinItOnly) {
    constexpr int kFillCount = 10;
    StageTimes times;
    Buffer<uint32_t> words(
        GetParam(), "test/words",
        size_t(1) << (GetParam() == Backend::kCuda && !isPlayedByHost(GetParam()) ? 28 : 22));
    {
        const StageTimer timer(GetParam(), times, "fills");
        for (int i = 0; i < kFillCount; ++i)
            words.fill(i);
    }
    { const StageTimer timer(GetParam(), times, "nothing"); }
    times.settle();
    const double leastMs = double(kFillCount) * double(words.bytes()) / 50e12 * 1e3;
    EXPECT_GT(times.stageMs("fills"), leastMs);
    EXPECT_LT(times.stageMs("nothing"), times.stageMs("fills") / 4);
}

INSTANTIATE_TEST_SUITE_P(Both, StageTimerOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
