// SPDX-License-Identifier: Apache-2.0
// Lookups in drawn maps compared with closed forms and Embree: planes, rooms, umbrae, invalid
// receivers.
#include "shadowmap/shadow_map_lookup.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

#include <limits>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::nineTaps;
using test::Oracle;
using test::SmallScene;

TEST(ShadowMapLookup, WrappedTexelIsTheNeighbourInDirectionSpace) {
    const uint32_t n = 16;
    for (uint32_t face = 0; face < kFaceCount; ++face)
        for (int32_t y = -1; y <= int32_t(n); ++y)
            for (int32_t x = -1; x <= int32_t(n); ++x) {
                const CubeTexel t = wrapTexel(face, x, y, n);
                ASSERT_TRUE(t.face < 6 && t.x < n && t.y < n);
                const bool inside = x >= 0 && y >= 0 && x < int32_t(n) && y < int32_t(n);
                EXPECT_EQ(t.face == face, inside);
                const glm::vec3 asked = glm::normalize(lightFromFace(
                    face, glm::vec3(faceCellCentre(x, n), faceCellCentre(y, n), 1.0f)));
                const glm::vec3 got = glm::normalize(
                    lightFromFace(t.face, glm::vec3(faceCellCentre(int32_t(t.x), n),
                                                    faceCellCentre(int32_t(t.y), n), 1.0f)));
                EXPECT_LT(glm::distance(asked, got), 1.5f * 2.0f / float(n));
            }
}

// Nothing but one plane: whatever its angle, resolution, distance and orientation, nothing may be
// dark.
TEST(ShadowMapLookup, LitPlanesHaveNoAcneFromFiveToEightyFiveDegrees) {
    const uint32_t seed = 11;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    size_t asked = 0, dark = 0, darkUnbiased = 0;
    for (const uint32_t n : {8u, 33u, 128u, 700u, 2048u})
        for (const float degrees : {5.0f, 20.0f, 45.0f, 60.0f, 75.0f, 80.0f, 85.0f})
            for (int k = 0; k < 12; ++k) {
                const glm::vec3 normal = k == 0 ? glm::vec3(0, 1, 0) : test::randomDirection(rng);
                const glm::vec3 u = glm::normalize(glm::cross(
                    normal, std::abs(normal.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1)));
                const glm::vec3 v = glm::cross(normal, u);
                const float distance = k % 3 == 0 ? 0.05f : k % 3 == 1 ? 1.0f : 90.0f;
                const glm::vec3 origin = k % 4 == 3 ? glm::vec3(1000, -2000, 500) : glm::vec3(0.3f);
                const float a = degrees * float(M_PI) / 180.0f;
                // The light stands over the plane's origin at `degrees` from its normal, seen from
                // the receivers.
                const glm::vec3 light =
                    origin + distance * (std::cos(a) * normal + std::sin(a) * u);
                SmallScene scene;
                const float side = 3.0f * distance;
                scene.addQuad(origin, side * u, side * v, 1 + k % 4);
                const Box receivers{origin - 0.15f * distance, origin + 0.15f * distance};
                const DrawnMap drawn(scene, light, 3.0f * distance, n, {receivers});
                const ShadowMapView view = drawn.maps.view();
                for (int i = 0; i < 200; ++i) {
                    // Within a tenth of the distance of the origin the angle stays near the one
                    // asked.
                    const glm::vec3 p = origin + 0.1f * distance * (unit(rng) * u + unit(rng) * v);
                    ++asked;
                    dark += lookupVisibility(view, 0, p, normal, {}) != 255;
                    ShadowMapBias none = nineTaps();
                    none.constantTexels = 0.0f;
                    darkUnbiased += lookupVisibility(view, 0, p, normal, none) != 255;
                }
            }
    EXPECT_EQ(dark, 0u) << "of " << asked;
    // The per-tap planes alone do it: the bias is for what is not a plane.
    EXPECT_EQ(darkUnbiased, 0u) << "of " << asked;
}

// A square of side 1 at height 2 under a light at height 4 throws an umbra of side 2 on the floor.
TEST(ShadowMapLookup, SquareOverAPlaneCastsItsUmbraWithinTheFilter) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {6, 0, 0}, {0, 0, 6});
    scene.addQuad({0, 2, 0}, {0.5f, 0, 0}, {0, 0, 0.5f});
    for (const uint32_t n : {32u, 100u, 512u}) {
        const DrawnMap drawn(scene, {0, 4, 0}, 20.0f, n);
        const float texelFloor = 4.0f * 2.0f / float(n);
        for (float x = -2.0f; x <= 2.0f; x += 0.037f)
            for (float z = -2.0f; z <= 2.0f; z += 0.037f) {
                const float outside = glm::max(std::abs(x), std::abs(z)) - 1.0f;
                for (const uint32_t taps : {1u, 4u, 9u}) {
                    ShadowMapBias bias = nineTaps();
                    bias.taps = taps;
                    const uint8_t v =
                        lookupVisibility(drawn.maps.view(), 0, {x, 0, z}, {0, 1, 0}, bias);
                    const float reach = (0.5f * float(filterSide(taps)) + 0.01f) * texelFloor;
                    if (outside < -reach) {
                        EXPECT_EQ(v, 0) << x << " " << z << " n " << n;
                    } else if (outside > reach) {
                        EXPECT_EQ(v, 255) << x << " " << z << " n " << n;
                    }
                }
            }
    }
}

// A plate of a metre a sixteenth over a floor, a light a metre over both: 1e5 m from the origin,
// where floats are 8 mm apart, its shadow is as dark and the floor beside it as lit as at the
// origin.
TEST(ShadowMapLookup, FarFromTheOriginAPlateNearItsFloorStillShadowsIt) {
    for (const glm::vec3 o :
         {glm::vec3(0), {1e3f, 0, -1e3f}, {1e5f, 0, -1e5f}, {1e5f, 1e5f, 1e5f}}) {
        SmallScene scene;
        scene.addQuad(o, {6, 0, 0}, {0, 0, 6});
        scene.addQuad(o + glm::vec3(0, 0.0625f, 0), {0.5f, 0, 0}, {0, 0, 0.5f});
        const DrawnMap drawn(scene, o + glm::vec3(-2, 1, 0), 20.0f, 1024);
        for (float x = -0.25f; x <= 0.25f; x += 0.0625f)
            for (float z = -0.25f; z <= 0.25f; z += 0.0625f) {
                const auto seen = [&](const glm::vec3& p) {
                    return lookupVisibility(drawn.maps.view(), 0, p, {0, 1, 0}, {});
                };
                EXPECT_EQ(seen(o + glm::vec3(x, 0, z)), 0) << o.x << " " << x << " " << z;
                EXPECT_EQ(seen(o + glm::vec3(x + 1.5f, 0, z)), 255) << o.x << " " << x << " " << z;
            }
    }
}

TEST(ShadowMapLookup, TraceReturnsAPointOfTheBlockerAndItsTexel) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {6, 0, 0}, {0, 0, 6});
    scene.addQuad({0, 2, 0}, {0.5f, 0, 0}, {0, 0, 0.5f});
    const uint32_t n = 128;
    const DrawnMap drawn(scene, {0, 4, 0}, 20.0f, n);
    ShadowMapTrace trace;
    EXPECT_EQ(lookupVisibility(drawn.maps.view(), 0, {0.3f, 0, 0.2f}, {0, 1, 0}, {}, &trace), 0);
    EXPECT_NEAR(trace.blockerWorld.y, 2.0f, 1e-4f);
    EXPECT_NEAR(trace.blockerWorld.x, 0.15f, 2.0f * 2.0f / float(n) * 2.0f);
    EXPECT_NEAR(trace.texelWorld, 2.0f * 2.0f / float(n), 1e-5f);
    EXPECT_EQ(trace.missingTapCount, 0u);
}

// Nothing that is not a place is ever lit, and nothing divides by zero into light.
TEST(ShadowMapLookup, NanReceiversAreDarkAndOneAtTheLightIsLit) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {6, 0, 0}, {0, 0, 6});
    const glm::vec3 light(0, 4, 0);
    const DrawnMap drawn(scene, light, 20.0f, 64);
    const ShadowMapView view = drawn.maps.view();
    const glm::vec3 up(0, 1, 0);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (int axis = 0; axis < 3; ++axis) {
        glm::vec3 p(0.5f, 0.0f, 0.5f);
        p[axis] = nan;
        EXPECT_EQ(lookupVisibility(view, 0, p, up, {}), 0);
    }
    EXPECT_EQ(lookupVisibility(view, 0, light, up, {}), 255);
    // Zero components, -0 among them: straight below, along both axes of the floor.
    for (const glm::vec3& p :
         {glm::vec3(0, 0, 0), glm::vec3(-0.0f, 0, 3), glm::vec3(3, 0, -0.0f)}) {
        EXPECT_EQ(lookupVisibility(view, 0, p, up, {}), 255);
        EXPECT_EQ(lookupVisibility(view, 0, p - up, up, {}), 0);
        // A normal that faces away, is zero or no number: the direction to the light serves.
        for (const glm::vec3& n : {-up, glm::vec3(0.0f), glm::vec3(nan)})
            EXPECT_EQ(lookupVisibility(view, 0, p - up, n, {}), 0);
    }
}

// A light in the middle of a closed room with posts at the cube's corners and edges: every surface
// that Embree calls lit by a margin is lit, across all twelve seams and eight corners of the cube.
TEST(ShadowMapLookup, RoomWithPostsShowsNoSeams) {
    SmallScene scene;
    scene.addBox(glm::vec3(-2), glm::vec3(2), 3);
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 c(k & 1 ? 1.3f : -1.3f, k & 2 ? 1.3f : -1.3f, k & 4 ? 1.3f : -1.3f);
        scene.addBox(c - 0.15f, c + 0.15f);
    }
    const Oracle oracle(scene);
    const glm::vec3 light(0.0f);
    for (const uint32_t n : {61u, 256u}) {
        const DrawnMap drawn(scene, light, 8.0f, n);
        std::mt19937 rng(5);
        size_t asked = 0, wrong = 0, missing = 0, unclear = 0;
        for (int i = 0; i < 60000; ++i) {
            glm::vec3 d = test::randomDirection(rng);
            if (i % 2) { // close to a seam: two axes nearly equal
                const int a = i / 2 % 3;
                d[a] =
                    std::copysign(std::abs(d[(a + 1) % 3]) * (1.0f + 0.02f * d[(a + 2) % 3]), d[a]);
                d = glm::normalize(d);
            }
            // The wall behind whatever is in front.
            const glm::vec3 m = glm::abs(d);
            const glm::vec3 p = d * (2.0f / glm::max(m.x, glm::max(m.y, m.z)));
            glm::vec3 normal(0.0f);
            const int axis = m.x >= m.y && m.x >= m.z ? 0 : m.y >= m.z ? 1 : 2;
            normal[axis] = d[axis] > 0.0f ? -1.0f : 1.0f;
            ShadowMapTrace trace;
            const uint8_t v = lookupVisibility(drawn.maps.view(), 0, p, normal, {}, &trace);
            missing += trace.missingTapCount;
            // Judge where Embree agrees with itself over the filter's reach.
            const float reach = 2.5f * 2.0f * 2.0f / float(n);
            int blocked = 0;
            for (int k = 0; k < 12; ++k) {
                const glm::vec3 target =
                    p + reach * (k ? test::randomDirection(rng) : glm::vec3(0));
                blocked += oracle.firstHit(light, target - light, 0.0f, 0.9f) < 0.9f;
            }
            if (blocked != 0 && blocked != 12) {
                ++unclear;
                continue;
            }
            ++asked;
            wrong += blocked ? v != 0 : v != 255;
        }
        EXPECT_EQ(missing, 0u);
        EXPECT_GT(asked, 30000u) << unclear;
        // Twelve samples do not see every sliver of the disc: a handful of borderline points
        // remain.
        EXPECT_LE(wrong, asked / 500) << "n " << n << " of " << asked;
    }
}

// A concave edge is the one place of an empty room where the filter may see a wall in front of
// another: nowhere else, and no farther from the edge than it reaches.
TEST(ShadowMapLookup, EmptyRoomIsDarkOnlyWithinTheFilterOfAnEdge) {
    SmallScene scene;
    const glm::vec3 lo(-2, -1, -3), hi(2, 2, 1.5f);
    scene.addBox(lo, hi, 2);
    const Oracle oracle(scene);
    for (const uint32_t n : {1u, 2u, 3u, 5u, 8u, 17u, 64u, 255u, 1000u}) {
        const glm::vec3 light(0.3f, 0.4f, -0.2f);
        const DrawnMap drawn(scene, light, 8.0f, n);
        std::mt19937 rng(9);
        size_t dark = 0, unexplained = 0, missing = 0;
        for (int i = 0; i < 20000; ++i) {
            const glm::vec3 d = test::randomDirection(rng);
            uint32_t triangle = 0;
            const float t = oracle.firstHit(light, d, 0.0f, 100.0f, &triangle);
            ASSERT_LT(t, 100.0f);
            const glm::uvec3 c = scene.triangles[triangle];
            glm::vec3 normal =
                glm::normalize(glm::cross(scene.positions[c[1]] - scene.positions[c[0]],
                                          scene.positions[c[2]] - scene.positions[c[0]]));
            if (glm::dot(normal, d) > 0.0f)
                normal = -normal;
            const glm::vec3 p = light + t * d;
            ShadowMapTrace trace;
            const bool isDark = lookupVisibility(drawn.maps.view(), 0, p, normal, {}, &trace) < 255;
            dark += isDark;
            missing += trace.missingTapCount;
            // Distance to the nearest wall but the own one, against 1.5 texels each way at the
            // receiver, along a surface that the light meets at the angle of its normal.
            glm::vec3 wall = glm::min(p - lo, hi - p);
            for (int axis = 0; axis < 3; ++axis)
                if (std::abs(normal[axis]) > 0.5f)
                    wall[axis] = 100.0f;
            const float nearest = glm::min(wall.x, glm::min(wall.y, wall.z));
            const float slope = -glm::dot(normal, d);
            unexplained += isDark && nearest > 2.0f * t * 3.0f / float(n) / slope;
        }
        EXPECT_EQ(unexplained, 0u) << n;
        EXPECT_EQ(missing, 0u) << n;
        if (n >= 64) {
            EXPECT_LT(dark, 240u) << n;
        }
    }
}

// A sphere's facets: convex, so no bias is needed for what faces the light.
TEST(ShadowMapLookup, ConvexMeshHasNoAcne) {
    SmallScene scene;
    scene.addSphere({0, 0, 0}, 1.0f, 24);
    for (const uint32_t n : {16u, 64u, 300u}) {
        const glm::vec3 light(2.5f, 1.0f, 0.5f);
        const DrawnMap drawn(scene, light, 10.0f, n);
        std::mt19937 rng(2);
        std::uniform_real_distribution<float> unit(0.0f, 1.0f);
        size_t asked = 0, dark = 0;
        for (const glm::uvec3& c : scene.triangles) {
            const glm::vec3 a = scene.positions[c[0]], b = scene.positions[c[1]],
                            e = scene.positions[c[2]];
            const glm::vec3 cross = glm::cross(b - a, e - a);
            if (glm::length(cross) < 1e-7f)
                continue;
            glm::vec3 normal = glm::normalize(cross);
            if (glm::dot(normal, a) < 0.0f)
                normal = -normal;
            for (int i = 0; i < 20; ++i) {
                float s = unit(rng), t = unit(rng);
                if (s + t > 1.0f)
                    s = 1.0f - s, t = 1.0f - t;
                const glm::vec3 p = a + s * (b - a) + t * (e - a);
                if (glm::dot(normal, light - p) <= 0.0f)
                    continue;
                ++asked;
                dark += lookupVisibility(drawn.maps.view(), 0, p, normal, {}) < 255;
            }
        }
        EXPECT_GT(asked, 5000u);
        EXPECT_EQ(dark, 0u) << n << " of " << asked;
    }
}

} // namespace
} // namespace shadowdag
