// SPDX-License-Identifier: Apache-2.0
// The taps of a lookup: the filter compared with one by hand, in double, across edges, corners and
// pages; taps without pages; taps that pass under an object on the receiver.
#include "shadowmap/shadow_map_lookup.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::freshMaps;
using test::nineTaps;
using test::Oracle;
using test::SmallScene;

// A wall under a light so low that a texel is a metre and more long on the floor: right behind the
// wall the taps on the low side pass under it and end on the lit floor before it.
TEST(ShadowMapLookup, BehindAWallAtGrazingLightTapsThatPassUnderItAreOmitted) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {30, 0, 0}, {0, 0, 30}, 4);
    scene.addQuad({9.5f, 0, 0}, {0, 2, 0}, {0, 0, 20});
    for (const float height : {0.05f, 0.2f, 0.4f}) {
        const DrawnMap drawn(scene, {0, height, 0}, 40.0f, 512);
        const float texel = 9.5f * 2.0f / 512.0f;
        for (const ShadowMapBias& bias : {nineTaps(), ShadowMapBias{}}) {
            size_t asked = 0, lit = 0;
            for (float behind = texel; behind < 1.0f; behind += 0.01f)
                for (float z = -6.0f; z <= 6.0f; z += 0.113f) {
                    ++asked;
                    lit += lookupVisibility(drawn.maps.view(), 0, {9.5f + behind, 0, z}, {0, 1, 0},
                                            bias) >= 128;
                }
            // By nine taps all, 73 % and few when they are kept. Some end less than kLowTapTexels
            // before the receiver, and weigh more among four.
            EXPECT_LE(lit, (bias.taps == 9 ? 1 : 3) * asked / 1000) << height << " of " << asked;
            // Before the wall and far from its shadow all is lit.
            for (float x = 2.0f; x < 9.5f; x += 0.05f)
                EXPECT_EQ(lookupVisibility(drawn.maps.view(), 0, {x, 0, 0.3f}, {0, 1, 0}, bias),
                          255)
                    << x;
        }
    }
}

/// The filter by hand, in double: the same taps, each answered by Embree along its own ray.
/// unclear: a tap's blocker or plane lies within rounding of the limit.
struct HandFilter {
    double visibility = 0;
    bool unclear = false;

    HandFilter(const Oracle& oracle, const glm::vec3& light, uint32_t n, const glm::dvec3& p,
               const glm::dvec3& normal, const ShadowMapBias& bias) {
        const glm::dvec3 d = p - glm::dvec3(light);
        const uint32_t face = faceOf(glm::vec3(d));
        const glm::dvec3 q = faceFromLight(face, d);
        const glm::dvec2 s((q.x / q.z + 1) * 0.5 * n, (q.y / q.z + 1) * 0.5 * n);
        const int side = bias.taps == 9 ? 3 : bias.taps == 4 ? 2 : 1;
        // Half the filter's box, texels: its overlap with each texel, separably, is the weight.
        const double half = 0.5 * (side - 1);
        unclear = side == 1 && (isRound(q.x / q.z, n) || isRound(q.y / q.z, n));
        double sum = 0;
        for (int y = int(std::floor(s.y)) - 2; y <= int(std::floor(s.y)) + 2; ++y)
            for (int x = int(std::floor(s.x)) - 2; x <= int(std::floor(s.x)) + 2; ++x) {
                double weight = 1;
                for (int axis = 0; axis < 2; ++axis) {
                    const double at = axis ? y : x;
                    weight *= side == 1 ? double(std::floor(s[axis]) == at)
                                        : std::max(0.0, std::min(at + 1, s[axis] + half) -
                                                            std::max(at, s[axis] - half)) /
                                              (2 * half);
                }
                if (weight == 0)
                    continue;
                // Where that texel's centre looks, found by direction; then the texel that is
                // there.
                const glm::dvec3 c = lightFromFace(
                    face, glm::dvec3((2 * x + 1.0) / n - 1, (2 * y + 1.0) / n - 1, 1));
                const uint32_t there = faceOf(glm::vec3(c));
                const glm::dvec3 r = faceFromLight(there, c);
                const auto centre = [n](double t) {
                    return (2 * std::clamp(std::floor((t + 1) * 0.5 * n), 0.0, n - 1.0) + 1) / n -
                           1;
                };
                unclear |= there != face && (isRound(r.x / r.z, n) || isRound(r.y / r.z, n));
                const glm::dvec3 ray =
                    lightFromFace(there, glm::dvec3(centre(r.x / r.z), centre(r.y / r.z), 1));
                const double limit = std::max(glm::dot(normal, ray) / glm::dot(normal, d),
                                              glm::dot(d, ray) / glm::dot(d, d)) /
                                     (1 - std::min(2.0 * bias.constantTexels / n, 0.5));
                const float t = oracle.firstHit(light, glm::vec3(ray), 0.0f, 1e6f);
                const bool isBlocked = t * limit < 1;
                unclear |= std::abs(limit * t - 1) < 1e-4;
                for (int k = 0; k < 4; ++k) { // an outline through the texel's very centre
                    const double off = (k & 1 ? 1e-3 : -1e-3) / n;
                    const glm::dvec3 beside = lightFromFace(
                        there, faceFromLight(there, ray) +
                                   glm::dvec3(k & 2 ? off : 0.0, k & 2 ? 0.0 : off, 0.0));
                    unclear |= (oracle.firstHit(light, glm::vec3(beside), 0.0f, 1e6f) * limit <
                                1) != isBlocked;
                }
                sum += weight;
                visibility += isBlocked ? 0 : weight;
            }
        visibility *= 255 / sum;
    }
    static bool isRound(double t, uint32_t n) {
        const double s = (t + 1) * 0.5 * n;
        return std::abs(s - std::round(s)) < 1e-4;
    }
};

// All twelve edges and eight corners of the cube, and the pages' borders within a face, against the
// filter by hand. Only what the receivers need has pages.
TEST(ShadowMapLookup, FiltersAcrossEdgesCornersAndPagesAreTheFilterByHand) {
    SmallScene scene;
    scene.addBox(glm::vec3(-2), glm::vec3(2), 3);
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 c(k & 1 ? 1.3f : -1.3f, k & 2 ? 1.3f : -1.3f, k & 4 ? 1.3f : -1.3f);
        scene.addBox(c - 0.03f, c + 0.03f);
        for (int axis = 0; axis < 3; ++axis) { // a knob before the middle of every edge
            glm::vec3 e = c;
            e[axis] = 0.05f * float(k);
            scene.addBox(e - 0.06f, e + 0.06f);
        }
    }
    const Oracle oracle(scene);
    const glm::vec3 light(0.0f);
    const uint32_t seed = 3;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (const uint32_t n : {40u, 96u})
        for (const uint32_t taps : {1u, 4u, 9u}) {
            ShadowMapOptions options = freshMaps();
            options.pageTexels = 16;
            options.taps = taps;
            ShadowMapBias bias = nineTaps();
            bias.taps = taps;
            // 12 edges, 8 corners, then page borders.
            for (int place = 0; place < 26; ++place) {
                const float reach = 6.0f / float(n); // a few texels around the place, unit cube
                glm::vec3 at;
                glm::bvec3 isFree(false);
                if (place < 12) {
                    const int axis = place / 4;
                    at[axis] = 0.0f;
                    isFree[axis] = true;
                    at[(axis + 1) % 3] = place & 1 ? 1.0f : -1.0f;
                    at[(axis + 2) % 3] = place & 2 ? 1.0f : -1.0f;
                } else if (place < 20) {
                    at = glm::vec3(place & 1 ? 1 : -1, place & 2 ? 1 : -1, place & 4 ? 1 : -1);
                } else {
                    at = lightFromFace(uint32_t(place - 20),
                                       glm::vec3(32.0f / float(n) - 1, 64.0f / float(n) - 1, 1));
                }
                std::vector<glm::vec3> points, normals;
                std::vector<Box> boxes;
                for (int i = 0; i < 150; ++i) {
                    glm::vec3 d = at;
                    for (int axis = 0; axis < 3; ++axis)
                        d[axis] += isFree[axis] ? unit(rng) : reach * unit(rng);
                    const glm::vec3 m = glm::abs(d);
                    const float largest = glm::max(m.x, glm::max(m.y, m.z));
                    const int axis = m.x == largest ? 0 : m.y == largest ? 1 : 2;
                    glm::vec3 p = d * (2.0f / largest), normal(0.0f);
                    p[axis] = d[axis] > 0.0f ? 2.0f : -2.0f;
                    normal[axis] = d[axis] > 0.0f ? -1.0f : 1.0f;
                    points.push_back(p);
                    normals.push_back(normal);
                    boxes.push_back({p, p});
                }
                const DrawnMap drawn(scene, light, 8.0f, n, boxes, options);
                const ShadowMapView view = drawn.maps.view();
                size_t asked = 0, wrong = 0, missing = 0, fractional = 0;
                for (size_t i = 0; i < points.size(); ++i) {
                    ShadowMapTrace trace;
                    const uint8_t v =
                        lookupVisibility(view, 0, points[i], normals[i], bias, &trace);
                    missing += trace.missingTapCount;
                    const HandFilter hand(oracle, light, n, points[i], normals[i], bias);
                    if (hand.unclear)
                        continue;
                    ++asked;
                    fractional += v != 0 && v != 255;
                    wrong += std::abs(double(v) - hand.visibility) > 1.0;
                }
                EXPECT_EQ(missing, 0u) << place << " n " << n << " taps " << taps;
                EXPECT_EQ(wrong, 0u) << place << " n " << n << " taps " << taps << " of " << asked;
                EXPECT_GT(asked, 100u) << place;
                if (taps > 1 && place < 20) {
                    EXPECT_GT(fractional, 0u) << place << " n " << n << " taps " << taps;
                }
            }
        }
}

// Take any page away: a tap there is dark, counted, and the answer never brighter.
TEST(ShadowMapLookup, TapsOnPagesWithoutMemoryAreNeverLit) {
    SmallScene scene;
    scene.addBox(glm::vec3(-2), glm::vec3(2), 2);
    ShadowMapOptions options = freshMaps();
    options.pageTexels = 16;
    const uint32_t n = 32; // four pages a face
    const DrawnMap drawn(scene, glm::vec3(0.0f), 8.0f, n, {}, options);
    ShadowMapView view = drawn.maps.view();
    std::vector<uint32_t> table(view.pageTable.data, view.pageTable.data + view.pageTable.count);
    std::mt19937 rng(4);
    size_t darkened = 0;
    for (uint32_t page = 0; page < 24; ++page) {
        std::vector<uint32_t> without = table;
        without[page] = kNoPage;
        ShadowMapView holed = view;
        holed.pageTable = viewOf(without);
        for (int i = 0; i < 2000; ++i) {
            const glm::vec3 d = test::randomDirection(rng), m = glm::abs(d);
            const int axis = m.x >= m.y && m.x >= m.z ? 0 : m.y >= m.z ? 1 : 2;
            const glm::vec3 p = d * (2.0f / m[axis]);
            glm::vec3 normal(0.0f);
            normal[axis] = d[axis] > 0.0f ? -1.0f : 1.0f;
            for (const uint32_t taps : {1u, 4u, 9u}) {
                ShadowMapBias bias = nineTaps();
                bias.taps = taps;
                ShadowMapTrace trace;
                const uint8_t before = lookupVisibility(view, 0, p, normal, bias);
                const uint8_t after = lookupVisibility(holed, 0, p, normal, bias, &trace);
                ASSERT_LE(after, before);
                if (trace.missingTapCount == 0) {
                    ASSERT_EQ(after, before);
                }
                if (trace.missingTapCount == taps) {
                    ASSERT_EQ(after, 0);
                }
                darkened += after != before;
            }
        }
    }
    EXPECT_GT(darkened, 3000u);
}

} // namespace
} // namespace shadowdag
