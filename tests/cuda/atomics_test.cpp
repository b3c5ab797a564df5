// SPDX-License-Identifier: Apache-2.0
#include "cuda/atomics.h"

#include "cuda/parallel_for.h"

#include <gtest/gtest.h>

#include <vector>

namespace shadowdag {
namespace {

TEST(Atomics, ReturnThePreviousValue) {
    uint32_t word = 5;
    EXPECT_EQ(atomicAddRelaxed(&word, 2), 5u);
    EXPECT_EQ(word, 7u);
    EXPECT_EQ(atomicOrRelaxed(&word, 8), 7u);
    EXPECT_EQ(word, 15u);
    EXPECT_EQ(atomicOrRelaxed(&word, 3), 15u); // nothing new: the path without a write
    EXPECT_EQ(word, 15u);
    EXPECT_EQ(atomicMaxRelaxed(&word, 9), 15u);
    EXPECT_EQ(word, 15u);
    EXPECT_EQ(atomicMaxRelaxed(&word, 20), 15u);
    EXPECT_EQ(word, 20u);
    EXPECT_EQ(atomicMinRelaxed(&word, 30), 20u);
    EXPECT_EQ(word, 20u);
    EXPECT_EQ(atomicMinRelaxed(&word, 1), 20u);
    EXPECT_EQ(word, 1u);
    uint64_t wide = ~uint64_t(0);
    EXPECT_EQ(atomicMinRelaxed(&wide, uint64_t(1) << 40), ~uint64_t(0));
    EXPECT_EQ(wide, uint64_t(1) << 40);
}

TEST(Atomics, OrAndRaiseOnceLeaveWhatTheOthersLeave) {
    uint32_t word = 5;
    orOnceRelaxed(&word, 4); // nothing new
    EXPECT_EQ(word, 5u);
    orOnceRelaxed(&word, 6); // partly new
    EXPECT_EQ(word, 7u);
    raiseOnceRelaxed(&word, 6);
    raiseOnceRelaxed(&word, 7);
    EXPECT_EQ(word, 7u);
    raiseOnceRelaxed(&word, 8);
    EXPECT_EQ(word, 8u);
}

TEST(Atomics, LoseNothingUnderContention) {
    constexpr size_t kCount = 200'000;
    setThreadCount(4);
    uint32_t sum = 0, bits = 0, bitsOnce = 0, largest = 0, largestOnce = 0, smallest = ~0u;
    uint64_t smallestWide = ~uint64_t(0);
    parallelFor<CpuTag>(
        kCount,
        [&](size_t i) {
            atomicAddRelaxed(&sum, 1);
            atomicOrRelaxed(&bits, 1u << (i % 32));
            orOnceRelaxed(&bitsOnce, 1u << (i % 32));
            atomicMaxRelaxed(&largest, uint32_t(i * 2654435761u));
            raiseOnceRelaxed(&largestOnce, uint32_t(i * 2654435761u));
            atomicMinRelaxed(&smallest, uint32_t(i * 2654435761u + 77));
            atomicMinRelaxed(&smallestWide, kCount - i + (uint64_t(1) << 33));
        },
        16);
    setThreadCount(0);
    uint32_t largestExpected = 0, smallestExpected = ~0u;
    for (size_t i = 0; i < kCount; ++i) {
        largestExpected = std::max(largestExpected, uint32_t(i * 2654435761u));
        smallestExpected = std::min(smallestExpected, uint32_t(i * 2654435761u + 77));
    }
    EXPECT_EQ(sum, kCount);
    EXPECT_EQ(bits, ~0u);
    EXPECT_EQ(bitsOnce, ~0u);
    EXPECT_EQ(largest, largestExpected);
    EXPECT_EQ(largestOnce, largestExpected);
    EXPECT_EQ(smallest, smallestExpected);
    EXPECT_EQ(smallestWide, (uint64_t(1) << 33) + 1);
}

} // namespace
} // namespace shadowdag
