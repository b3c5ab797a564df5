// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/rasterize.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::SmallScene;

/// Returns the stored depths of a face, row by row.
std::vector<float> faceDepths(const DrawnMap& drawn, uint32_t face) {
    const ShadowMapView view = drawn.maps.view();
    const uint32_t n = view.maps[0].faceTexels;
    std::vector<float> depths;
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x)
            depths.push_back(bitsFloat(depthAt(view, view.maps[0], {face, x, y})));
    return depths;
}

size_t coveredCount(const DrawnMap& drawn) {
    size_t count = 0;
    for (uint32_t face = 0; face < kFaceCount; ++face)
        for (const float w : faceDepths(drawn, face))
            count += w > 0.0f;
    return count;
}

// The square [-1, 1]^2 at depth 2 covers half of a face each way: texel centres with |u| <= 1/2,
// exactly.
TEST(Rasterize, SquareCoversTheTexelsWhoseCentresItHoldsAtItsExactDepth) {
    for (const uint32_t n : {4u, 7u, 8u, 64u, 200u}) {
        SmallScene scene;
        scene.addQuad({0, 0, 2}, {1, 0, 0}, {0, 1, 0}, 3);
        const DrawnMap drawn(scene, {0, 0, 0}, 5.0f, n);
        const std::vector<float> depths = faceDepths(drawn, 4);
        for (uint32_t y = 0; y < n; ++y)
            for (uint32_t x = 0; x < n; ++x) {
                const bool inside = 2 * std::abs(2 * int(x) + 1 - int(n)) <= int(n) &&
                                    2 * std::abs(2 * int(y) + 1 - int(n)) <= int(n);
                ASSERT_EQ(depths[y * n + x], inside ? 0.5f : 0.0f) << n << " " << x << " " << y;
            }
    }
}

// A closed surface around the light has no hole: every texel of every face is covered, whatever the
// mesh, including corners that lie exactly on texel centres, page borders and the cube's own edges.
TEST(Rasterize, ClosedSurfacesAroundTheLightLeaveNoTexelUncovered) {
    for (const uint32_t n : {1u, 3u, 16u, 64u, 65u, 321u})
        for (int shape = 0; shape < 4; ++shape) {
            SmallScene scene;
            glm::vec3 light(0.0f);
            if (shape == 0)
                scene.addBox(glm::vec3(-1), glm::vec3(1),
                             n < 100 ? n : 7); // corners on texel borders
            else if (shape == 1)
                scene.addBox(glm::vec3(-1), glm::vec3(1), 2 * (n < 50 ? n : 50)); // and on centres
            else if (shape == 2)
                scene.addSphere(glm::vec3(0), 1.0f, 40);
            else {
                scene.addSphere({100.3f, -50.1f, 7.7f}, 0.01f, 30); // far from the origin, tiny
                light = {100.3f, -50.1f, 7.7f};
            }
            const DrawnMap drawn(scene, light, shape == 3 ? 0.05f : 4.0f, n);
            EXPECT_EQ(coveredCount(drawn), 6u * n * n) << "n " << n << " shape " << shape;
        }
}

TEST(Rasterize, RotatedBoxesSharingEdgesLeaveNoHoles) {
    const uint32_t seed = 21;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    for (int k = 0; k < 40; ++k) {
        SmallScene scene;
        scene.addBox(glm::vec3(-1), glm::vec3(1), 1 + k % 5);
        const glm::vec3 a = test::randomDirection(rng);
        const glm::vec3 b = glm::normalize(glm::cross(a, test::randomDirection(rng)));
        const glm::vec3 c = glm::cross(a, b);
        for (glm::vec3& p : scene.positions)
            p = glm::vec3(3.0f, 1.0f, -2.0f) + p.x * a + p.y * b +
                1000.0f * float(k % 2) * p.z * c + p.z * c;
        const DrawnMap drawn(scene, {3.0f, 1.0f, -2.0f}, 3000.0f, 97);
        EXPECT_EQ(coveredCount(drawn), 6u * 97 * 97) << k;
    }
}

// The stated convention: surfaces nearer than the near plane (range / 2^20) and triangles in a
// plane with the light do not block; a light within a closed body is dark outside of it; a light
// just above a surface lights it.
TEST(Rasterize, LightTouchingOrInsideGeometryFollowsTheConvention) {
    const float range = 8.0f;
    SmallScene floor;
    floor.addQuad({0, 0, 0}, {3, 0, 0}, {0, 0, 3}, 2);
    EXPECT_EQ(coveredCount(DrawnMap(floor, {0.1f, 0, 0.2f}, range, 65)),
              0u); // in the floor's plane
    // A hair above: the floor is seen below, and only there; nothing that it holds is dark.
    const float hair = 1e-3f;
    const DrawnMap above(floor, {0.1f, hair, 0.2f}, range, 65);
    EXPECT_EQ(lookupVisibility(above.maps.view(), 0, {0.1f, 0, 0.2f}, {0, 1, 0}, {}), 255);
    EXPECT_EQ(lookupVisibility(above.maps.view(), 0, {0.1f, 1, 0.2f}, {0, -1, 0}, {}), 255);
    EXPECT_EQ(lookupVisibility(above.maps.view(), 0, {0.1f, -1, 0.2f}, {0, 1, 0}, {}), 0);
    // Nearer than the near plane: range / 2^20 = 7.6e-6.
    const DrawnMap touching(floor, {0.1f, 4e-6f, 0.2f}, range, 65);
    EXPECT_EQ(lookupVisibility(touching.maps.view(), 0, {0.1f, -1, 0.2f}, {0, 1, 0}, {}), 255);
    // Inside a body.
    SmallScene bulb;
    bulb.addBox(glm::vec3(-0.1f), glm::vec3(0.1f));
    bulb.addQuad({0, -1, 0}, {3, 0, 0}, {0, 0, 3});
    const DrawnMap inside(bulb, {0, 0.05f, 0}, range, 65);
    EXPECT_EQ(lookupVisibility(inside.maps.view(), 0, {0.5f, -1, 0.2f}, {0, 1, 0}, {}), 0);
    EXPECT_EQ(lookupVisibility(inside.maps.view(), 0, {0.02f, -0.1f, 0.02f}, {0, 1, 0}, {}), 255);
}

// Needles, points, and coincident corners have no area; opposite windings block equally.
TEST(Rasterize, DegenerateTrianglesCoverNothingAndBothWindingsCoverTheSame) {
    SmallScene none;
    none.addTriangle({1, 1, 1}, {1, 1, 1}, {1, 1, 1});
    none.addTriangle({1, 0, 1}, {1, 0.5f, 1}, {1, 0, 1});
    none.addTriangle({-1, 0, 1}, {0, 0, 1},
                     {1, 0, 1}); // collinear, through texel centres when n is odd
    EXPECT_EQ(coveredCount(DrawnMap(none, {0, 0, 0}, 4.0f, 65)), 0u);
    SmallScene front, back;
    front.addTriangle({1, -1, -1}, {1, 1, 0}, {1, 0, 1});
    back.addTriangle({1, -1, -1}, {1, 0, 1}, {1, 1, 0});
    const DrawnMap a(front, {0, 0, 0}, 4.0f, 65), b(back, {0, 0, 0}, 4.0f, 65);
    EXPECT_EQ(faceDepths(a, 0), faceDepths(b, 0));
    EXPECT_GT(coveredCount(a), 200u);
}

TEST(Rasterize, TexelSpanRoundsToCentres) {
    int32_t first, last;
    texelSpan(-1.0, 1.0, 8, first, last);
    EXPECT_EQ(first, 0);
    EXPECT_EQ(last, 7);
    texelSpan(-0.125, 0.125, 8, first, last); // centres of texels 3 and 4, exactly
    EXPECT_EQ(first, 3);
    EXPECT_EQ(last, 4);
    texelSpan(-0.12, 0.12, 8, first, last);
    EXPECT_GT(first, last);
    texelSpan(1.5, 9.0, 8, first, last);
    EXPECT_GT(first, last);
    texelSpan(-9e30, -1.01, 8, first, last);
    EXPECT_GT(first, last);
    texelSpan(-9e30, 9e30, 8, first, last);
    EXPECT_EQ(first, 0);
    EXPECT_EQ(last, 7);
}

} // namespace
} // namespace shadowdag
