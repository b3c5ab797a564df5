// SPDX-License-Identifier: Apache-2.0
// Spot lights: a map's pages within the light's cone, and all that a lookup needs.
#include "shadowmap/spot_cone.h"

#include "scenes/light.h"
#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::freshMaps;
using test::SmallScene;

/// Returns a unit vector at `angle` from a unit axis, turned around it by `turn`.
glm::vec3 besideAxis(const glm::vec3& axis, float angle, float turn) {
    const glm::vec3 u = glm::normalize(
        glm::cross(axis, std::abs(axis.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1)));
    const glm::vec3 v = glm::cross(axis, u);
    return std::cos(angle) * axis + std::sin(angle) * (std::cos(turn) * u + std::sin(turn) * v);
}

// Cones around an axis of a face: the closed form of their circles on the face, and of their
// hyperbolas on the faces beside.
TEST(SpotCone, ConesAroundAnAxisAreNarrowedToTheirCircle) {
    for (const float degrees : {5.0f, 30.0f, 44.0f, 60.0f, 80.0f})
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            const float angle = degrees * float(M_PI) / 180.0f;
            const SpotCone cone{lightFromFace(face, glm::vec3(0, 0, 1)), std::cos(angle)};
            for (uint32_t asked = 0; asked < kFaceCount; ++asked) {
                FaceRect rect{-1, 1, -1, 1, 0, 1};
                const bool isReached = narrowToCone(cone, asked, 0.0f, rect);
                if (asked == face) {
                    const float side = std::min(std::tan(angle), 1.0f);
                    ASSERT_TRUE(isReached);
                    EXPECT_NEAR(rect.uMin, -side, 2e-3f);
                    EXPECT_NEAR(rect.uMax, side, 2e-3f);
                    EXPECT_NEAR(rect.vMin, -side, 2e-3f);
                    EXPECT_NEAR(rect.vMax, side, 2e-3f);
                } else if (asked / 2 == face / 2) {
                    EXPECT_FALSE(isReached); // the face behind
                } else {
                    EXPECT_EQ(isReached, degrees > 45.0f) << degrees;
                    if (isReached) { // up to 1 / tan of the angle from the face's far edge
                        const glm::vec3 to = faceFromLight(asked, cone.directionWorld);
                        const float near = 1.0f / std::tan(angle);
                        EXPECT_NEAR(to.x > 0.5f    ? rect.uMin
                                    : to.x < -0.5f ? -rect.uMax
                                    : to.y > 0.5f  ? rect.vMin
                                                   : -rect.vMax,
                                    near, 2e-3f);
                    }
                }
            }
        }
}

TEST(SpotCone, EveryDirectionWithinAConeLiesInItsRectangles) {
    const uint32_t seed = 21;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    size_t narrowed = 0, faces = 0;
    for (int k = 0; k < 2000; ++k) {
        const glm::vec3 axis = test::randomDirection(rng);
        const float angle = 0.01f + 1.55f * unit(rng);
        const SpotCone cone{axis, std::cos(angle)};
        bool isReached[kFaceCount];
        FaceRect rects[kFaceCount];
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            rects[face] = {-1, 1, -1, 1, 0, 1};
            isReached[face] = narrowToCone(cone, face, 0.0f, rects[face]);
            faces += isReached[face];
            narrowed += !isReached[face] || rects[face].uMin > -1 || rects[face].vMax < 1;
        }
        for (int i = 0; i < 40; ++i) { // half of them on the cone's rim
            const float at = i % 2 ? angle * 0.99999f : angle * std::sqrt(unit(rng));
            const glm::vec3 d = besideAxis(axis, at, 6.2831853f * unit(rng));
            const uint32_t face = faceOf(d);
            const glm::vec3 q = faceFromLight(face, d);
            ASSERT_TRUE(isReached[face]) << k;
            const FaceRect& r = rects[face];
            ASSERT_TRUE(r.uMin <= q.x / q.z && q.x / q.z <= r.uMax && r.vMin <= q.y / q.z &&
                        q.y / q.z <= r.vMax)
                << k << " angle " << angle;
        }
    }
    EXPECT_GT(narrowed, 8000u);
    EXPECT_GT(faces, 3000u);
}

/// Clusters of a room around a light, and what a spot in its middle sees there.
TEST(SpotCone, SpotsNeedPagesWithinTheirConeOnlyAndGiveTheSameLookups) {
    SmallScene scene;
    scene.addBox(glm::vec3(-2), glm::vec3(2), 3);
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 c(k & 1 ? 1.3f : -1.3f, k & 2 ? 1.3f : -1.3f, k & 4 ? 1.3f : -1.3f);
        scene.addBox(c - 0.15f, c + 0.15f);
    }
    const BatchSet batches = scene.batches();
    ShadowMapOptions options = freshMaps();
    options.pageTexels = 16;
    const uint32_t n = 512;
    // All surfaces of the room, as boxes of 0.25: clusters know nothing of the cone.
    std::vector<Box> boxes;
    std::vector<MapReceiver> receivers;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = -1; side <= 1; side += 2)
            for (int j = 0; j < 16; ++j)
                for (int i = 0; i < 16; ++i) {
                    glm::vec3 lo(0.0f), hi(0.0f);
                    lo[axis] = hi[axis] = 2.0f * float(side);
                    lo[(axis + 1) % 3] = -2.0f + 0.25f * float(i);
                    hi[(axis + 1) % 3] = lo[(axis + 1) % 3] + 0.25f;
                    lo[(axis + 2) % 3] = -2.0f + 0.25f * float(j);
                    hi[(axis + 2) % 3] = lo[(axis + 2) % 3] + 0.25f;
                    receivers.push_back({uint32_t(boxes.size()), 0});
                    boxes.push_back({lo, hi});
                }
    std::mt19937 rng(6);
    for (const float degrees : {8.0f, 20.0f, 35.0f, 70.0f})
        for (const glm::vec3& toward :
             {glm::vec3(0, -1, 0), glm::vec3(1, 1, 1), glm::vec3(-1, 0.2f, 0.7f)}) {
            Light light;
            light.kind = Light::kSpot;
            light.rangeWorld = 8.0f;
            light.directionWorld = glm::normalize(toward);
            light.cosOuter = std::cos(degrees * float(M_PI) / 180.0f);
            MapRequest request{light.positionWorld, light.rangeWorld, 0, n};
            ShadowMaps whole(Backend::kCpu), within(Backend::kCpu);
            StageTimes stages;
            whole.build({request}, boxes, receivers, scene.view(), batches.view(), options, stages);
            request.cone = {light.directionWorld, light.cosOuter};
            within.build({request}, boxes, receivers, scene.view(), batches.view(), options,
                         stages);
            // The cone's share of all directions, against the pages of the whole cube. A square
            // around a circle, a corner of a face, where texels are dense (5.2 : 1), and the pages
            // at the rim cost more.
            const double share = 0.5 * (1.0 - double(light.cosOuter));
            const double got = double(within.counts().pageCount) / double(whole.counts().pageCount);
            EXPECT_GE(got, 0.9 * share) << degrees;
            EXPECT_LE(got, std::min(1.0, 3.0 * share + 0.03)) << degrees << " towards " << toward.x;
            EXPECT_LE(within.counts().batchFaceCount, whole.counts().batchFaceCount);
            ShadowMapTrace trace;
            size_t asked = 0;
            for (int i = 0; i < 4000; ++i) {
                const glm::vec3 d = test::randomDirection(rng), m = glm::abs(d);
                const int axis = m.x >= m.y && m.x >= m.z ? 0 : m.y >= m.z ? 1 : 2;
                const glm::vec3 p = d * (2.0f / m[axis]);
                if (!lightReaches(light, p))
                    continue;
                ++asked;
                glm::vec3 normal(0.0f);
                normal[axis] = d[axis] > 0.0f ? -1.0f : 1.0f;
                ASSERT_EQ(lookupVisibility(within.view(), 0, p, normal, {}, &trace),
                          lookupVisibility(whole.view(), 0, p, normal, {}));
                ASSERT_EQ(trace.missingTapCount, 0u);
            }
            EXPECT_GT(asked, 10u);
        }
}

} // namespace
} // namespace shadowdag
