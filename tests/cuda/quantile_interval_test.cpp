// SPDX-License-Identifier: Apache-2.0
// Ranks against the exact binomial sums of small counts, and against simulated medians.
#include "cuda/quantile_interval.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag {
namespace {

TEST(QuantileRanks, OfTenMediansAreTheSecondAndTheNinth) {
    const QuantileRanks ranks = quantileRanks(10, 0.5);
    EXPECT_EQ(ranks.low, 1u);
    EXPECT_EQ(ranks.high, 8u);
    EXPECT_NEAR(ranks.confidence, 1.0 - 2.0 * (1 + 10) / 1024.0, 1e-12);
}

TEST(QuantileRanks, SixValuesAreTheFewestForAMedian) {
    EXPECT_NEAR(quantileRanks(6, 0.5).confidence, 1.0 - 2.0 / 64.0, 1e-12);
    for (size_t count = 1; count <= 5; ++count) {
        const QuantileRanks ranks = quantileRanks(count, 0.5);
        EXPECT_EQ(ranks.low, 0u);
        EXPECT_EQ(ranks.high, count - 1);
        EXPECT_NEAR(ranks.confidence, 1.0 - 2.0 / double(1u << count), 1e-12) << count;
        EXPECT_LT(ranks.confidence, kConfidence);
    }
}

// Conover, Practical Nonparametric Statistics, table A3: the ranks of n = 20 and 25.
TEST(QuantileRanks, AreThoseOfTheTables) {
    EXPECT_EQ(quantileRanks(20, 0.5).low, 5u);
    EXPECT_EQ(quantileRanks(20, 0.5).high, 14u);
    EXPECT_EQ(quantileRanks(25, 0.5).low, 7u);
    EXPECT_EQ(quantileRanks(25, 0.5).high, 17u);
}

// Twice 60 frames hold the 99th percentile from below only: the worst of them exceeds it with the
// probability 1 - 0.99^120.
TEST(QuantileRanks, TheWorstOfFewFramesBoundsNoPercentile) {
    const QuantileRanks ranks = quantileRanks(120, 0.99);
    EXPECT_EQ(ranks.high, 119u);
    EXPECT_LT(ranks.confidence, 1.0 - std::pow(0.99, 120));
    EXPECT_GE(ranks.confidence, 1.0 - std::pow(0.99, 120) - 0.025);
    EXPECT_GE(quantileRanks(400, 0.99).confidence, kConfidence);
}

TEST(QuantileRanks, DoNotUnderflowForManyValues) {
    const QuantileRanks ranks = quantileRanks(100000, 0.5);
    EXPECT_NEAR(double(ranks.low), 50000 - 1.96 * 0.5 * std::sqrt(100000.0), 2.0);
    EXPECT_NEAR(ranks.confidence, kConfidence, 0.01);
}

TEST(MedianInterval, IsReadOffTheSortedValues) {
    const QuantileInterval interval = medianInterval({9, 1, 8, 2, 7, 3, 6, 4, 5, 10});
    EXPECT_EQ(interval.value, 5.5);
    EXPECT_EQ(interval.low, 2);
    EXPECT_EQ(interval.high, 9);
    EXPECT_TRUE(interval.isWide());
    const QuantileInterval one = medianInterval({3});
    EXPECT_EQ(one.low, 3);
    EXPECT_EQ(one.high, 3);
    EXPECT_EQ(one.confidence, 0);
    EXPECT_FALSE(one.isWide());
}

TEST(QuantileInterval, IsTheNearestRank) {
    std::vector<double> values;
    for (int i = 1; i <= 200; ++i)
        values.push_back(201 - i);
    EXPECT_EQ(quantileInterval(values, 0.99).value, 198);
    EXPECT_EQ(quantileInterval({5}, 0.99).value, 5);
}

// Skewed values, as times are: the interval must hold the median at least as often as it says.
TEST(MedianInterval, HoldsTheMedianAsOftenAsItSays) {
    std::mt19937_64 random(1);
    std::exponential_distribution<double> skewed;
    constexpr double kMedian = 0.6931471805599453; // log 2
    int heldCount = 0;
    constexpr int kTrials = 20000;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<double> values(10);
        for (double& value : values)
            value = skewed(random);
        const QuantileInterval interval = medianInterval(values);
        heldCount += interval.low <= kMedian && kMedian <= interval.high;
    }
    EXPECT_NEAR(double(heldCount) / kTrials, 1.0 - 22.0 / 1024.0, 0.005);
}

} // namespace
} // namespace shadowdag
