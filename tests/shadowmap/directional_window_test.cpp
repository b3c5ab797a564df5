// SPDX-License-Identifier: Apache-2.0
// Windows of directional lights: their position, the projection of boxes, drawing, and lookups.
// More than 500 lines because its cases share the setup of a scene.
#include "shadowmap/directional_window.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace shadowdag::test {
namespace {

Light directionalLight(const glm::vec3& direction, const glm::vec3& center, float radius) {
    Light sun;
    sun.kind = Light::kSun;
    sun.directionWorld = glm::normalize(direction);
    sun.positionWorld = center;
    sun.rangeWorld = radius;
    sun.directionalDistanceWorld = 1024.0f;
    return sun;
}

Box boxAround(const glm::vec3& center, float half) {
    Box box;
    box.add(center - half);
    box.add(center + half);
    return box;
}

/// A directional light's map over receivers, drawn.
struct DrawnWindow {
    Light sun;
    FittedWindow window;
    ShadowMaps maps{Backend::kCpu};
    StageTimes stages;

    DrawnWindow(const SmallScene& scene, const Light& light, uint32_t texelsPerExtent,
                const std::vector<Box>& receivers, ShadowMapOptions options = freshMaps())
        : sun(light) {
        const DirectionalFrame frame = makeDirectionalFrame(sun);
        DirectionalRect rect;
        std::vector<MapReceiver> pairs;
        for (const Box& box : receivers) {
            pairs.push_back({uint32_t(pairs.size()), 0});
            rect.add(frame, box);
        }
        window = fitDirectionalWindow(frame, rect, texelsPerExtent, kMaxFaceTexels);
        const BatchSet batches = scene.batches();
        maps.build({request()}, receivers, pairs, scene.view(), batches.view(), options, stages);
    }

    MapRequest request() const {
        MapRequest request{sun.positionWorld, sun.rangeWorld, 0, window.faceTexels};
        request.window = window.window;
        return request;
    }
    const ShadowMapInfo& info() const { return maps.view().maps[0]; }
    uint8_t look(const glm::vec3& p, const glm::vec3& n, ShadowMapTrace* trace = nullptr,
                 const ShadowMapBias& bias = nineTaps(), float lodTexels = 0.0f) const {
        std::vector<ShadowMapInfo> infos{info()}; // as if drawn with levels of so many texels
        infos[0].lodTexels = lodTexels;
        ShadowMapView view = maps.view();
        view.maps = viewOf(infos);
        return lookupVisibility(view, 0, p, n, bias, trace);
    }
};

TEST(DirectionalWindow, APointKeepsItsTexelWhileTheWindowMoves) {
    std::mt19937 rng(3);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (const glm::vec3 center : {glm::vec3(0.0f), glm::vec3(1e5f, -300.0f, 1e5f)}) {
        const Light sun = directionalLight({0.6f, -0.48f, 0.64f}, center, 40.0f);
        const DirectionalFrame frame = makeDirectionalFrame(sun);
        std::set<std::pair<double, double>> windows;
        for (int step = 0; step < 400; ++step) {
            // A receiver area of 8 m that creeps by 2 cm; texels are 64 / 1218 m.
            DirectionalRect rect;
            rect.add(frame, boxAround(center + glm::vec3(0.02f * float(step), 0, 0), 4.0f));
            const FittedWindow map = fitDirectionalWindow(frame, rect, 1218, 8192);
            const DirectionalWindow& window = map.window;
            ASSERT_EQ(map.texelsPerExtent, 1218u);
            windows.insert({window.u0, window.v0});
            const double texel = frame.extentWorld / 1218.0;
            for (int trial = 0; trial < 20; ++trial) {
                const glm::dvec3 p(center + 4.0f * glm::vec3(unit(rng), unit(rng), unit(rng)) +
                                   glm::vec3(0.02f * float(step), 0, 0));
                const glm::dvec3 q = window.windowFromWorld(p);
                ASSERT_LT(std::max(std::abs(q.x), std::abs(q.y)), 1.0);
                // Its place in the texel is its place on the world's lattice.
                for (int axis = 0; axis < 2; ++axis) {
                    const double inWindow = (q[axis] + 1.0) * 0.5 * map.faceTexels;
                    const double inWorld = glm::dot(axis ? frame.up : frame.right, p) / texel;
                    const double apart = inWorld - inWindow;
                    ASSERT_NEAR(apart, std::round(apart), 1e-7);
                }
            }
        }
        EXPECT_LE(windows.size(), 4u); // of 256 texels it moves by 64, that is 3.4 m
    }
}

TEST(DirectionalWindow, ContainsItsReceiversWithTheirFiltersAndAllDepths) {
    std::mt19937 rng(4);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (int trial = 0; trial < 2000; ++trial) {
        const glm::vec3 center = 100.0f * glm::vec3(unit(rng), unit(rng), unit(rng));
        const float radius = std::exp2(6.0f * unit(rng));
        const Light sun = directionalLight(randomDirection(rng), center, radius);
        const DirectionalFrame frame = makeDirectionalFrame(sun);
        EXPECT_NEAR(glm::dot(frame.right, frame.toLight), 0.0, 1e-15);
        ASSERT_GE(frame.extentWorld, 2.0 * radius);
        ASSERT_LT(frame.extentWorld, 4.0 * radius);
        const Box box = boxAround(center + 0.5f * radius * glm::vec3(unit(rng), unit(rng), 0.0f),
                                  0.3f * radius * std::abs(unit(rng)));
        DirectionalRect rect;
        rect.add(frame, box);
        const uint32_t limit = trial % 2 ? 256 : 8192;
        const FittedWindow map = fitDirectionalWindow(frame, rect, 1000, limit);
        ASSERT_LE(map.faceTexels, limit);
        const double border = 1.0 - 2.0 * 2.0 / map.faceTexels; // two texels and more stay free
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 p(corner & 1 ? box.max.x : box.min.x,
                               corner & 2 ? box.max.y : box.min.y,
                               corner & 4 ? box.max.z : box.min.z);
            const glm::dvec3 q = map.window.windowFromWorld(p);
            ASSERT_LT(std::max(std::abs(q.x), std::abs(q.y)), border);
            const glm::dvec3 back = map.window.worldFromWindow(q);
            ASSERT_LT(glm::length(back - p), 1e-9 * (100.0 + radius));
        }
        for (int point = 0; point < 8; ++point) {
            const glm::dvec3 p =
                glm::dvec3(center) + double(radius) * glm::dvec3(randomDirection(rng));
            const double w = map.window.windowFromWorld(p).z;
            ASSERT_GE(w, 1.0);
            ASSERT_LE(w, 2.0);
        }
        // A texel is as wide as requested, or wider by a power of two if the limit requires it.
        const double ratio = map.window.texelWorld(map.faceTexels) /
                             (frame.extentWorld / double(map.texelsPerExtent));
        ASSERT_NEAR(ratio, 1.0, 1e-12);
        ASSERT_TRUE(map.texelsPerExtent == 1000 || limit == 256);
    }
}

TEST(DirectionalWindow, DepthsStayValidWhileTheSceneGrowsSlightly) {
    const Light sun = directionalLight({1, -1, 0.2f}, {0, 3, 0}, 20.0f);
    Light grown = sun;
    grown.rangeWorld = 20.5f;
    grown.positionWorld = {0.3f, 3, 0};
    EXPECT_EQ(makeDirectionalFrame(sun).farWorld, makeDirectionalFrame(grown).farWorld);
    EXPECT_EQ(makeDirectionalFrame(sun).depthWorld, makeDirectionalFrame(grown).depthWorld);
}

TEST(DirectionalWindow, ABoxCoversTheProjectionOfItsPoints) {
    std::mt19937 rng(5);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const Light sun = directionalLight({0.3f, -0.9f, 0.4f}, glm::vec3(0.0f), 10.0f);
    const DirectionalFrame frame = makeDirectionalFrame(sun);
    DirectionalRect rect;
    rect.add(frame, boxAround({1, 0, 0}, 2.0f));
    const FittedWindow fit = fitDirectionalWindow(frame, rect, 1024, 8192);
    const ShadowMapInfo map{sun.positionWorld, sun.rangeWorld, fit.faceTexels, 1, 0, fit.window};
    size_t reached = 0, missed = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const glm::vec3 center = 5.0f * glm::vec3(unit(rng), unit(rng), unit(rng));
        const glm::vec3 half = glm::abs(glm::vec3(unit(rng), unit(rng), unit(rng)));
        const Box box{center - half, center + half};
        FaceRect on{};
        const bool isOn = projectOnMap(map, box, kDirectionalFace, 0.0f, on);
        EXPECT_EQ(isOn, reachesMap(map, box));
        EXPECT_FALSE(projectOnMap(map, box, 0, 0.0f, on) && kDirectionalFace != 0);
        projectOnMap(map, box, kDirectionalFace, 0.0f, on);
        reached += isOn;
        missed += !isOn;
        for (int k = 0; k < 8; ++k) {
            const glm::vec3 p = center + half * glm::vec3(unit(rng), unit(rng), unit(rng));
            const glm::dvec3 q = lightFromWorld(map, p);
            const double u = q.x / q.z, v = q.y / q.z;
            if (std::max(std::abs(u), std::abs(v)) > 1.0)
                continue;
            ASSERT_TRUE(isOn);
            ASSERT_GE(u, on.uMin);
            ASSERT_LE(u, on.uMax);
            ASSERT_GE(v, on.vMin);
            ASSERT_LE(v, on.vMax);
            ASSERT_GE(q.z, on.depthMin);
            ASSERT_LE(q.z, on.depthMax);
        }
    }
    EXPECT_GT(reached, 1000u);
    EXPECT_GT(missed, 1000u);
}

/// Calls visit(x, y, stored depth) for the texels of a window that have memory.
template <class Visit> size_t forTexels(const ShadowMapView& view, const Visit& visit) {
    const ShadowMapInfo& map = view.maps[0];
    size_t count = 0;
    for (uint32_t y = 0; y < map.faceTexels; ++y)
        for (uint32_t x = 0; x < map.faceTexels; ++x) {
            const uint32_t bits = depthAt(view, map, {kDirectionalFace, x, y});
            if (bits == kNoPage)
                continue;
            ++count;
            visit(x, y, bitsFloat(bits));
        }
    return count;
}

TEST(DirectionalRasterizer, StoresTheFirstSurfaceThatEmbreeFindsAlongEveryTexelsRay) {
    std::mt19937 rng(6);
    SmallScene scene = randomScene(rng, 300, 4.0f, 0.8f);
    scene.addBox({-6, -5, -6}, {6, -4.5f, 6}, 3);
    const Light sun = directionalLight({0.6f, -0.48f, 0.64f}, {0, 0, 0}, 12.0f);
    const DrawnWindow drawn(scene, sun, 512, {boxAround({0.5f, -4.4f, 0}, 3.0f)});
    const Oracle oracle(scene);
    const ShadowMapInfo& map = drawn.info();
    size_t wrong = 0, empty = 0;
    const glm::vec3 way = sun.directionWorld;
    const size_t count = forTexels(drawn.maps.view(), [&](uint32_t x, uint32_t y, float w) {
        const glm::dvec3 centre(faceCellCentre(int32_t(x), map.faceTexels),
                                faceCellCentre(int32_t(y), map.faceTexels), 2.0);
        const glm::vec3 from(map.window.worldFromWindow(centre));
        const float hit = oracle.firstHit(from, way, 0.0f, 1e6f);
        empty += w == 0.0f;
        const double depth = 1.0 / std::sqrt(glm::dot(map.window.w, map.window.w));
        const double expected = std::isinf(hit) ? 0.0 : 2.0 - double(hit) / depth;
        wrong += !(std::abs(double(w) - expected) < 2e-6);
    });
    EXPECT_GT(count, 10000u);
    EXPECT_LT(wrong, count / 2000) << "of " << count << ", " << empty << " empty"; // edges
}

TEST(DirectionalRasterizer, BothKernelsStoreTheSameBits) {
    std::mt19937 rng(7);
    SmallScene scene = randomScene(rng, 500, 4.0f, 1.5f);
    const Light sun = directionalLight({0.1f, -1.0f, 0.3f}, {0, 0, 0}, 12.0f);
    ShadowMapOptions atomic = freshMaps();
    atomic.useAtomicRasterizer = true;
    const std::vector<Box> receivers{boxAround({0.5f, -3.0f, 0}, 3.0f)};
    const DrawnWindow a(scene, sun, 777, receivers), b(scene, sun, 777, receivers, atomic);
    const View<const uint32_t> x = a.maps.view().depths, y = b.maps.view().depths;
    ASSERT_EQ(x.count, y.count);
    ASSERT_GT(x.count, 0u);
    EXPECT_EQ(std::memcmp(x.data, y.data, x.count * 4), 0);
}

TEST(DirectionalRasterizer, CullingChangesNoDepthOfALookup) {
    std::mt19937 rng(8);
    SmallScene scene = randomScene(rng, 30000, 6.0f, 0.1f);
    const Light sun = directionalLight({0.6f, -0.48f, 0.64f}, {0, 0, 0}, 16.0f);
    const std::vector<Box> receivers{boxAround({0, -2, 0}, 0.7f), boxAround({2, 1, 1}, 0.5f)};
    std::vector<uint64_t> drawn;
    std::vector<std::vector<uint8_t>> answers;
    for (const MapCulling culling :
         {MapCulling::kSphere, MapCulling::kFaceMask, MapCulling::kProjectionMap,
          MapCulling::kMaximumDepth, MapCulling::kCellDepth}) {
        ShadowMapOptions options = freshMaps();
        options.culling = culling;
        const DrawnWindow window(scene, sun, 512, receivers, options);
        drawn.push_back(window.maps.counts().triangleDrawCount);
        // Culling is compared with one face per light.
        EXPECT_GE(window.maps.counts().triangleSphereCount, drawn.back());
        if (culling == MapCulling::kSphere) {
            EXPECT_EQ(window.maps.counts().triangleSphereCount, drawn.back());
        }
        std::mt19937 points(9);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        answers.emplace_back();
        for (int k = 0; k < 4000; ++k) {
            const Box& box = receivers[size_t(k) % 2];
            const glm::vec3 p =
                box.center() +
                0.5f * box.extent() * glm::vec3(unit(points), unit(points), unit(points));
            ShadowMapTrace trace{};
            answers.back().push_back(window.look(p, -sun.directionWorld, &trace));
            ASSERT_EQ(trace.missingTapCount, 0u);
        }
        EXPECT_EQ(answers.back(), answers.front());
    }
    EXPECT_LT(drawn[2], drawn[1]); // projection map
    EXPECT_LT(drawn[3], drawn[2]); // depth
    EXPECT_LE(drawn[4], drawn[3]);
}

TEST(DirectionalRasterizer, AlphaMasksAreSampledAtTexelCentres) {
    SmallScene scene; // a board of 2 x 2 metres over a floor, its upper triangle cut into quarters
    scene.addQuad({0, -3, 0}, {0, 0, 6}, {6, 0, 0});
    scene.addTriangle({-1, 0, -1}, {-1, 0.4f, 3}, {3, 3.0f, -1}); // its depths differ
    AlphaMask mask = makeAlphaMask(2, 2);
    setOpaque(mask, 0, 0);
    setOpaque(mask, 1, 1);
    scene.masks.add(mask);
    scene.masks.triangleCut = {kNotCut, kNotCut, 0};
    scene.masks.cuts.push_back({0, {{0, 0}, {0, 2}, {2, 0}}}); // a texel is 0.5 of uv, 1 m
    const Light sun = directionalLight({0.3f, -1.0f, 0.2f}, {0, -1, 0}, 6.5f);
    const DrawnWindow drawn(scene, sun, 512, {boxAround({0, -3, 0}, 2.5f)});
    const ShadowMapInfo& map = drawn.info();
    size_t holes = 0, solid = 0, wrong = 0;
    forTexels(drawn.maps.view(), [&](uint32_t x, uint32_t y, float w) {
        // The texel's ray meets the board's plane a + s (b - a) + t (c - a) where?
        const glm::dvec3 far =
            map.window.worldFromWindow({faceCellCentre(int32_t(x), map.faceTexels),
                                        faceCellCentre(int32_t(y), map.faceTexels), 1.0});
        const glm::dvec3 a(-1, 0, -1), ab(0, 0.4f, 4), ac(4, 3.0, 0), d(sun.directionWorld);
        const glm::dvec3 normal = glm::cross(ab, ac);
        const glm::dvec3 p = far - d * (glm::dot(normal, far - a) / glm::dot(normal, d)) - a;
        const double s = p.z / 4.0, t = p.x / 4.0;
        if (!(s > 1e-3 && t > 1e-3 && s + t < 1.0 - 1e-3))
            return;
        const double column = 4.0 * t, row = 4.0 * s; // mask texels: 2 a unit of uv, uv up to 2
        if (std::abs(column - std::round(column)) < 0.01 || std::abs(row - std::round(row)) < 0.01)
            return;
        const bool isOpaque = (int(column) + int(row)) % 2 == 0;
        const glm::dvec3 hit =
            map.window.worldFromWindow({faceCellCentre(int32_t(x), map.faceTexels),
                                        faceCellCentre(int32_t(y), map.faceTexels), w});
        const bool isBoard = hit.y > -1.5;
        wrong += isBoard != isOpaque;
        ++(isOpaque ? solid : holes);
    });
    EXPECT_GT(holes, 500u);
    EXPECT_GT(solid, 500u);
    EXPECT_EQ(wrong, 0u);
}

TEST(DirectionalLookup, APlaneIsLitAtAnyAngleAndDarkUnderABoard) {
    for (const glm::vec3 center : {glm::vec3(0.0f), glm::vec3(1e5f, 50.0f, -1e5f)})
        for (int degrees = 5; degrees <= 85; degrees += 5) {
            const float elevation = float(degrees) * float(M_PI) / 180.0f;
            SmallScene scene;
            scene.addQuad(center, {0, 0, 20}, {20, 0, 0});
            scene.addQuad(center + glm::vec3(0, 4, 0), {0, 0, 1}, {1, 0, 0}); // a board, 4 m up
            const Light sun = directionalLight(
                {std::cos(elevation) * 0.6f, -std::sin(elevation), std::cos(elevation) * 0.8f},
                center, 30.0f);
            const DrawnWindow drawn(scene, sun, 1024, {boxAround(center, 6.0f)});
            std::mt19937 rng(10);
            std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
            size_t lit = 0, dark = 0;
            for (int k = 0; k < 3000; ++k) {
                const glm::vec3 p = center + glm::vec3(6 * unit(rng), 0, 6 * unit(rng));
                // Towards the sun, at 4 m: within the board?
                const glm::vec3 up =
                    p - sun.directionWorld * (4.0f / -sun.directionWorld.y) - center;
                const float inside = 1.0f - std::max(std::abs(up.x), std::abs(up.z));
                // Texels are 1/16 m across the light, longer along the floor, the filter two wide.
                const float blur = 0.2f / -sun.directionWorld.y + 0.02f;
                const uint8_t seen = drawn.look(p, {0, 1, 0});
                if (inside > blur) {
                    ASSERT_EQ(seen, 0) << degrees;
                    ++dark;
                } else if (inside < -blur) {
                    ASSERT_EQ(seen, 255) << degrees << " " << p.x << " " << p.z;
                    ++lit;
                }
            }
            EXPECT_GT(lit, 500u);
            if (degrees > 60) {
                EXPECT_GT(dark, 20u);
            }
        }
}

TEST(DirectionalLookup, TheBiasIgnoresBlockersWithinHalfATexelOnly) {
    for (const glm::vec3 center : {glm::vec3(0.0f), glm::vec3(500.0f, 0.0f, -300.0f)}) {
        const Light sun = directionalLight({0.3f, -1.0f, 0.2f}, center, 30.0f);
        const DirectionalFrame frame = makeDirectionalFrame(sun);
        // Across the light: every tap compares at the same depth.
        const glm::vec3 right(frame.right), above(frame.up), normal(frame.toLight);
        const float texel = 64.0f / 1024.0f;
        for (const float height : {0.3f, 1.0f}) { // texels
            SmallScene scene;
            scene.addQuad(center, 20.0f * right, 20.0f * above);
            scene.addQuad(center + normal * (height * texel), 2.0f * right, 2.0f * above);
            const DrawnWindow drawn(scene, sun, 1024, {boxAround(center, 3.0f)});
            const glm::vec3 p = center + 0.4f * right + 0.3f * above;
            EXPECT_EQ(drawn.look(p, normal), height < 0.5f ? 255 : 0);
            ShadowMapBias none = nineTaps();
            none.constantTexels = 0.0f;
            EXPECT_EQ(drawn.look(p, normal, nullptr, none), 0);
        }
    }
}

// A level that stands above its receiver by the texels allowed is forgiven, higher ones are not; at
// light of less than a sixteenth of a right facing the lift grows no more, or it would reach past
// what stands there.
TEST(DirectionalLookup, ALevelOfDetailIsCompensatedByItsTexelsDownToGrazingLight) {
    const float texel = 64.0f / 1024.0f, lodTexels = 2.0f;
    for (const float facing : {1.0f, 0.5f, 0.125f, 1.0f / 32}) {
        const Light sun =
            directionalLight({std::sqrt(1 - facing * facing), -facing, 0.0f}, {0, 0, 0}, 30.0f);
        const float allowed =
            lodTexels * texel * std::min(1.0f, facing / kLeastFacingOfLevels); // along the normal
        for (const float height : {0.9f, 1.1f}) {
            SmallScene scene;
            scene.addQuad({0, 0, 0}, {0, 0, 25}, {25, 0, 0});
            scene.addQuad({0, height * allowed, 0}, {0, 0, 20}, {20, 0, 0});
            const DrawnWindow drawn(scene, sun, 1024, {boxAround({0, 0, 0}, 3.0f)});
            ShadowMapBias none = nineTaps();
            none.constantTexels = 0.0f;
            none.taps = 1;
            EXPECT_EQ(drawn.look({0.4f, 0, 0.3f}, {0, 1, 0}, nullptr, none), 0);
            EXPECT_EQ(drawn.look({0.4f, 0, 0.3f}, {0, 1, 0}, nullptr, none, lodTexels),
                      height < 1.0f ? 255 : 0)
                << facing << " " << height;
        }
    }
}

TEST(DirectionalLookup, ATapWithoutMemoryIsDarkAndCounted) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {0, 0, 20}, {20, 0, 0});
    const Light sun = directionalLight({0.2f, -1, 0.1f}, {0, 0, 0}, 30.0f);
    // Two receivers far apart: one window, and pages at its ends only.
    const DrawnWindow drawn(scene, sun, 1024,
                            {boxAround({-8, 0, 0}, 0.5f), boxAround({8, 0, 0}, 0.5f)});
    ShadowMapTrace trace{};
    EXPECT_EQ(drawn.look({-8, 0, 0}, {0, 1, 0}, &trace), 255);
    EXPECT_EQ(trace.missingTapCount, 0u);
    EXPECT_EQ(drawn.look({0, 0, 0}, {0, 1, 0}, &trace), 0);
    EXPECT_EQ(trace.missingTapCount, 9u);
    EXPECT_EQ(drawn.look({NAN, 0, 0}, {0, 1, 0}), 0);
}

TEST(DirectionalLookup, ReturnsTheBlockersPlaceAndTexel) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {0, 0, 9}, {9, 0, 0});
    scene.addQuad({0, 4, 0}, {0, 0, 9}, {9, 0, 0});
    const Light sun = directionalLight({0.3f, -1, 0.1f}, {0, 2, 0}, 20.0f);
    const DrawnWindow drawn(scene, sun, 1024, {boxAround({0, 0, 0}, 2.0f)});
    ShadowMapTrace trace{};
    EXPECT_EQ(drawn.look({0.3f, 0, 0.2f}, {0, 1, 0}, &trace), 0);
    EXPECT_NEAR(trace.blockerWorld.y, 4.0f, 1e-4f);
    EXPECT_NEAR(trace.blockerWorld.x, 0.3f - 1.2f, 0.15f); // 4 m towards the light
    EXPECT_NEAR(trace.texelWorld, 64.0 / 1024.0, 1e-6);
}

TEST(DirectionalMaps, AFullPoolMakesTexelsWiderAndLosesNone) {
    SmallScene scene;
    scene.addQuad({0, 0, 0}, {0, 0, 9}, {9, 0, 0});
    scene.addQuad({0, 4, 0}, {0, 0, 3}, {3, 0, 0});
    const Light sun = directionalLight({0.0f, -1, 0.0f}, {0, 2, 0}, 16.0f);
    ShadowMapOptions options = freshMaps();
    options.poolBytes = 4 * 64 * 64 * 4; // four pages
    const DrawnWindow drawn(scene, sun, 2048, {boxAround({0, 0, 0}, 6.0f)}, options);
    EXPECT_GT(drawn.maps.counts().degradeDivisor, 1.0f);
    EXPECT_LT(drawn.info().faceTexels, drawn.window.faceTexels);
    ShadowMapTrace trace{};
    for (float x = -5.9f; x < 5.9f; x += 0.1f) {
        const uint8_t seen = drawn.look({x, 0, 0.3f}, {0, 1, 0}, &trace);
        ASSERT_EQ(trace.missingTapCount, 0u);
        if (std::abs(x) < 2.5f) {
            ASSERT_EQ(seen, 0) << x;
        }
        if (std::abs(x) > 3.5f) {
            ASSERT_EQ(seen, 255) << x;
        }
    }
}

TEST(DirectionalMaps, KeptWindowsEqualFreshOnesWhileReceiversMove) {
    std::mt19937 rng(11);
    SmallScene scene = randomScene(rng, 30000, 6.0f, 0.1f);
    const Light sun = directionalLight({0.6f, -0.48f, 0.64f}, {0, 0, 0}, 16.0f);
    const DirectionalFrame frame = makeDirectionalFrame(sun);
    const BatchSet batches = scene.batches();
    ShadowMapOptions keeping = freshMaps();
    keeping.useStaticOptimization = true;
    ShadowMaps kept(Backend::kCpu), fresh(Backend::kCpu);
    StageTimes stages;
    uint64_t reused = 0, drawnAgain = 0, drawnFresh = 0;
    for (int step = 0; step < 40; ++step) {
        const std::vector<Box> receivers{
            boxAround({-4.0f + 0.8f * float(step / 4), -2.0f, 1.0f}, 0.8f)};
        DirectionalRect rect;
        rect.add(frame, receivers[0]);
        const FittedWindow fit = fitDirectionalWindow(frame, rect, 512, kMaxFaceTexels);
        MapRequest request{sun.positionWorld, sun.rangeWorld, 0, fit.faceTexels};
        request.window = fit.window;
        for (ShadowMaps* maps : {&kept, &fresh})
            maps->build({request}, receivers, {{0, 0}}, scene.view(), batches.view(),
                        maps == &kept ? keeping : freshMaps(), stages);
        reused += kept.counts().keptMapCount;
        drawnAgain += kept.counts().triangleDrawCount;
        drawnFresh += fresh.counts().triangleDrawCount;
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        for (int k = 0; k < 500; ++k) {
            const glm::vec3 p =
                receivers[0].center() + 0.8f * glm::vec3(unit(rng), unit(rng), unit(rng));
            ASSERT_EQ(lookupVisibility(kept.view(), 0, p, -sun.directionWorld, {}),
                      lookupVisibility(fresh.view(), 0, p, -sun.directionWorld, {}))
                << step;
        }
    }
    EXPECT_GT(reused, 25u);                // the window stays for most steps
    EXPECT_LT(drawnAgain, drawnFresh / 3); // in three of four steps nothing moves
}

} // namespace
} // namespace shadowdag::test
