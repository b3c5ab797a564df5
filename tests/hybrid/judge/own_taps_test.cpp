// SPDX-License-Identifier: Apache-2.0
// The judge's taps against closed forms and, over random depths, against the lookup.
#include "hybrid/judge/own_taps.h"

#include "shadowmap/directional_window.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace shadowdag {
namespace {

constexpr uint32_t kPageLog2 = 4;

ShadowMapInfo mapOf(uint32_t texels, uint32_t pages) {
    ShadowMapInfo map{};
    map.lightPositionWorld = glm::vec3(1.0f, 2.0f, 3.0f);
    map.rangeWorld = 10.0f;
    map.faceTexels = texels;
    map.facePages = pages;
    return map;
}

ShadowMapBias biasOf(uint32_t taps) {
    ShadowMapBias bias;
    bias.taps = taps;
    return bias;
}

// Below the light, on the border of two texels: half of each.
TEST(OwnTaps, WeightsAreThoseOfABoxOfOneTexel) {
    const ShadowMapInfo map = mapOf(16, 1);
    const glm::vec3 up(0.0f, 1.0f, 0.0f);
    // Face 3 looks along -y: u along z, v along x; 2 / 16 * 4 m = 0.5 m a texel.
    const OwnTaps taps =
        makeOwnTaps(map, map.lightPositionWorld + glm::vec3(0.25f, -4.0f, 0.1f), up, biasOf(4));
    ASSERT_EQ(taps.taps.size(), 4u);
    double all = 0.0;
    for (const OwnTap& tap : taps.taps) {
        EXPECT_EQ(tap.face, 3u);
        EXPECT_EQ(tap.centre.y, -1.0);
        EXPECT_NEAR(tap.weight, (tap.x == 8 ? 0.7 : 0.3) * (tap.y == 8 ? 1.0 : 0.0), 1e-6)
            << tap.x << " " << tap.y;
        EXPECT_NEAR(tap.limit, 0.25 / (1.0 - 2.0 * 0.5 / 16.0), 3e-3); // the floor 4 m below
        all += tap.weight;
    }
    EXPECT_NEAR(all, 1.0, 1e-12);
}

TEST(OwnTaps, BeyondAFaceTheTexelOfTheNeighbourIsTaken) {
    const ShadowMapInfo map = mapOf(16, 1);
    const OwnTaps taps = makeOwnTaps(map, map.lightPositionWorld + glm::vec3(3.99f, 0.3f, 4.0f),
                                     glm::vec3(0.0f, 0.0f, -1.0f), biasOf(9));
    ASSERT_EQ(taps.taps.size(), 9u);
    int onX = 0;
    for (const OwnTap& tap : taps.taps) {
        EXPECT_TRUE(tap.face == 4 || tap.face == 0) << tap.face;
        onX += tap.face == 0;
        EXPECT_EQ(tap.centre[tap.face == 0 ? 0 : 2], 1.0);
    }
    EXPECT_EQ(onX, 3);
}

/// Compares the judge's taps with the lookup over random depths, so that each wrong texel, weight
/// or limit shows. @param middle,spread of the stored depths
/// @param place (i) returns the position of receiver i
template <class Place>
void compareWithLookup(const ShadowMapInfo& map, uint32_t taps, float middle, float spread,
                       std::mt19937& rng, const Place& place) {
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const uint32_t side = 1u << kPageLog2;
    const uint32_t pages = 6 * map.facePages * map.facePages;
    std::vector<uint32_t> table(pages), depths(size_t(pages) * side * side);
    for (uint32_t p = 0; p < pages; ++p)
        table[p] = p % 5 == 4 ? kNoPage : pages - 1 - p;
    for (uint32_t& bits : depths)
        bits = std::bit_cast<uint32_t>(middle + spread * unit(rng));
    const ShadowMapInfo maps[] = {map};
    const ShadowMapView view{{maps, 1}, viewOf(table), viewOf(depths), kPageLog2};
    int compared = 0, blocked = 0;
    for (int i = 0; i < 4000; ++i) {
        const glm::vec3 position = place(i);
        const glm::vec3 normal = glm::normalize(glm::vec3(unit(rng), unit(rng), unit(rng)));
        const OwnTaps own = makeOwnTaps(map, position, normal, biasOf(taps));
        if (own.isAtBorder)
            continue;
        ++compared;
        const glm::dvec2 range = ownVisibility(view, 0, own);
        ShadowMapTrace trace;
        const double is = lookupVisibility(view, 0, position, normal, biasOf(taps), &trace) / 255.0;
        ASSERT_GE(is, range.x - 2.0 / 255.0) << map.faceTexels << " texels, " << taps << " taps";
        ASSERT_LE(is, range.y + 2.0 / 255.0) << map.faceTexels << " texels, " << taps << " taps";
        const ShadowMapTrace ownBlocker = ownTrace(view, 0, own);
        ASSERT_EQ(ownBlocker.missingTapCount, trace.missingTapCount);
        if (is >= 0.5 || range.x != range.y) // lit, or a depth at a limit, which either may take
            continue;
        ++blocked;
        ASSERT_NEAR(ownBlocker.texelWorld, trace.texelWorld, 1e-5 * double(trace.texelWorld));
        ASSERT_LT(glm::length(ownBlocker.blockerWorld - trace.blockerWorld),
                  1e-4f * (1.0f + glm::length(trace.blockerWorld)));
    }
    EXPECT_GT(compared, 2000);
    EXPECT_GT(blocked, 200);
}

TEST(OwnTaps, GiveTheLookupsVisibilityOnAllFacesAndSeams) {
    const uint32_t seed = 21;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (const uint32_t texels : {4u, 23u, 64u})
        for (const uint32_t taps : {1u, 4u, 9u}) {
            const uint32_t side = 1u << kPageLog2;
            const ShadowMapInfo map = mapOf(texels, (texels + side - 1) / side);
            compareWithLookup(map, taps, 0.25f, 0.2f, rng, [&](int i) {
                glm::vec3 d = 4.0f * glm::vec3(unit(rng), unit(rng), unit(rng));
                if (i % 2) // near the edges of faces
                    d[(i / 2) % 3] = d[(i / 2 + 1) % 3] * (1.0f + 0.05f * unit(rng));
                return map.lightPositionWorld + d;
            });
        }
}

ShadowMapInfo windowOf(uint32_t texels, uint32_t pages, const glm::vec3& directionWorld) {
    Light sun;
    sun.kind = Light::kSun;
    sun.directionWorld = glm::normalize(directionWorld);
    sun.positionWorld = glm::vec3(0.5f, 1.0f, -0.5f); // the sphere around the scene
    sun.rangeWorld = 6.0f;
    const DirectionalFrame frame = makeDirectionalFrame(sun);
    DirectionalRect rect;
    rect.add(frame, Box{glm::vec3(-2.0f), glm::vec3(2.0f)});
    ShadowMapInfo map = mapOf(texels, pages);
    map.lightPositionWorld = sun.positionWorld;
    map.rangeWorld = sun.rangeWorld;
    map.window = fitDirectionalWindow(frame, rect, 256, 8192).window;
    return map;
}

TEST(OwnTaps, AreOfTheMapOfTheirLightAlone) {
    ShadowMapInfo map = mapOf(16, 1);
    Light light;
    light.positionWorld = map.lightPositionWorld;
    light.rangeWorld = map.rangeWorld;
    EXPECT_TRUE(isMapOf(map, light));
    light.kind = Light::kSpot;
    EXPECT_TRUE(isMapOf(map, light));
    light.rangeWorld *= 2.0f;
    EXPECT_FALSE(isMapOf(map, light));
    light.rangeWorld = map.rangeWorld;
    light.positionWorld.x += 0.001f;
    EXPECT_FALSE(isMapOf(map, light));

    const glm::vec3 down(0.3f, -1.0f, 0.2f);
    map = windowOf(64, 4, down);
    light.kind = Light::kSun;
    light.directionWorld = glm::normalize(down);
    EXPECT_TRUE(isMapOf(map, light));
    light.directionWorld = glm::normalize(down + glm::vec3(0.001f, 0.0f, 0.0f));
    EXPECT_FALSE(isMapOf(map, light));
    EXPECT_FALSE(isMapOf(mapOf(16, 1), light));
}

// Under a sun overhead a floor of slope 1 rises by a texel's side for each texel.
TEST(OwnTaps, OfAWindowLieOnTheReceiversPlane) {
    const ShadowMapInfo map = windowOf(64, 4, {0.0f, -1.0f, 0.0f});
    const glm::vec3 position(0.3f, 0.2f, -0.4f);
    const glm::vec3 normal = glm::normalize(glm::vec3(-1.0f, 1.0f, 0.0f)); // y rises with x
    ShadowMapBias bias = biasOf(9);
    bias.constantTexels = 0.0f;
    const OwnTaps taps = makeOwnTaps(map, position, normal, bias);
    ASSERT_EQ(taps.taps.size(), 9u);
    double all = 0.0;
    for (const OwnTap& tap : taps.taps) {
        const OwnTapRay ray = ownTapRay(map, tap);
        // Straight down, to the plane or to the receiver's height, whichever is higher.
        EXPECT_NEAR(ray.startWorld.x, ray.endWorld.x, 1e-5f);
        EXPECT_NEAR(ray.startWorld.z, ray.endWorld.z, 1e-5f);
        EXPECT_GT(ray.startWorld.y, map.lightPositionWorld.y + map.rangeWorld);
        const float plane = position.y + (ray.endWorld.x - position.x);
        EXPECT_NEAR(ray.endWorld.y, std::max(plane, position.y), 1e-4f);
        all += tap.weight;
    }
    EXPECT_NEAR(all, 1.0, 1e-12);
}

TEST(OwnTaps, GiveTheLookupsVisibilityInWindows) {
    const uint32_t seed = 22;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (const uint32_t texels : {16u, 64u, 512u})
        for (const uint32_t taps : {1u, 4u, 9u}) {
            ShadowMapInfo map =
                windowOf(texels, texels >> kPageLog2, {unit(rng), -1.0f, unit(rng)});
            map.lodTexels = taps == 4 ? 0.5f : 0.0f;
            compareWithLookup(map, taps, 1.5f, 0.4f, rng, [&](int i) {
                const float reach = i % 8 == 0 ? 6.0f : 2.0f; // some outside of the window
                return reach * glm::vec3(unit(rng), unit(rng), unit(rng));
            });
        }
}

} // namespace
} // namespace shadowdag
