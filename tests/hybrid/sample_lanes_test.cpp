// SPDX-License-Identifier: Apache-2.0
// Marking and colour in lanes: the bits of light_leaf.h by every instruction set.
#include "hybrid/frame/sample_lanes.h"

#include "scenes/split_mix.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSampleSeed = 20261126;

class SampleLanesBy : public testing::TestWithParam<StreamIsa> {
protected:
    void SetUp() override {
        RecordProperty("seed", std::to_string(kSampleSeed));
        if (!hasStreamIsa(GetParam()))
            GTEST_SKIP() << "this processor or build has no " << streamIsaName(GetParam());
    }
    /// Returns a number in [-1, 1).
    float random() {
        return float(double(splitMix64(state_ += kSplitMixGamma) >> 40) * 0x1p-23 - 1.0);
    }
    glm::vec3 randomPoint() {
        const float x = random(), y = random(), z = random();
        return {x, y, z};
    }
    Light randomLight(Light::Kind kind) {
        Light light;
        light.kind = kind;
        light.positionWorld = randomPoint();
        light.rangeWorld = 1.0f + random();
        light.intensity = glm::abs(randomPoint());
        light.directionWorld = glm::normalize(randomPoint());
        light.cosOuter = random();
        light.cosInner = std::min(1.0f, light.cosOuter + 0.3f);
        light.directionalDistanceWorld = 16.0f;
        return light;
    }

    uint64_t state_ = kSampleSeed;
};

bool sameBits(const glm::vec3& a, const glm::vec3& b) {
    for (int i = 0; i < 3; ++i)
        if (std::bit_cast<uint32_t>(a[i]) != std::bit_cast<uint32_t>(b[i]))
            return false;
    return true;
}

TEST_P(SampleLanesBy, EqualTheOneTextBitForBit) {
    SampleLanes lanes(GetParam());
    uint32_t askedTotal = 0, count = 0;
    for (int cluster = 0; cluster < 60; ++cluster) {
        count = (count * 7 + 5) % 83; // from 0 samples to several vectors, mostly not whole ones
        std::vector<glm::vec3> positions, normals, albedos, colors;
        for (uint32_t i = 0; i < count; ++i) {
            positions.push_back(randomPoint());
            normals.push_back(glm::normalize(randomPoint()));
            albedos.push_back(glm::abs(randomPoint()));
            colors.push_back(glm::abs(randomPoint()));
        }
        std::vector<Light> lights;
        for (const Light::Kind kind : {Light::kPoint, Light::kSpot, Light::kSun})
            for (int i = 0; i < 4; ++i)
                lights.push_back(randomLight(kind));
        if (count > 2) { // at the light; at exactly its range; on the cone's axis
            positions[0] = lights[0].positionWorld;
            lights[1].positionWorld = {0, 0, 0};
            lights[1].rangeWorld = 0.5f;
            positions[1] = {0.5f, 0, 0};
            positions[2] = lights[4].positionWorld + lights[4].directionWorld * 0.25f;
        }
        lanes.reset(count);
        ASSERT_EQ(lanes.count(), count);
        for (uint32_t i = 0; i < count; ++i)
            lanes.set(i, positions[i], normals[i], albedos[i], colors[i]);
        for (const Light& light : lights) {
            uint32_t asked = 0;
            const uint32_t marked = lanes.mark(light);
            for (uint32_t i = 0; i < count; ++i) {
                const bool is = lightsSample(light, positions[i], normals[i]);
                ASSERT_EQ(lanes.isAsked()[i], is) << "cluster " << cluster << ", sample " << i;
                asked += is;
                const auto seen = uint8_t(std::array{0, 255, 64, 191}[i % 4]);
                lanes.seen()[i] = seen;
                if (is && seen != 0)
                    colors[i] += reflectedLight(lightIrradiance(light, positions[i]),
                                                towardsLight(light, positions[i]), normals[i],
                                                albedos[i], seen);
            }
            EXPECT_EQ(marked, asked);
            askedTotal += asked;
            lanes.add();
            for (uint32_t i = 0; i < count; ++i)
                ASSERT_TRUE(sameBits(lanes.color(i), colors[i]))
                    << "cluster " << cluster << ", sample " << i << ", kind " << light.kind;
        }
    }
    EXPECT_GT(askedTotal, 3000u);
}

INSTANTIATE_TEST_SUITE_P(EveryIsa, SampleLanesBy,
                         testing::Values(StreamIsa::kPortable, StreamIsa::kAvx2,
                                         StreamIsa::kAvx512),
                         [](const auto& info) {
                             const std::string name = streamIsaName(info.param);
                             return name == "AVX-512" ? std::string("AVX512") : name;
                         });

} // namespace
} // namespace shadowdag::test
