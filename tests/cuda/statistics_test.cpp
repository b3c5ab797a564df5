// SPDX-License-Identifier: Apache-2.0
#include "cuda/statistics.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(Median, OfAnOddCountIsTheMiddleValue) {
    EXPECT_EQ(median({7.0}), 7.0);
    EXPECT_EQ(median({9.0, -1.0, 4.0}), 4.0);
}

TEST(Median, OfAnEvenCountIsTheMeanOfTheTwoMiddleValues) {
    EXPECT_EQ(median({8.0, 2.0}), 5.0);
    EXPECT_EQ(median({100.0, 1.0, 4.0, 2.0}), 3.0);
}

} // namespace
} // namespace shadowdag
