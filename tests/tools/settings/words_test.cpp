// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/words.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(Words, OneHasNoPlural) {
    EXPECT_EQ(countText(0, "row"), "0 rows");
    EXPECT_EQ(countText(1, "row"), "1 row");
    EXPECT_EQ(countText(2, "row"), "2 rows");
}

TEST(Words, AlternativesEndWithOr) {
    EXPECT_EQ(orText({}), "");
    EXPECT_EQ(orText({"a"}), "a");
    EXPECT_EQ(orText({"a", "b"}), "a or b");
    EXPECT_EQ(orText({"a", "b", "c"}), "a, b or c");
}

} // namespace
} // namespace shadowdag
