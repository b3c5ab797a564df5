// SPDX-License-Identifier: Apache-2.0
#include "cuda/split_work.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace shadowdag {
namespace {

// Item i of kItems has i % 7 + 1 parts.
constexpr uint32_t kItems = 1000;
uint32_t partsOf(uint32_t item) {
    return item % 7 + 1;
}

constexpr uint32_t kMost = 7 * kGroupLanes;

/// Counts the lanes of the parts that it wants.
struct CountVisits {
    View<uint32_t> visits; ///< kMost an item

    static bool isWanted(uint32_t item, uint32_t part) { return (item + part) % 3 != 0; }
    bool wants(const SplitItem& item, uint32_t part) const { return isWanted(item.a, part); }
    void operator()(const SplitItem& item, uint32_t part, uint32_t lane) const {
        ASSERT_LT(item.a, kItems);
        EXPECT_EQ(item.b, item.a + 5);
        EXPECT_LT(part, partsOf(item.a));
        EXPECT_LT(lane, kGroupLanes);
        atomicAddRelaxed(&visits[item.a * kMost + part * kGroupLanes + lane], 1);
    }
};

class SplitWorkOf : public testing::TestWithParam<size_t> {
protected:
    ~SplitWorkOf() override { setThreadCount(0); }
};

TEST_P(SplitWorkOf, GivesEveryLaneOfEveryPartOnceAndRefusesTheRest) {
    setThreadCount(4);
    SplitWork work(Backend::kCpu, "test/split", GetParam());
    const SplitWorkView list = work.begin();
    std::vector<uint8_t> isAdded(kItems, 0);
    parallelFor<CpuTag>(
        kItems,
        [&](size_t i) {
            uint32_t index;
            isAdded[i] = list.add(uint32_t(i), uint32_t(i) + 5, partsOf(uint32_t(i)), index);
        },
        1);
    const size_t added = size_t(std::count(isAdded.begin(), isAdded.end(), 1));
    EXPECT_EQ(added, std::min(GetParam(), size_t(kItems)));
    EXPECT_EQ(list.itemCount(), added);

    std::vector<uint32_t> visits(kItems * kMost, 0);
    parallelForParts<CpuTag>(list, CountVisits{viewOf(visits)});
    uint64_t parts = 0;
    for (uint32_t item = 0; item < kItems; ++item)
        for (uint32_t i = 0; i < kMost; ++i) {
            const bool isPart = isAdded[item] && i < partsOf(item) * kGroupLanes;
            const bool isWanted = isPart && CountVisits::isWanted(item, i / kGroupLanes);
            EXPECT_EQ(visits[item * kMost + i], uint32_t(isWanted)) << item;
            parts += isPart && i % kGroupLanes == 0;
        }
    EXPECT_EQ(list.partCount(), parts);

    // What was refused finds room the next time.
    EXPECT_EQ(work.grow(), kItems - added);
    EXPECT_GE(work.capacity(), size_t(kItems) * (GetParam() > 0));
    const SplitWorkView next = work.begin();
    EXPECT_EQ(next.partCount(), 0u);
    uint32_t index;
    for (uint32_t i = 0; i < kItems; ++i)
        EXPECT_TRUE(next.add(i, 0, 1, index));
}

INSTANTIATE_TEST_SUITE_P(Capacities, SplitWorkOf,
                         testing::Values(0u, 1u, 100u, 999u, 1000u, 5000u));

TEST(SplitWork, CountsTheLargestListWithoutOverflow) {
    SplitWork work(Backend::kCpu, "test/split", kMaxSplitItems);
    const SplitWorkView list = work.begin();
    uint32_t index;
    for (size_t i = 0; i < kMaxSplitItems; ++i)
        ASSERT_TRUE(list.add(uint32_t(i), 0, kMaxSplitParts, index));
    EXPECT_FALSE(list.add(0, 0, kMaxSplitParts, index));
    EXPECT_EQ(list.itemCount(), kMaxSplitItems);
    EXPECT_EQ(list.partCount(), uint64_t(kMaxSplitItems) * kMaxSplitParts);
    for (const uint64_t part :
         {uint64_t(0), uint64_t(kMaxSplitParts) * 77 + 5, list.partCount() - 1})
        EXPECT_EQ(list.itemOf(part).a, part / kMaxSplitParts);
    EXPECT_EQ(work.grow(), 1u);
    EXPECT_EQ(work.capacity(), kMaxSplitItems); // no more than that, ever
}

} // namespace
} // namespace shadowdag
