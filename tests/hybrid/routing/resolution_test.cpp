// SPDX-License-Identifier: Apache-2.0
// The resolution equation by hand, its rule inside the sphere, the steps and their hysteresis.
#include "hybrid/routing/resolution_pass.h"
#include "hybrid/routing/resolution_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag::test {
namespace {

TEST(RequiredResolution, IsThePapersEquation) {
    // R^2 = (S / (alpha / 4 pi)) / 6 by hand. r = 1, d = 2: alpha / 4 pi = (1 - sqrt(3/4)) / 2 =
    // 0.0669873.
    EXPECT_NEAR(requiredResolutionSquared(1024, 1.0, 4.0), 1024.0 / 0.0669872981 / 6.0, 0.01);
    // r = 3, d = 5: sqrt(1 - 9/25) = 0.8, alpha / 4 pi = 0.1.
    EXPECT_NEAR(requiredResolutionSquared(600, 9.0, 25.0), 1000.0, 1e-3);
    EXPECT_NEAR(requiredResolutionSquared(600, 0.09, 0.25), 1000.0, 1e-3); // unit free
    // Far away alpha = pi r^2 / d^2, R^2 = (2/3) S d^2 / r^2; 1 - sqrt(1 - 1e-12) would have four
    // digits.
    EXPECT_NEAR(requiredResolutionSquared(3, 1e-12, 1.0) / 2e12, 1.0, 1e-6);
}

TEST(RequiredResolution, InsideTheSphereIsThatOfAHalfSpaceAndContinues) {
    EXPECT_EQ(requiredResolutionSquared(1024, 1.0, 0.25), float(1024.0 / 3.0));
    EXPECT_EQ(requiredResolutionSquared(1024, 1.0, 0.0), float(1024.0 / 3.0));
    EXPECT_EQ(requiredResolutionSquared(1024, 1.0, 1.0), float(1024.0 / 3.0));
    EXPECT_NEAR(requiredResolutionSquared(1024, 1.0, 1.0 + 1e-10), 1024.0 / 3.0, 1e-2);
    EXPECT_EQ(requiredResolutionSquared(7, 0.0, 0.0),
              float(7.0 / 3.0)); // a point at the light: finite
}

TEST(RequiredResolution, NeverShrinksAsTheLightGoesAwayOrTheClusterGrowsInPixels) {
    float last = 0.0f;
    for (double d = 0.0; d < 8.0; d += 0.01) {
        const float now = requiredResolutionSquared(100, 1.0, d * d);
        EXPECT_GE(now, last) << d;
        EXPECT_GT(requiredResolutionSquared(101, 1.0, d * d), now);
        last = now;
    }
}

TEST(RequiredResolution, OfOneSampleIsOneTexelForItsPixel) {
    Camera camera;
    const ViewRays view = makeViewRays(camera, 640, 360);
    Box box;
    box.add(glm::vec3(0, 0, -10));
    const double pixel = 10.0 * 2.0 * std::tan(0.45) / 360.0;
    const double radiusSquared = clusterRadiusSquared(box, view);
    EXPECT_NEAR(radiusSquared, 0.5 * pixel * pixel, 1e-9);
    // Six faces of R^2 texels around a light 4 m away: a texel is 4 pi 16 / (6 R^2) m^2, the disc
    // around a pixel pi / 2 pixels.
    const double texel =
        4.0 * 3.14159265 * 16.0 / (6.0 * requiredResolutionSquared(1, radiusSquared, 16.0));
    EXPECT_NEAR(texel / (pixel * pixel), 3.14159265 / 2.0, 1e-3);
}

TEST(DemandResolution, IsTheMaximumOverALightsClusters) {
    const std::vector<Box> boxes{{{-1, -1, -1}, {1, 1, 1}}, {{4, 4, 4}, {5, 5, 5}}};
    const std::vector<uint32_t> cell{0, 1}, start{0, 100, 110}, samples(110), cluster(110);
    const std::vector<uint32_t> listStart{0, 2, 3}, list{0, 1, 1};
    std::vector<Light> lights(3);
    lights[0].positionWorld = {10, 0, 0};
    lights[1].positionWorld = {0, 0, 0};
    const ViewRays view = makeViewRays(Camera(), 640, 360);
    const ClusterView clusters{viewOf(cell), viewOf(boxes), viewOf(start), viewOf(samples),
                               viewOf(cluster)};
    LightDemand demand(Backend::kCpu);
    ClusterLights lists(Backend::kCpu);
    lists.start.upload(listStart);
    lists.lights.upload(list);
    lists.record.upload(std::vector<uint32_t>(list.size(), 0));
    gatherDemand(Backend::kCpu, clusters, lists, viewOf(lights), view, 1.0f, 1, demand);
    const auto resolution = [&](size_t l) {
        return std::bit_cast<float>(demand.resolutionSquaredBits.at(l));
    };
    EXPECT_EQ(resolution(0),
              requiredResolutionSquared(100, clusterRadiusSquared(boxes[0], view), 100.0));
    EXPECT_EQ(resolution(1),
              std::max(requiredResolutionSquared(100, clusterRadiusSquared(boxes[0], view), 0.0),
                       requiredResolutionSquared(10, clusterRadiusSquared(boxes[1], view), 60.75)));
    EXPECT_EQ(resolution(2), 0.0f);
    const auto ofLights = [](View<const uint32_t> slots) {
        std::vector<uint32_t> first;
        for (size_t light = 0; light < 3; ++light)
            first.push_back(slots[light * kMaxMapsPerLight]);
        return first;
    };
    EXPECT_EQ(ofLights(demand.view().mapSampleCount), (std::vector<uint32_t>{100, 110, 0}));
    EXPECT_EQ(ofLights(demand.view().mapClusterCount), (std::vector<uint32_t>{1, 2, 0}));
    EXPECT_EQ(lists.record.download(), (std::vector<uint32_t>{0, 1, 1}));
}

TEST(PixelShare, IsThePixelsAreaOnTheSurfaceAsTheLightSeesIt) {
    const ViewRays view = makeViewRays(Camera(), 640, 360);
    const double side = view.pixelSize * 10.0; // of a pixel 10 m away
    const glm::dvec3 position(0, 0, -10), wall(0, 0, 1);
    Light light;
    light.rangeWorld = 100.0f;
    // A wall seen and lit head on, the light 5 m away.
    light.positionWorld = {0, 0, -5};
    EXPECT_NEAR(pixelShare(view, position, wall, light), side * side / 25.0, 1e-15);
    // The light at 60 degrees: half of that.
    light.positionWorld = glm::vec3(5.0 * std::sqrt(0.75), 0, -7.5);
    EXPECT_NEAR(pixelShare(view, position, wall, light), side * side / 50.0, 1e-10);
    // The wall turned to the light, so that the camera sees it at 60 degrees: twice.
    EXPECT_NEAR(pixelShare(view, position, glm::dvec3(std::sqrt(0.75), 0, 0.5), light),
                side * side / 12.5, 1e-10);
    // Grazing light and grazing view count as kLeastCosine; a light behind the wall sees nothing.
    light.positionWorld = {5, 0, -9.999f};
    EXPECT_NEAR(pixelShare(view, position, wall, light), kLeastCosine * side * side / 25.0, 1e-10);
    light.positionWorld = {5, 0, -10.001f};
    EXPECT_EQ(pixelShare(view, position, wall, light), 0.0);
    // Six faces of one texel share the sphere; the pixel's own share makes R^2.
    EXPECT_NEAR(shareOfTexel(light), 4.0 * 3.14159265358979 / 6.0, 1e-12);
    light.kind = Light::kSun;
    light.directionWorld = glm::vec3(-std::sqrt(0.75f), 0.0f, -0.5f);
    EXPECT_NEAR(pixelShare(view, position, wall, light), side * side / 2.0, 1e-8);
}

// A wall 10 m in front of the camera, patch by patch; one light whose angle to it is varied.
struct Wall {
    Wall() : view(makeViewRays(Camera(), 64, 64)) {
        for (uint32_t y = 0; y < 32; ++y)
            for (uint32_t x = 0; x < 32; ++x) {
                const size_t i = y * 64 + x;
                positions[i] = glm::vec3(10.0 * view.direction(x, y));
                normals[i] = {0, 0, 1};
                box.add(positions[i]);
                samples.push_back(uint32_t(i));
            }
    }
    double wanted(const Light& light, ResolutionRule rule) const {
        const std::vector<Box> boxes{box};
        const std::vector<uint32_t> cell{0}, start{0, 1024}, listStart{0, 1}, list{0};
        const std::vector<Light> lights{light};
        const GBufferView gbuffer{viewOf(positions), viewOf(normals), {}, {}, 64, 64};
        LightDemand demand(Backend::kCpu);
        ClusterLights lists(Backend::kCpu);
        lists.start.upload(listStart);
        lists.lights.upload(list);
        lists.record.upload({0});
        gatherDemand(Backend::kCpu,
                     {viewOf(cell), viewOf(boxes), viewOf(start), viewOf(samples), {}}, lists,
                     viewOf(lights), view, 1.0f, 1, demand, rule, gbuffer);
        return demand.wantedSquared.at(0);
    }
    ViewRays view;
    Box box;
    std::vector<glm::vec3> positions = std::vector<glm::vec3>(64 * 64, glm::vec3(0)),
                           normals = positions;
    std::vector<uint32_t> samples;
};

TEST(ResolutionRule, SphereIgnoresTheAngleThatThePlaneUses) {
    const Wall wall;
    const glm::vec3 center = wall.box.center();
    const auto at = [&](double degrees) {
        const double radians = degrees * 3.14159265358979 / 180.0;
        Light light;
        light.rangeWorld = 1000.0f;
        light.positionWorld =
            center + 300.0f * glm::vec3(std::sin(radians), 0.0, std::cos(radians));
        return light;
    };
    const double sphere = wall.wanted(at(0), ResolutionRule::kSphere);
    const ResolutionRule rule = ResolutionRule::kPlane;
    const double headOn = wall.wanted(at(0), rule);
    // One texel for a pixel: pi / 2 of the sphere's, whose disc the square patch does not fill.
    EXPECT_NEAR(headOn / sphere, 3.14159265 / 2.0, 0.05);
    EXPECT_NEAR(wall.wanted(at(60), rule) / headOn, 2.0, 0.02);
    EXPECT_NEAR(wall.wanted(at(80), rule) / headOn, 5.76, 0.15);
    EXPECT_NEAR(wall.wanted(at(89), rule) / headOn, 1.0 / kLeastCosine, 0.2); // bounded
    EXPECT_EQ(wall.wanted(at(120), rule), wall.wanted(at(120), ResolutionRule::kSphere));
    EXPECT_NEAR(wall.wanted(at(80), ResolutionRule::kSphere) / sphere, 1.0, 1e-3);
}

TEST(DemandMaps, SeparatesPairsByOctaveAndCombinesTheLowOnes) {
    for (float r : {0.5f, 1.0f, 1.999f, 2.0f, 3.999f, 4.0f, 1000.0f, 40000.0f, 1e9f})
        EXPECT_EQ(octaveOf(r * r), uint32_t(std::clamp(int(std::floor(std::log2(r))), 0, 15))) << r;

    // One light, clusters of one size ever nearer to it ask for ever less.
    std::vector<Box> boxes;
    std::vector<uint32_t> cell, start{0}, samples, cluster, listStart{0}, list;
    for (uint32_t c = 0; c < 7; ++c) {
        const float x = 1000.0f / float(1 << c);
        boxes.push_back({{x, -1, -1}, {x + 1, 1, 1}});
        cell.push_back(c);
        start.push_back(start.back() + 100);
        listStart.push_back(c + 1);
        list.push_back(0);
    }
    const std::vector<Light> lights(1);
    const ClusterView clusters{viewOf(cell), viewOf(boxes), viewOf(start), {}, {}};
    std::vector<size_t> mapCounts;
    for (const uint32_t mapsPerLight : {1u, 2u, 4u, 16u}) {
        LightDemand demand(Backend::kCpu);
        ClusterLights lists(Backend::kCpu);
        lists.start.upload(listStart);
        lists.lights.upload(list);
        lists.record.upload(std::vector<uint32_t>(list.size(), 0));
        gatherDemand(Backend::kCpu, clusters, lists, viewOf(lights),
                     makeViewRays(Camera(), 640, 360), 2.0f, mapsPerLight, demand);
        size_t mapCount = 0;
        for (const uint32_t clusterCount : demand.view().mapClusterCount)
            mapCount += clusterCount > 0;
        mapCounts.push_back(mapCount);
        uint32_t lowest = kMaxMapsPerLight;
        for (uint32_t c = 0; c < 7; ++c)
            if (mapsPerLight > 1)
                lowest = std::min(lowest, octaveOf(demand.wantedSquared.at(c) * 0.25f));
        const uint32_t highest = octaveOf(demand.wantedSquared.at(0) * 0.25f);
        for (uint32_t c = 0; c < 7; ++c) {
            const uint32_t octave = octaveOf(demand.wantedSquared.at(c) * 0.25f);
            const uint32_t rank = std::min(highest - octave, mapsPerLight - 1);
            EXPECT_EQ(lists.record.at(c), mapCount - 1 - rank) << mapsPerLight << " maps, " << c;
        }
    }
    EXPECT_EQ(mapCounts, (std::vector<size_t>{1, 2, 4, 7}));
}

TEST(DemandMaps, GoByTheHighestOctavesThatAreOccupied) {
    // Octaves 3 to 5, and one outlier at 12 that three maps of empty octaves would follow.
    const uint32_t occupied = 1u << 3 | 1u << 4 | 1u << 5 | 1u << 12;
    for (const uint32_t octave : {3u, 4u, 5u, 12u}) {
        EXPECT_EQ(servingOctave(occupied, octave, 4), octave);
        EXPECT_EQ(servingOctave(occupied, octave, 3), std::max(octave, 4u));
        EXPECT_EQ(servingOctave(occupied, octave, 2), std::max(octave, 5u));
        EXPECT_EQ(servingOctave(occupied, octave, 1), 12u);
    }
    std::mt19937 random(1);
    for (int trial = 0; trial < 1000; ++trial) {
        const uint32_t bits = (random() & 0xffffu) | 1u << random() % kMaxMapsPerLight;
        const uint32_t mapCount = 1 + random() % kMaxMapsPerLight;
        std::vector<uint32_t> octaves; // descending
        for (uint32_t o = kMaxMapsPerLight; o-- > 0;)
            if (bits >> o & 1u)
                octaves.push_back(o);
        for (size_t rank = 0; rank < octaves.size(); ++rank)
            EXPECT_EQ(servingOctave(bits, octaves[rank], mapCount),
                      octaves[std::min(rank, size_t(mapCount) - 1)])
                << "seed 1, trial " << trial;
    }
}

TEST(ResolutionSteps, AreRoundedFourthRootsOfPowersOfTwo) {
    const std::vector<uint32_t> steps = makeResolutionSteps(8192);
    const std::vector<uint32_t> first(steps.begin(), steps.begin() + 16);
    EXPECT_EQ(first,
              (std::vector<uint32_t>{1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 13, 16, 19, 23, 27, 32}));
    EXPECT_EQ(steps.back(), 8192u);
    for (size_t i = 1; i < steps.size(); ++i)
        EXPECT_LT(steps[i - 1], steps[i]);
    for (size_t i = 12; i < steps.size(); ++i)
        EXPECT_NEAR(double(steps[i]) / steps[i - 1], std::pow(2.0, 0.25), 0.03);
    EXPECT_EQ(makeResolutionSteps(100).back(), 100u);
    EXPECT_EQ(makeResolutionSteps(1), std::vector<uint32_t>{1});
}

uint32_t allocate(double texels, uint32_t previous) {
    return allocateResolution(makeResolutionSteps(2048), texels * texels, 16, previous);
}

TEST(ResolutionSteps, ContainTheRequestWithinTheLimits) {
    EXPECT_EQ(allocate(64.0, 0), 64u); // exactly a step
    EXPECT_EQ(allocate(64.001, 0), 76u);
    EXPECT_EQ(allocate(63.9, 0), 64u);
    EXPECT_EQ(allocate(3.0, 0), 16u);
    EXPECT_EQ(allocate(5000.0, 0), 2048u);
    EXPECT_EQ(allocate(0.0, 0), 16u);
}

TEST(ResolutionSteps, ARequestThatVariesByTenPercentKeepsItsStep) {
    uint32_t held = allocate(66.0, 0);
    EXPECT_EQ(held, 76u);
    for (int frame = 0; frame < 20; ++frame) {
        held = allocate(frame % 2 ? 66.0 : 60.0, held); // around the step of 64
        EXPECT_EQ(held, 76u);
    }
    held = allocate(57.5, held); // under 0.9 * 64 = 57.6
    EXPECT_EQ(held, 64u);
    EXPECT_EQ(allocate(57.7, 76), 76u);
    EXPECT_EQ(allocate(77.0, 76), 91u);   // grows at once
    EXPECT_EQ(allocate(20.0, 1024), 23u); // far too much is not kept
    EXPECT_EQ(allocate(60.0, 0), 64u);    // nothing held: the frame's own
}

} // namespace
} // namespace shadowdag::test
