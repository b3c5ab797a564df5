// SPDX-License-Identifier: Apache-2.0
// Predicates against integers of any length, on points that are often degenerate or off by one unit
// in the last place.
#include "hybrid/judge/exact_sign.h"

#include "tests/hybrid/random.h"
#include "tests/voxel/exact_geometry.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSeed = 20260101;

/// Returns a double point times 2^`shift`, which makes it an integer.
exact::Point integers(const glm::dvec3& p, int shift = 300) {
    return {exact::scaled(p.x, shift), exact::scaled(p.y, shift), exact::scaled(p.z, shift)};
}

int rationalOrientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                        const glm::dvec3& d) {
    using namespace exact;
    const Point at = integers(d);
    return exact::sign(dot(integers(a) - at, cross(integers(b) - at, integers(c) - at)));
}

/// A point of a small lattice, a combination of three others, or one of them moved by an ulp.
glm::dvec3 nearlyDegenerate(Random& random, const glm::dvec3 (&others)[3], double scale) {
    const uint32_t kind = random.below(4);
    glm::dvec3 p;
    if (kind == 0)
        for (int a = 0; a < 3; ++a)
            p[a] = double(int(random.below(9)) - 4) * scale;
    else if (kind == 1)
        p = others[0] + (others[1] - others[0]) * random() + (others[2] - others[0]) * random();
    else
        p = 0.5 * (others[random.below(3)] + others[random.below(3)]);
    if (random.below(2) == 0) {
        const uint32_t axis = random.below(3);
        if (p[axis] != 0.0) // next to 0 products underflow
            p[axis] = std::nextafter(p[axis], random.below(2) == 0 ? -1e9 : 1e9);
    }
    return random.below(3) == 0 ? p : glm::dvec3(glm::vec3(p));
}

TEST(ExactSign, OrientationIsThatOfIntegersOfAnyLength) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    uint64_t zeroCount = 0, undecidedCount = 0;
    for (int i = 0; i < 20000; ++i) {
        const double scale = std::ldexp(1.0, int(random.below(30)) - 15) * (i % 2 ? 1.0 : 1.1);
        glm::dvec3 p[3];
        for (glm::dvec3& q : p)
            q = glm::dvec3(random.inCube(4.0)) * (random.below(2) ? scale : 1.0);
        const glm::dvec3 d = nearlyDegenerate(random, p, scale);
        const int expected = rationalOrientation(p[0], p[1], p[2], d);
        ASSERT_EQ(orientation(p[0], p[1], p[2], d), expected) << "seed " << kSeed << ", case " << i;
        const BoundedDeterminant det = boundedOrientation(p[0], p[1], p[2], d);
        zeroCount += expected == 0;
        undecidedCount += std::fabs(det.value) <= det.error;
        if (std::fabs(det.value) > det.error) {
            ASSERT_EQ(det.value > 0 ? 1 : -1, expected) << "seed " << kSeed << ", case " << i;
        }
    }
    EXPECT_GT(zeroCount, 1000u);
    EXPECT_GT(undecidedCount, zeroCount + 1000u) << "expansions must decide signs that are not 0";
}

TEST(ExactSign, OrderAlongAnAxisIsThatOfIntegersOfAnyLength) {
    Random random(kSeed);
    uint64_t zeroCount = 0;
    for (int i = 0; i < 20000; ++i) {
        const glm::dvec3 axis(random.inCube(1.0)), p(random.inCube(4.0));
        glm::dvec3 q = p + glm::cross(axis, glm::dvec3(random.inCube(1.0)));
        if (i % 3 == 0)
            q = p;
        if (i % 5 == 0)
            q.x = std::nextafter(q.x, 1e9);
        using namespace exact;
        const int expected = exact::sign(dot(integers(axis), integers(p) - integers(q)));
        ASSERT_EQ(orderAlong(axis, p, q), expected) << "seed " << kSeed << ", case " << i;
        zeroCount += expected == 0;
    }
    EXPECT_GT(zeroCount, 1000u);
}

TEST(ExactSign, ACrossingIsTheMeetingOfATriangleFromSideToSide) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    uint64_t crossedCount = 0, edgeCount = 0;
    const auto lattice = [&] {
        return glm::dvec3(double(random.below(5)), double(random.below(5)),
                          double(random.below(5)));
    };
    for (int i = 0; i < 20000; ++i) {
        const glm::dvec3 triangle[3] = {lattice(), lattice(), lattice()};
        const glm::dvec3 a = lattice(), b = lattice();
        const std::vector<exact::Point> corners = {integers(triangle[0]), integers(triangle[1]),
                                                   integers(triangle[2])};
        const bool isDegenerate = exact::isDegenerate(corners);
        ASSERT_EQ(isWithoutArea(triangle), isDegenerate) << "seed " << kSeed << ", case " << i;
        bool expected = false;
        if (!isDegenerate && a != b) {
            const int before = rationalOrientation(triangle[0], triangle[1], triangle[2], a),
                      after = rationalOrientation(triangle[0], triangle[1], triangle[2], b);
            expected = before * after < 0 &&
                       exact::segmentMeetsTriangle(integers(a), integers(b), corners);
            edgeCount += expected && rationalOrientation(a, b, triangle[0], triangle[1]) == 0;
        }
        ASSERT_EQ(crossesTriangle(a, b, triangle), expected) << "seed " << kSeed << ", case " << i;
        crossedCount += expected;
    }
    EXPECT_GT(crossedCount, 500u);
    EXPECT_GT(edgeCount, 100u);
}

TEST(ExactSign, EdgesAndCornersBelongToATriangleAndEndsOnItDoNotCross) {
    const glm::dvec3 triangle[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const auto crosses = [&](double x, double y) {
        return crossesTriangle({x, y, 1}, {x, y, -1}, triangle);
    };
    const double below = -0x1p-1074; // the next double below 0
    EXPECT_TRUE(crosses(0.25, 0.25));
    EXPECT_TRUE(crosses(0.5, 0.0)) << "on an edge";
    EXPECT_TRUE(crosses(0.5, 0.5)) << "on the slanted edge";
    EXPECT_TRUE(crosses(0.0, 0.0)) << "through a corner";
    EXPECT_FALSE(crosses(0.5, below * 0x1p+100)) << "2^-974 outside";
    EXPECT_FALSE(crosses(std::nextafter(0.5, 1.0), 0.5));
    EXPECT_FALSE(crossesTriangle({0.25, 0.25, 1}, {0.25, 0.25, 0}, triangle)) << "ends on it";
    EXPECT_FALSE(crossesTriangle({0.25, 0.25, 0}, {0.25, 0.25, -1}, triangle)) << "starts on it";
    EXPECT_TRUE(crossesTriangle({0.25, 0.25, 1}, {0.25, 0.25, -0x1p-60}, triangle));
    EXPECT_FALSE(crossesTriangle({-1, 0.25, 0}, {1, 0.25, 0}, triangle)) << "in its plane";
    const glm::dvec3 line[3] = {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}};
    EXPECT_FALSE(crossesTriangle({2, 2, 1}, {2, 2, 3}, line)) << "without area";
    EXPECT_TRUE(isWithoutArea(line));
}

} // namespace
} // namespace shadowdag::test
