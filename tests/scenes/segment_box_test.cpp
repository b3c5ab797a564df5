// SPDX-License-Identifier: Apache-2.0
#include "scenes/segment_box.h"

#include "scenes/split_mix.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {
namespace {

Box boxBetween(const glm::vec3& min, const glm::vec3& max) {
    Box box;
    box.add(min);
    box.add(max);
    return box;
}

TEST(BoxSegment, DecidesAxisParallelSegmentsAndPoints) {
    const Box box = boxBetween({1, 1, 1}, {2, 2, 2});
    EXPECT_TRUE(BoxSegment({0, 1.5, 1.5}, {3, 1.5, 1.5}).touches(box));
    EXPECT_FALSE(BoxSegment({0, 2.5, 1.5}, {3, 2.5, 1.5}).touches(box));
    EXPECT_FALSE(BoxSegment({0, 1.5, 1.5}, {0.9, 1.5, 1.5}).touches(box));
    EXPECT_TRUE(BoxSegment({1.5, 1.5, 1.5}, {1.5, 1.5, 1.5}).touches(box));
    EXPECT_FALSE(BoxSegment({0, 0, 0}, {0, 0, 0}).touches(box));
    EXPECT_FALSE(BoxSegment({0, 0, 0}, {1, 1, 1}).touches(Box{}));
}

TEST(BoxSegment, TouchesBoxesAtEndsFacesEdgesAndCorners) {
    const Box box = boxBetween({-1, -1, -1}, {1, 1, 1});
    EXPECT_TRUE(BoxSegment({1, 0, 0}, {5, 0, 0}).touches(box));
    EXPECT_TRUE(BoxSegment({1, -5, 0}, {1, 5, 0}).touches(box));
    EXPECT_TRUE(BoxSegment({0, 2, 0}, {2, 0, 0}).touches(box));
    EXPECT_TRUE(BoxSegment({0, 0, 3}, {2, 2, -1}).touches(box));
    EXPECT_FALSE(BoxSegment({0, 2.001, 0}, {2, 0.001, 0}).touches(box));
}

// A flat box around a point of the segment, far from the origin, where rounding is largest.
TEST(BoxSegment, NeverMissesABoxAroundOneOfItsPoints) {
    uint64_t state = 20260101;
    RecordProperty("seed", "20260101");
    const auto random = [&] { return double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53; };
    for (int i = 0; i < 100000; ++i) {
        const double far = i % 2 ? 1e6 : 1.0;
        const glm::dvec3 from(far + random(), random(), far * random());
        const glm::dvec3 to(far + random(), i % 3 ? random() : from.y, far * random());
        const glm::dvec3 at = from + (to - from) * random();
        Box box;
        for (int a = 0; a < 3; ++a) {
            const float nearest = float(at[a]);
            box.min[a] = double(nearest) > at[a] ? std::nextafter(nearest, -1e30f) : nearest;
            box.max[a] = double(nearest) < at[a] ? std::nextafter(nearest, 1e30f) : nearest;
        }
        ASSERT_TRUE(BoxSegment(from, to).touches(box)) << i;
    }
}

// Ends drawn from two boxes, a third box anywhere between; also flat ones, and far from the origin,
// where a box's floats are as coarse as the bundle is thin.
TEST(BoxSegmentBundle, TouchesEveryBoxThatOneOfItsSegmentsTouches) {
    uint64_t state = 20261122;
    RecordProperty("seed", "20261122");
    const auto random = [&] { return double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53; };
    const auto point = [&] { return glm::dvec3(random(), random(), random()); };
    int touched = 0, missed = 0;
    for (int i = 0; i < 200000; ++i) {
        const glm::dvec3 far(i % 2 ? 1e6 : 0.0, 0.0, i % 4 == 3 ? -1e5 : 0.0);
        const glm::dvec3 fromMin = far + 4.0 * point(), toMin = far + 4.0 * point();
        const double size = i % 3 == 0 ? 0.0 : 0.3;
        const glm::dvec3 fromMax = fromMin + size * point(), toMax = toMin + size * point();
        const glm::dvec3 low = far + 4.0 * point();
        const Box box = boxBetween(glm::vec3(low), glm::vec3(low + 2.0 * point()));
        const BoxSegment segment(fromMin + (fromMax - fromMin) * point(),
                                 toMin + (toMax - toMin) * point());
        const bool isTouched = BoxSegmentBundle(fromMin, fromMax, toMin, toMax).touches(box);
        if (segment.touches(box)) {
            ASSERT_TRUE(isTouched) << i;
            ++touched;
        }
        missed += !isTouched;
    }
    EXPECT_GT(touched, 5000);
    EXPECT_GT(missed, 50000); // or it would be of no use
}

TEST(BoxSegmentBundle, IsAsWideAsTheWiderOfItsEnds) {
    const BoxSegmentBundle bundle({0, -1, -1}, {0, 1, 1}, {10, 0, 0}, {10, 0, 0});
    EXPECT_TRUE(bundle.touches(boxBetween({5, 0.9f, 0}, {6, 2, 1})));
    EXPECT_FALSE(bundle.touches(boxBetween({5, 1.1f, 0}, {6, 2, 1})));
    EXPECT_FALSE(bundle.touches(boxBetween({10.1f, 0, 0}, {11, 1, 1})));
    EXPECT_FALSE(bundle.touches(Box{}));
}

} // namespace
} // namespace shadowdag
