// SPDX-License-Identifier: Apache-2.0
// Tests the integer reference with cases worked out by hand.
#include "tests/voxel/exact_geometry.h"

#include <gtest/gtest.h>

namespace shadowdag::exact {
namespace {

TEST(ExactGeometry, ScaledKeepsEveryBitOfAFloat) {
    EXPECT_EQ(scaled(0.75, 2), 3);
    EXPECT_EQ(scaled(-1.5, 1), -3);
    EXPECT_EQ(scaled(std::ldexp(1.0, -149), 149), 1);
    EXPECT_EQ(scaled(std::ldexp(1.0, 100), 149), Int(1) << 249);
    EXPECT_THROW(scaled(0.75, 1), std::runtime_error);
}

TEST(ExactGeometry, HullTouchesBoxCountsTies) {
    const Point lo{0, 0, 0}, hi{2, 2, 2};
    EXPECT_TRUE(hullTouchesBox({{2, 2, 2}}, lo, hi));
    EXPECT_FALSE(hullTouchesBox({{2, 2, 3}}, lo, hi));
    EXPECT_TRUE(hullTouchesBox({{4, 0, 1}, {0, 4, 1}}, lo, hi));  // through the edge (2, 2, *)
    EXPECT_FALSE(hullTouchesBox({{5, 0, 1}, {0, 5, 1}}, lo, hi)); // past it
    EXPECT_TRUE(hullTouchesBox({{6, 0, 0}, {0, 6, 0}, {0, 0, 6}}, lo,
                               hi)); // plane x + y + z = 6 at the corner
    EXPECT_FALSE(hullTouchesBox({{7, 0, 0}, {0, 7, 0}, {0, 0, 7}}, lo, hi));   // beyond it
    EXPECT_TRUE(hullTouchesBox({{-9, -9, 1}, {9, -9, 1}, {0, 9, 1}}, lo, hi)); // around it
    EXPECT_FALSE(hullTouchesBox({{-1, 4, 0}, {4, 4, 0}, {4, -1, 3}}, {-9, -9, -9}, {0, 0, -1}));
}

TEST(ExactGeometry, SegmentMeetsTriangleCountsTies) {
    const std::vector<Point> t{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    EXPECT_TRUE(segmentMeetsTriangle({1, 1, -1}, {1, 1, 1}, t));
    EXPECT_TRUE(segmentMeetsTriangle({2, 2, -1}, {2, 2, 1}, t));  // on the long edge
    EXPECT_FALSE(segmentMeetsTriangle({2, 3, -1}, {2, 3, 1}, t)); // beyond it
    EXPECT_TRUE(segmentMeetsTriangle({1, 1, 0}, {1, 1, 1}, t));   // ends on it
    EXPECT_FALSE(segmentMeetsTriangle({1, 1, 1}, {1, 1, 2}, t));  // ends before it
    EXPECT_TRUE(segmentMeetsTriangle({-1, 1, 0}, {5, 1, 0}, t));  // in its plane, across
    EXPECT_FALSE(segmentMeetsTriangle({3, 3, 0}, {5, 1, 0}, t));  // in its plane, beside
    EXPECT_FALSE(segmentMeetsTriangle({1, 1, 1}, {5, 1, 1}, t));  // parallel above
}

} // namespace
} // namespace shadowdag::exact
