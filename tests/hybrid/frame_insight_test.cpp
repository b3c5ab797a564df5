// SPDX-License-Identifier: Apache-2.0
// Data of a frame for inspection: clusters, their lights, demands, projection maps.
#include "hybrid/frame.h"

#include "shadowmap/page_mask.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::test {
namespace {

TEST(FrameInsight, ClustersContainEverySampleOnceAndTheirLightsEveryPair) {
    Stage stage(blockerScene(kManyLights, true));
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    const ClusterView clusters = stage.renderer.clusters();
    const ClusterLightsView lists = stage.renderer.clusterLights();
    ASSERT_EQ(clusters.count(), frame.counts.clusterCount);
    const GBufferView gbuffer = stage.renderer.gbuffer();
    size_t sampleCount = 0;
    for (uint32_t c = 0; c < clusters.count(); ++c)
        for (uint32_t i = clusters.sampleStart[c]; i < clusters.sampleStart[c + 1]; ++i) {
            const uint32_t s = clusters.samples[i];
            ++sampleCount;
            ASSERT_EQ(clusters.clusterOfSample[s], c);
            ASSERT_EQ(distanceSquared(clusters.boxesWorld[c], gbuffer.positionWorld[s]), 0.0f);
            for (uint64_t p = frame.pairs.sampleStart[s]; p < frame.pairs.sampleStart[s + 1]; ++p)
                ASSERT_TRUE(std::binary_search(lists.lights.data + lists.start[c],
                                               lists.lights.data + lists.start[c + 1],
                                               frame.pairs.light[p]));
        }
    EXPECT_EQ(sampleCount, frame.counts.sampleCount);
}

TEST(FrameInsight, AMapRequestsTheMaximumOfItsClusters) {
    Stage stage(blockerScene(kManyLights, true));
    FrameOptions options = smallFrame();
    options.undersample = 2;
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    const ClusterLightsView lists = stage.renderer.clusterLights();
    const View<const float> wanted = stage.renderer.wantedSquared();
    ASSERT_EQ(wanted.count, lists.lights.count);
    std::vector<float> most(frame.maps.size(), 0.0f);
    for (size_t i = 0; i < wanted.count; ++i)
        if (lists.record[i] != kProvenLit)
            most[lists.record[i]] = std::max(most[lists.record[i]], wanted[i]);
    for (size_t r = 0; r < most.size(); ++r)
        EXPECT_FLOAT_EQ(std::sqrt(most[r]) / 2.0f, frame.maps[r].quantities.texels) << r;
}

TEST(FrameInsight, ProjectionMapsContainTheCellOfEveryPair) {
    Stage stage(blockerScene(kManyLights, true));
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    const View<const uint32_t> words = stage.renderer.projectionMaps();
    const ShadowMapView maps = stage.renderer.shadowMaps();
    ASSERT_EQ(words.count, frame.counts.drawnMapCount * kProjectionWordsPerMap);
    const GBufferView gbuffer = stage.renderer.gbuffer();
    size_t setCount = 0;
    for (const uint32_t word : words)
        setCount += size_t(std::popcount(word));
    EXPECT_LT(setCount, size_t(words.count) * 32) << "all cells are set: nothing is told";
    for (size_t s = 0; s < gbuffer.count(); ++s)
        for (uint64_t p = frame.pairs.sampleStart[s]; p < frame.pairs.sampleStart[s + 1]; ++p) {
            if (!frame.pairServer[p].isMap())
                continue;
            const uint32_t map = frame.pairServer[p].map();
            const glm::vec3 d = gbuffer.positionWorld[s] - maps.maps[map].lightPositionWorld;
            const uint32_t face = faceOf(d);
            const glm::vec3 q = faceFromLight(face, d);
            const uint32_t u = faceCell(q.x / q.z, kProjectionMapSize),
                           v = faceCell(q.y / q.z, kProjectionMapSize);
            ASSERT_TRUE(
                words[size_t(map) * kProjectionWordsPerMap + face * kProjectionMapSize + v] >> u &
                1u)
                << "sample " << s << " map " << map;
        }
}

} // namespace
} // namespace shadowdag::test
