// SPDX-License-Identifier: Apache-2.0
#include "cuda/macros.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
constexpr bool kAssertions = true;
#else
constexpr bool kAssertions = false;
#endif

TEST(AssertDeathTest, FalseConditionAbortsAndPrintsItsTextAndPlace) {
    if (!kAssertions)
        GTEST_SKIP() << "built without SDAG_ASSERTIONS";
    const int one = 1;
    SDAG_ASSERT(one == 1);
    EXPECT_DEATH(SDAG_ASSERT(one == 2), "macros_test.cpp:.*assertion failed: one == 2");
}

TEST(Assert, ConditionIsEvaluatedOnceOrNotAtAll) {
    int count = 0;
    SDAG_ASSERT(++count > 0);
    EXPECT_EQ(count, kAssertions ? 1 : 0);
}

} // namespace
} // namespace shadowdag
