// SPDX-License-Identifier: Apache-2.0
// The judge's own ends and levels of voxel rays: closed forms, and against the method's.
#include "hybrid/judge/own_segment.h"

#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace shadowdag {
namespace {

RayInputs inputsOf(uint32_t resolutionLog2, double voxelSizeWorld) {
    RayInputs inputs;
    inputs.dag.grid.resolutionLog2 = resolutionLog2;
    inputs.dag.grid.voxelSizeWorld = voxelSizeWorld;
    inputs.options.offset = 1.0f;
    inputs.detail = {{0, 0, 0}, {0, 0, 1}, 0.02, {}};
    return inputs;
}

// A floor, the light straight above: the start rises by a voxel and goes on by one, the end is
// drawn back by sqrt(3).
TEST(OwnSegment, EndsMoveByTheDocumentedOffsets) {
    RayInputs inputs = inputsOf(10, 0.01);
    const ShadowPair pair{{5, 1, 5}, {0, 1, 0}, {5, 7, 5}, 0, 0};
    OwnSegment own = makeOwnSegment(inputs, pair);
    EXPECT_EQ(own.startLevel, 0u);
    EXPECT_NEAR(own.liftWorld, 0.01, 1e-4); // and what allows for rounding
    EXPECT_NEAR(own.startOffsetWorld, 0.02, 1e-4);
    EXPECT_NEAR(own.endOffsetWorld, 0.01 * std::sqrt(3.0), 1e-8);
    inputs.options.level = 3;
    own = makeOwnSegment(inputs, pair);
    EXPECT_NEAR(own.startOffsetWorld, 0.16, 1e-4);
    EXPECT_EQ(own.coarsestLevelAt({0, 0, 0}, 8.0), 3u);
    inputs.options.offset = 0.0f;
    own = makeOwnSegment(inputs, pair);
    EXPECT_EQ(own.startOffsetWorld, 0.0);
    EXPECT_EQ(own.endOffsetWorld, 0.0);
}

TEST(OwnSegment, LevelsFallTowardsTheLight) {
    RayInputs inputs = inputsOf(12, 0.01);
    inputs.options.lod = LodRule::kFootprint;
    inputs.options.footprintScale = 1.001f;                       // 8 itself is a rounding away
    const ShadowPair pair{{0, 1, 4}, {0, 1, 0}, {0, 7, 4}, 0, 0}; // a pixel is 8 voxels wide
    const OwnSegment own = makeOwnSegment(inputs, pair);
    EXPECT_EQ(own.startLevel, 3u);
    const auto coarsestAt = [&](double share) { // of the way from the light
        return own.coarsestLevelAt(own.lightVoxel + glm::dvec3(0, -600.0 * share, 0), 0.0);
    };
    EXPECT_EQ(coarsestAt(1.0), 3u);
    EXPECT_EQ(coarsestAt(0.9), 2u);
    EXPECT_EQ(coarsestAt(0.26), 1u);
    EXPECT_EQ(coarsestAt(0.2), 0u);
    EXPECT_EQ(own.coarsestLevelAt(own.lightVoxel + glm::dvec3(0, -540, 0), 80.0), 3u);
}

// The method's text and the judge's, written apart, agree on every kind of pair.
TEST(OwnSegment, EqualsWhatTheMethodDoes) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const auto direction = [&] {
        for (;;) {
            const glm::vec3 v(unit(rng), unit(rng), unit(rng));
            if (const float length = glm::length(v); length > 0.1f && length < 1.0f)
                return v / length;
        }
    };
    int bent = 0, levelCount = 0;
    for (int i = 0; i < 4000; ++i) {
        RayInputs inputs = inputsOf(6 + uint32_t(i % 7), 0.01 * std::exp2(3.0 * double(unit(rng))));
        const VoxelGrid& grid = inputs.dag.grid;
        inputs.options.offset = std::exp2(2.0f * unit(rng));
        inputs.options.level = uint32_t(i % 3);
        if (i % 4 == 0)
            inputs.options.lod = i % 8 ? LodRule::kFootprint : LodRule::kCoverage;
        const float side = float(grid.resolution() * grid.voxelSizeWorld);
        ShadowPair pair{glm::vec3(0.5f * side) + 0.5f * side * direction() * unit(rng),
                        direction(),
                        glm::vec3(0),
                        0,
                        0,
                        i % 5 == 0};
        glm::vec3 towards = direction();
        if (glm::dot(towards, pair.normalWorld) < 0.0f)
            towards = -towards;
        if (i % 6 == 0) // low over the plane
            towards = glm::normalize(towards - 0.999f * glm::dot(towards, pair.normalWorld) *
                                                   pair.normalWorld);
        const float reach = pair.isDirectional ? 100.0f : std::exp2(4.0f * unit(rng) - 3.0f);
        pair.lightWorld = pair.positionWorld + towards * reach * side;
        const uint32_t asked = std::bit_cast<uint32_t>(std::exp2(8.0f + 8.0f * unit(rng)));
        if (i % 3 != 0) // texels of the pair's light
            inputs.detail.resolutionSquaredBits = {&asked, 1};
        const PairSegment method = pairSegment(inputs, pair);
        const OwnSegment own = makeOwnSegment(inputs, pair);
        ASSERT_EQ(own.startLevel, method.startLevel) << i;
        const auto moved = [&](const glm::vec3& end, const glm::vec3& world) {
            return glm::length(glm::dvec3(end) - grid.voxelFromWorld(glm::dvec3(world))) *
                   grid.voxelSizeWorld;
        };
        const double slack = 1e-3 * double(1u << method.startLevel) * grid.voxelSizeWorld;
        const double start = moved(method.segment.from, pair.positionWorld);
        ASSERT_NEAR(own.startOffsetWorld, start, slack) << i;
        if (!pair.isDirectional) {
            const double end = moved(method.segment.to, pair.lightWorld);
            ASSERT_NEAR(own.endOffsetWorld, end, slack + 1e-6 * end) << i;
        }
        if (inputs.options.lod != LodRule::kFixed) { // no cell that stops the ray is coarser
            const LodTimes times = footprintLodTimes(grid, method.segment, method.footprint);
            const glm::dvec3 from(method.segment.from), to(method.segment.to);
            for (uint32_t level = 0; level <= times.top; ++level)
                for (const float t : {times.begin[level], times.end[level]}) {
                    ASSERT_LE(level, own.coarsestLevelAt(from + (to - from) * double(t), 0.0))
                        << i << " at " << t;
                    ++levelCount;
                }
        }
        bent += glm::dot(glm::dvec3(method.segment.to - method.segment.from),
                         glm::dvec3(pair.normalWorld)) < 1e-3;
    }
    EXPECT_GT(levelCount, 1000);
    EXPECT_GT(bent, 10) << "no ray would have fallen under its plane: the test shows less";
}

} // namespace
} // namespace shadowdag
