// SPDX-License-Identifier: Apache-2.0
// Moving geometry tested by clusters, compared with tests pair by pair.
#include "hybrid/rays/mover_receivers.h"

#include "hybrid/rays/shadow_rays.h"
#include "scenes/split_mix.h"
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

/// Samples without a picture: what a cluster's kernel reads of a G-buffer.
struct Samples {
    std::vector<glm::vec3> positions, normals;
    std::vector<uint32_t> triangles, indices;

    GBufferView gbuffer() {
        GBufferView view;
        view.positionWorld = viewOf(positions);
        view.normalWorld = viewOf(normals);
        view.triangle = viewOf(triangles);
        return view;
    }
};

// Samples and lights anywhere around the mover and within it, on triangles of any facing, some of
// them degenerate to a plane (kBackground), lights below the plane and within c of it; clusters
// from points to rooms. Some pairs are not selected, some are dark before.
TEST(MoverReceivers, EqualPairByPairTests) {
    FailStage stage(failSceneOf("fail-mover"), 5, 1.0f);
    const MoverView movers = stage.renderer->movers();
    ASSERT_FALSE(movers.isNearLight.empty());
    const uint32_t triangleCount = uint32_t(movers.geometry.triangles.count());
    uint64_t state = 20261122;
    RecordProperty("seed", "20261122");
    const auto random = [&] {
        return float(double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53);
    };
    const auto place = [&] { return glm::vec3(6 * random() - 4, 2 * random(), 4 * random() - 2); };
    MoverReceivers receivers;
    uint64_t darkened = 0, lit = 0;
    for (int cluster = 0; cluster < 400; ++cluster) {
        const glm::vec3 middle = place();
        const float size = cluster % 3 == 0 ? 0.0f : cluster % 3 == 1 ? 0.2f : 3.0f;
        Samples samples;
        for (uint32_t i = 0; i < 1 + cluster % 40u; ++i) {
            samples.indices.push_back(i);
            const uint32_t triangle = uint32_t(random() * float(triangleCount));
            samples.triangles.push_back(i % 5 == 0 ? kBackground : triangle);
            const TriangleView& t = movers.geometry.triangles;
            if (cluster % 2 == 0 && i % 2 == 0) { // on the triangle
                const float u = random(), v = (1 - u) * random();
                samples.positions.push_back(t.vertex(triangle, 0) * (1 - u - v) +
                                            t.vertex(triangle, 1) * u + t.vertex(triangle, 2) * v);
            } else {
                samples.positions.push_back(middle + size * (place() - middle));
            }
            samples.normals.push_back(
                glm::normalize(glm::vec3(random(), random(), random()) - glm::vec3(0.4f)));
        }
        const GBufferView gbuffer = samples.gbuffer();
        receivers.reset();
        for (int light = 0; light < 4; ++light) {
            glm::vec3 position = place();
            if (light > 1) { // on a sample's plane, or so far below that its ray is raised much
                const glm::vec3 along = glm::cross(
                    samples.normals[0], glm::vec3(random(), random(), random()) - glm::vec3(0.5f));
                position = samples.positions[0] + 4.0f * along -
                           (light == 3 ? 2.0f : 0.0f) * samples.normals[0];
            }
            std::vector<uint8_t> isAsked, isDark, expected;
            uint32_t question = 0;
            for (uint32_t i = 0; i < samples.indices.size(); ++i) {
                isAsked.push_back(random() < 0.9f);
                isDark.push_back(isAsked[i] && random() < 0.2f);
                const bool isOpen = isAsked[i] && !isDark[i];
                question += isOpen;
                const bool isBlocked =
                    isOpen && isDarkByMovers(movers, {samples.positions[i], samples.normals[i],
                                                      position, samples.triangles[i], 0});
                expected.push_back(isDark[i] || isBlocked);
                darkened += isBlocked;
                lit += isOpen && !isBlocked;
            }
            EXPECT_EQ(receivers.answer(movers, gbuffer, viewOf(samples.indices), position,
                                       viewOf(isAsked), viewOf(isDark)),
                      question);
            ASSERT_EQ(isDark, expected) << "cluster " << cluster << ", light " << light;
        }
    }
    EXPECT_GT(darkened, 2000u);
    EXPECT_GT(lit, 10000u);
}

TEST(MoverReceivers, WithoutOpenPairsTraceNothing) {
    FailStage stage(failSceneOf("fail-mover"), 5, 1.0f);
    Samples samples{{{0, 0, 0}}, {{0, 1, 0}}, {kBackground}, {0}};
    const GBufferView gbuffer = samples.gbuffer();
    MoverReceivers receivers;
    std::vector<uint8_t> isAsked{1}, isDark{1};
    EXPECT_EQ(receivers.answer(stage.renderer->movers(), gbuffer, viewOf(samples.indices),
                               {0, 3, 0}, viewOf(isAsked), viewOf(isDark)),
              0u);
    EXPECT_EQ(isDark[0], 1);
    isAsked[0] = isDark[0] = 0;
    EXPECT_EQ(receivers.answer(stage.renderer->movers(), gbuffer, viewOf(samples.indices),
                               {0, 3, 0}, viewOf(isAsked), viewOf(isDark)),
              0u);
    EXPECT_EQ(isDark[0], 0);
}

} // namespace
} // namespace shadowdag::test
