// SPDX-License-Identifier: Apache-2.0
// Which voxels a ray believes: the bound on the displacement of shadows in closed form.
#include "hybrid/rays/shadow_rays.h"

#include "scenes/split_mix.h"
#include "tests/hybrid/triangle_soup.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace shadowdag::test {
namespace {

constexpr uint64_t kRaySeed = 20261124;

/// A floor and a plate over its half x < 0; a light straight above the plate's edge. The plane
/// through light and edge is x = 0, so a sample is truly dark only where x <= 0, and a shadow at
/// x > 0 is displaced by at least x. All x are from `far`, where floats are coarse.
struct PlateStage {
    TriangleSoup soup;
    Dag dag;
    glm::vec3 light;
    RayInputs inputs;
    float far;

    PlateStage(float plateHeight, float distance, float believe, float farX = 0.0f) : far(farX) {
        soup.addLevelSquare(glm::vec3(0), 2);
        soup.addQuad({-2, plateHeight, -2}, {-2, plateHeight, 2}, {0, plateHeight, 2},
                     {0, plateHeight, -2});
        light = glm::vec3(0, plateHeight + distance, 0);
        soup.move({far, 0, 0});
        light.x += far;
        std::vector<uint32_t> all(soup.triangles.size());
        std::iota(all.begin(), all.end(), 0u);
        Box bounds;
        for (const glm::vec3& p : soup.positions)
            bounds.add(p);
        bounds.add(light);
        dag = voxelize(soup.view(), viewOf(all), gridAround(bounds, 9));
        inputs.dag = dag.view();
        inputs.options.believe = believe;
        // A camera that looks straight down from y = 4; a pixel at distance 1 has 2 mm.
        inputs.detail = {glm::dvec3(far, 4, 0), glm::dvec3(0, -1, 0), 0.002, {}};
    }
    ShadowPair pairAt(float x, float z) const {
        return {{far + x, 0, z}, {0, 1, 0}, light, 0, 0, false};
    }
    double footprintWorld() const { return 4 * 0.002; }
};

TEST(ShadowRays, ABelievedShadowIsDisplacedByAtMostThatManyPixels) {
    RecordProperty("seed", std::to_string(kRaySeed));
    uint64_t state = kRaySeed;
    const auto random = [&] {
        return float(double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53);
    };
    constexpr float kPlate = 1.0f;
    uint32_t believedCount = 0, displacedCount = 0;
    for (const float far : {0.0f, 32768.0f})
        for (const float distance : {0.02f, 0.06f, 0.2f, 0.6f, 2.0f, 6.0f, 20.0f})
            for (const float believe : {1.0f, 3.0f, 10.0f, 30.0f, 100.0f}) {
                SCOPED_TRACE("light " + std::to_string(distance) + " above the plate, believe " +
                             std::to_string(believe) + ", at " + std::to_string(far));
                const PlateStage stage(kPlate, distance, believe, far);
                const double most = double(believe) * stage.footprintWorld();
                RayInputs all = stage.inputs;
                all.options.believe = RayOptions{}.believe;
                for (int i = 0; i < 400; ++i) {
                    const float x = (random() * 2 - 1) * 1.9f, z = (random() * 2 - 1) * 1.9f;
                    const ShadowPair pair = stage.pairAt(x, z);
                    const double beside = double(pair.positionWorld.x) - double(far);
                    const bool isBelieved = isDarkByBelievedVoxel(stage.inputs, pair);
                    believedCount += isBelieved && beside > 0;
                    if (isBelieved) {
                        ASSERT_LE(beside, most);
                        ASSERT_TRUE(isDarkByBelievedVoxel(all, pair)); // a part of all
                    }
                    displacedCount +=
                        !isBelieved && beside > most && isDarkByBelievedVoxel(all, pair);
                }
            }
    EXPECT_GT(believedCount, 30u);  // displaced shadows that are within the bound
    EXPECT_GT(displacedCount, 30u); // and some that are not, and not believed
}

// In a fine grid far from the origin the lift is many voxels: b of shortenToBelieved.
TEST(ShadowRays, SegmentsStartWithinTheReachOfTheLineToTheLight) {
    RecordProperty("seed", std::to_string(kRaySeed));
    uint64_t state = kRaySeed;
    const auto random = [&] {
        return double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53 * 2.0 - 1.0;
    };
    for (const double far : {0.0, 1e3, 1e5})
        for (const float offset : {1.0f, 3.0f}) {
            SCOPED_TRACE(testing::Message() << "at " << far << ", offset " << offset);
            RayInputs inputs;
            inputs.options.offset = offset;
            inputs.dag.grid.resolutionLog2 = 12;
            inputs.dag.grid.voxelSizeWorld = 10.0 / 4096;
            inputs.dag.grid.originWorld = glm::dvec3(far, -5.0, -far);
            double largest = 0.0;
            for (int i = 0; i < 2000; ++i) {
                const auto point = [&] {
                    const double x = random(), y = random(), z = random();
                    return glm::vec3(glm::dvec3(far + 5.0 + 5.0 * x, 5.0 * y, 5.0 * z - far - 5.0));
                };
                ShadowPair pair{point(), {}, point(), 0, 0, false};
                const glm::dvec3 way =
                    glm::normalize(glm::dvec3(pair.lightWorld) - glm::dvec3(pair.positionWorld));
                const double x = random(), y = random(), z = random();
                pair.normalWorld = glm::normalize(glm::vec3(x, y, z));
                if (glm::dot(glm::dvec3(pair.normalWorld), way) < 0.0)
                    pair.normalWorld = -pair.normalWorld;
                const glm::dvec3 start = inputs.dag.grid.worldFromVoxel(
                    glm::dvec3(pairSegment(inputs, pair).segment.from));
                const glm::dvec3 moved = start - glm::dvec3(pair.positionWorld);
                const double beside = glm::length(moved - way * glm::dot(moved, way));
                const double most = double(offset) * voxelReachWorld(inputs, pair);
                EXPECT_LE(beside, most);
                largest = std::max(largest, beside / most);
            }
            EXPECT_GT(largest, 0.7); // and not by much less
        }
}

TEST(ShadowRays, NoneAndAllAreTheEndsOfWhatIsBelieved) {
    const PlateStage none(1.0f, 1.0f, 0.0f), all(1.0f, 1.0f, RayOptions{}.believe);
    for (const float x : {-1.5f, -0.5f, -0.01f, 0.5f}) {
        EXPECT_FALSE(isDarkByBelievedVoxel(none.inputs, none.pairAt(x, 0.3f)));
        EXPECT_EQ(isDarkByBelievedVoxel(all.inputs, all.pairAt(x, 0.3f)),
                  isStopped(all.inputs, pairSegment(all.inputs, all.pairAt(x, 0.3f))));
    }
    EXPECT_TRUE(isDarkByBelievedVoxel(all.inputs, all.pairAt(-0.5f, 0.3f)));
}

// The displacement towards a directional light is a voxel and the lift, wherever the voxel is.
TEST(ShadowRays, ADirectionalLightIsBelievedByTheSizeOfVoxelsAlone) {
    PlateStage stage(1.0f, 1.0f, 1.0f);
    const double voxel = stage.dag.grid.voxelSizeWorld;
    ShadowPair pair = stage.pairAt(-0.5f, 0.1f);
    pair.lightWorld = pair.positionWorld + glm::vec3(0, 1024, 0);
    pair.isDirectional = true;
    stage.inputs.options.believe = float(3.47 * voxel / stage.footprintWorld());
    EXPECT_TRUE(isDarkByBelievedVoxel(stage.inputs, pair));
    stage.inputs.options.believe = float(3.45 * voxel / stage.footprintWorld());
    EXPECT_FALSE(isDarkByBelievedVoxel(stage.inputs, pair));
}

} // namespace
} // namespace shadowdag::test
