// SPDX-License-Identifier: Apache-2.0
// What only warps do (cuda/warp.h, sharePartsKernel), beside the CPU's loops of the same results.
#include "cuda/warp.h"

#include "cuda/split_work.h"
#include "tests/cuda/backends.h"
#include "tests/cuda/probe_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace shadowdag {
namespace {

class WarpsOn : public OnBackend {};

TEST_P(WarpsOn, GiveEveryLaneOfEveryWantedPartOnce) {
    for (const uint32_t count : {1u, 31u, 5000u})
        for (const uint32_t period : {1u, 3u, 40u}) {
            SplitWork work(GetParam(), "test/split", count);
            const SplitWorkView list = work.begin();
            runPass(GetParam(), AddParts{list, count});
            Buffer<uint32_t> visits(GetParam(), "test/visits", size_t(count) * 7 * kGroupLanes);
            visits.fill(0);
            const VisitParts visit{list, visits.view(), period};
            runPass(GetParam(), visit);
            const std::vector<uint32_t> found = visits.download();
            size_t wrong = 0;
            for (uint32_t i = 0; i < found.size(); ++i) {
                const uint32_t item = i / kGroupLanes / 7, part = i / kGroupLanes % 7;
                wrong += found[i] !=
                         uint32_t(part < AddParts::partsOf(item) && visit.isWanted(item, part));
            }
            EXPECT_EQ(wrong, 0u) << count << " items, every " << period << "th part";
        }
}

TEST_P(WarpsOn, SortListsOfEveryLength) {
    const unsigned seed = 20'261;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::vector<uint32_t> starts{0}, numbers;
    for (uint32_t length = 0; length < 200; ++length) {
        for (uint32_t i = 0; i < length; ++i)
            numbers.push_back(length % 2 ? random() : random() % 10); // many equal
        starts.push_back(uint32_t(numbers.size()));
    }
    Buffer<uint32_t> start(GetParam(), "test/starts"), sorted(GetParam(), "test/numbers");
    start.upload(starts);
    sorted.upload(numbers);
    runPass(GetParam(), SortLists{std::as_const(start).view(), sorted.view()});
    for (size_t list = 0; list + 1 < starts.size(); ++list)
        std::sort(numbers.begin() + starts[list], numbers.begin() + starts[list + 1]);
    EXPECT_EQ(sorted.download(), numbers);
}

TEST(Warps, FindTheRowAndTheRectangleOfAnElement) {
    for (uint32_t width = 1; width <= 1024; ++width)
        for (uint32_t i = 0; i < 1024; ++i)
            ASSERT_EQ(rowOf(i, 1.0f / float(width)), int32_t(i / width)) << i << " of " << width;
    uint32_t upTo[kGroupLanes] = {}; // rectangles of 0, 3, 0, 3, ... elements
    for (uint32_t lane = 0; lane < kGroupLanes; ++lane)
        upTo[lane] = (lane + 1) / 2 * 3;
    for (uint32_t i = 0; i < upTo[kGroupLanes - 1]; ++i)
        ASSERT_EQ(firstAbove(upTo, i), 2 * (i / 3) + 1) << i;
}

INSTANTIATE_TEST_SUITE_P(Both, WarpsOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
