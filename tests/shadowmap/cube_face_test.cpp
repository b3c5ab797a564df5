// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cube_face.h"

#include "shadowmap/page_mask.h"
#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(CubeFace, EveryDirectionBelongsToTheFaceOfItsLargestAxis) {
    EXPECT_EQ(faceOf({1, 0, 0}), 0u);
    EXPECT_EQ(faceOf({-1, 0, 0}), 1u);
    EXPECT_EQ(faceOf({0, 1, 0}), 2u);
    EXPECT_EQ(faceOf({0, -1, 0}), 3u);
    EXPECT_EQ(faceOf({0, 0, 1}), 4u);
    EXPECT_EQ(faceOf({0, 0, -1}), 5u);
    EXPECT_EQ(faceOf({1, 1, 1}), 0u); // ties: x, then y
    EXPECT_EQ(faceOf({0.5f, -1, 1}), 3u);
}

TEST(CubeFace, FrameAndItsInverseAgree) {
    std::mt19937 rng(1);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 d = test::randomDirection(rng);
        const uint32_t face = faceOf(d);
        const glm::vec3 q = faceFromLight(face, d);
        EXPECT_GT(q.z, 0.0f);
        EXPECT_LE(std::abs(q.x), q.z);
        EXPECT_LE(std::abs(q.y), q.z);
        EXPECT_EQ(lightFromFace(face, q), d);
    }
}

TEST(CubeFace, TexelCentreLiesInItsTexel) {
    for (const uint32_t n : {1u, 2u, 3u, 97u, 8191u, 8192u})
        for (uint32_t x = 0; x < n; ++x)
            ASSERT_EQ(faceCell(faceCellCentre(int32_t(x), n), n), x) << n;
    EXPECT_EQ(faceCell(-1.0f, 8), 0u);
    EXPECT_EQ(faceCell(0.0f, 8), 4u); // half open
    EXPECT_EQ(faceCell(1.0f, 8), 7u);
    EXPECT_EQ(faceCell(std::nanf(""), 8), 0u);
}

TEST(CubeFace, RectangleHoldsEveryPointOfTheBoxThatProjectsOnTheFace) {
    const uint32_t seed = 7;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (int i = 0; i < 20000; ++i) {
        const float scale = std::exp2(20.0f * unit(rng) - 10.0f);
        const auto corner = [&] {
            return scale * (2.0f * glm::vec3(unit(rng), unit(rng), unit(rng)) - 1.0f);
        };
        Box box;
        const glm::vec3 first = corner();
        box.add(first);
        box.add(i % 2 ? corner() : first + 0.1f * corner());
        bool reached[kFaceCount];
        FaceRect rects[kFaceCount];
        for (uint32_t face = 0; face < kFaceCount; ++face)
            reached[face] = projectBox(box, face, 0.0f, rects[face]);
        for (int k = 0; k < 40; ++k) {
            glm::vec3 p = box.min + box.extent() * glm::vec3(unit(rng), unit(rng), unit(rng));
            if (k < 8) // the corners
                p = {k & 1 ? box.max.x : box.min.x, k & 2 ? box.max.y : box.min.y,
                     k & 4 ? box.max.z : box.min.z};
            p = glm::clamp(p, box.min, box.max);
            const uint32_t face = faceOf(p);
            const glm::vec3 q = faceFromLight(face, p);
            if (q.z == 0.0f)
                continue;
            ASSERT_TRUE(reached[face]) << i;
            const FaceRect& r = rects[face];
            ASSERT_TRUE(r.uMin <= q.x / q.z && q.x / q.z <= r.uMax && r.vMin <= q.y / q.z &&
                        q.y / q.z <= r.vMax && r.depthMin <= q.z && q.z <= r.depthMax)
                << i << " face " << face;
        }
    }
}

TEST(CubeFace, BoxAroundTheLightCoversEveryFace) {
    const Box box{{-1, -2, -1}, {3, 1, 1}};
    for (uint32_t face = 0; face < kFaceCount; ++face) {
        FaceRect r;
        ASSERT_TRUE(projectBox(box, face, 0.0f, r));
        EXPECT_EQ(r.uMin, -1.0f);
        EXPECT_EQ(r.uMax, 1.0f);
        EXPECT_EQ(r.vMin, -1.0f);
        EXPECT_EQ(r.vMax, 1.0f);
        EXPECT_EQ(r.depthMin, 0.0f);
    }
}

TEST(CubeFace, SmallBoxOnAnAxisReachesOneFaceAndEmptyBoxNone) {
    const Box box{{-0.1f, 4, -0.1f}, {0.1f, 5, 0.1f}};
    for (uint32_t face = 0; face < kFaceCount; ++face) {
        FaceRect r;
        EXPECT_EQ(projectBox(box, face, 0.0f, r), face == 2) << face;
        EXPECT_FALSE(projectBox(Box(), face, 0.0f, r));
    }
    FaceRect r;
    ASSERT_TRUE(projectBox(box, 2, 0.0f, r));
    EXPECT_NEAR(r.uMax, 0.025f, 2e-6f); // 0.1 / 4
    EXPECT_EQ(r.depthMin, 4.0f);
    EXPECT_EQ(r.depthMax, 5.0f);
}

// The digest's figure: 1.3 faces a box once what misses is rejected. It depends on the boxes; these
// are small and random.
TEST(CubeFace, RandomSmallBoxesReachFewFaces) {
    std::mt19937 rng(3);
    uint32_t reached = 0;
    for (int i = 0; i < 10000; ++i) {
        const glm::vec3 c = test::randomDirection(rng);
        const Box box{c - 0.1f, c + 0.1f};
        FaceRect r;
        for (uint32_t face = 0; face < kFaceCount; ++face)
            reached += projectBox(box, face, 0.0f, r);
    }
    EXPECT_LT(reached, 14000u);
    EXPECT_GE(reached, 10000u);
}

TEST(CubeFace, SetBitsSetsExactlyTheRange) {
    for (uint32_t begin = 0; begin < 100; begin += 7)
        for (uint32_t end = begin; end <= 128; end += 5) {
            std::vector<uint32_t> words(4, 0u);
            setBits(viewOf(words), begin, end);
            for (uint32_t bit = 0; bit < 128; ++bit)
                ASSERT_EQ(words[bit / 32] >> (bit % 32) & 1u, bit >= begin && bit < end);
        }
}

} // namespace
} // namespace shadowdag
