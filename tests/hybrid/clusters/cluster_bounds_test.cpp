// SPDX-License-Identifier: Apache-2.0
// Explicit bounds: both ends of every field, planes that no rounding crosses, boxes between the
// cell's and the samples'.
#include "hybrid/clusters/cluster_pass.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/seen_soup.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace shadowdag::test {
namespace {

TEST(ExplicitBounds, EveryFieldIsReadFromBothEnds) {
    const Box cell{{0, 10, -20}, {10, 30, 80}};
    for (int axis = 0; axis < 3; ++axis) {
        const float low = cell.min[axis], tenth = (cell.max[axis] - low) / 10.0f;
        const auto shrunk = [&](uint32_t tenths) {
            const Box box = shrinkToTenths(cell, tenths << (axis * 10));
            for (int other = 0; other < 3; ++other)
                if (other != axis) { // a field without bits keeps the side
                    EXPECT_EQ(box.min[other], cell.min[other]);
                    EXPECT_EQ(box.max[other], cell.max[other]);
                }
            return std::pair((box.min[axis] - low) / tenth, (box.max[axis] - low) / tenth);
        };
        EXPECT_EQ(shrunk(1u << 0), std::pair(0.0f, 1.0f));
        EXPECT_EQ(shrunk(1u << 9), std::pair(9.0f, 10.0f));
        EXPECT_EQ(shrunk(1u << 0 | 1u << 9), std::pair(0.0f, 10.0f));
        EXPECT_EQ(shrunk(kTenthsMask), std::pair(0.0f, 10.0f));
        EXPECT_EQ(shrunk(1u << 2 | 1u << 3 | 1u << 6), std::pair(2.0f, 7.0f));
        for (uint32_t bit = 0; bit < kTenths; ++bit) {
            EXPECT_EQ(shrunk(1u << bit), std::pair(float(bit), float(bit + 1)));
            EXPECT_EQ(tenthBit(axis, bit), 1u << (axis * 10 + bit));
            EXPECT_EQ(tenthsOf(tenthBit(axis, bit), axis), 1u << bit);
            EXPECT_EQ(firstTenth(1u << bit), bit);
            EXPECT_EQ(lastTenth(1u << bit), bit);
        }
    }
    EXPECT_EQ(shrinkToTenths(cell, 0x3fffffffu), cell);
    EXPECT_EQ(shrinkToTenths(cell, 0), cell);
}

TEST(ExplicitBounds, ContainEveryPointOfTheCellBesideAPlaneAsWell) {
    constexpr uint64_t kSeed = 20;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (int round = 0; round < 20000; ++round) {
        // From cells at the origin to cells so far away that a tenth is less than a float's step.
        const float away = std::ldexp(1.0f, int(random() % 24));
        const float low = (unit(random) - 0.5f) * away;
        const float high = low + std::ldexp(unit(random), int(random() % 12) - 8);
        const uint32_t plane = uint32_t(random() % 11);
        for (float p : {low, high, low + unit(random) * (high - low), tenthPlane(low, high, plane),
                        std::nextafter(tenthPlane(low, high, plane), 1e30f),
                        std::nextafter(tenthPlane(low, high, plane), -1e30f)}) {
            p = std::clamp(p, low, high);
            const uint32_t tenth = tenthOf(low, high, p);
            ASSERT_LT(tenth, kTenths);
            ASSERT_LE(tenthPlane(low, high, tenth), p) << low << " to " << high;
            ASSERT_GE(tenthPlane(low, high, tenth + 1), p) << low << " to " << high;
        }
        ASSERT_EQ(tenthPlane(low, high, 0), low);
        ASSERT_EQ(tenthPlane(low, high, 10), high);
        for (uint32_t i = 0; i < 10; ++i)
            ASSERT_LE(tenthPlane(low, high, i), tenthPlane(low, high, i + 1));
    }
    EXPECT_EQ(tenthOf(3.0f, 3.0f, 3.0f), 0u); // a cell without depth
}

double volume(const Box& box) {
    const glm::dvec3 e(box.extent());
    return e.x * e.y * e.z;
}

double sumOfVolumes(const ClusterView& clusters) {
    double sum = 0.0;
    for (const Box& box : clusters.boxesWorld)
        sum += volume(box);
    return sum;
}

TEST(ExplicitBounds, LieBetweenTheCellsAndTheSamplesBoxes) {
    const TriangleSoup soup = randomSoup(5, 500);
    const ViewRays view = makeViewRays(frontCamera(), 400, 200);
    const GBuffer gbuffer = drawSoup(soup, view);
    ClusterSet byCell(Backend::kCpu), byTenths(Backend::kCpu), bySamples(Backend::kCpu);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kImplicit, byCell);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kExplicit, byTenths);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, bySamples);
    const ClusterView cells = byCell.view(), tenths = byTenths.view(), samples = bySamples.view();
    ASSERT_EQ(cells.count(), tenths.count());
    for (size_t c = 0; c < cells.count(); ++c) {
        const Box outer = cells.boxesWorld[c], box = tenths.boxesWorld[c];
        const Box inner = samples.boxesWorld[c];
        for (int axis = 0; axis < 3; ++axis) {
            const float tenth = (outer.max[axis] - outer.min[axis]) * 0.1001f;
            ASSERT_LE(outer.min[axis], box.min[axis]);
            ASSERT_GE(outer.max[axis], box.max[axis]);
            ASSERT_LE(box.min[axis], inner.min[axis]);
            ASSERT_GE(box.max[axis], inner.max[axis]);
            ASSERT_LE(inner.min[axis] - box.min[axis], tenth);
            ASSERT_LE(box.max[axis] - inner.max[axis], tenth);
        }
    }
    const double implicit = sumOfVolumes(cells), explicitVolume = sumOfVolumes(tenths),
                 tight = sumOfVolumes(samples);
    EXPECT_LT(explicitVolume, 0.5 * implicit);
    EXPECT_LT(tight, explicitVolume);
    EXPECT_GT(tight, 0.3 * explicitVolume);
    RecordProperty("explicit_of_implicit", std::to_string(explicitVolume / implicit));
    RecordProperty("tight_of_implicit", std::to_string(tight / implicit));
}

TEST(ExplicitBounds, AreTheSameForOneAndTwoThreads) {
    const TriangleSoup soup = randomSoup(8, 500);
    const ViewRays view = makeViewRays(frontCamera(), 320, 200);
    const GBuffer gbuffer = drawSoup(soup, view);
    std::vector<Box> boxes[2];
    for (const uint32_t threads : {1u, 2u}) {
        setThreadCount(threads);
        ClusterSet clusters(Backend::kCpu);
        buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kExplicit, clusters, 3);
        boxes[threads - 1] = clusters.boxesWorld.download();
    }
    setThreadCount(0);
    EXPECT_EQ(boxes[0], boxes[1]);
}

uint64_t texelsOf(const FrameResult& frame) {
    uint64_t sum = 0;
    for (const MapRecord& map : frame.maps)
        sum += uint64_t(map.quantities.faceTexels) * map.quantities.faceTexels;
    return sum;
}

TEST(ExplicitBounds, SaveLightsOfClustersAndTrianglesAndChangeNoRay) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    FrameOptions options = failFrame();
    options.width = 640;
    options.height = 360;
    const auto frameOf = [&](ClusterBounds bounds, const char* model) {
        options.clusterBounds = bounds;
        stage.renderer->reset();
        return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
    };
    const FrameResult cells = frameOf(ClusterBounds::kImplicit, "texels:0"),
                      tenths = frameOf(ClusterBounds::kExplicit, "texels:0");
    EXPECT_EQ(tenths.counts.clusterCount, cells.counts.clusterCount);
    EXPECT_LT(tenths.counts.clusterLightCount, cells.counts.clusterLightCount);
    EXPECT_LE(tenths.counts.maps.triangleDrawCount, cells.counts.maps.triangleDrawCount);
    EXPECT_EQ(tenths.counts.missingTapCount, 0u);
    EXPECT_EQ(tenths.pairs.light, cells.pairs.light);
    RecordProperty("cluster_lights", std::to_string(cells.counts.clusterLightCount) + " to " +
                                         std::to_string(tenths.counts.clusterLightCount));
    RecordProperty("triangles", std::to_string(cells.counts.maps.triangleDrawCount) + " to " +
                                    std::to_string(tenths.counts.maps.triangleDrawCount));
    EXPECT_EQ(frameOf(ClusterBounds::kExplicit, "texels:inf").visibility,
              frameOf(ClusterBounds::kImplicit, "texels:inf").visibility);
}

TEST(ResolutionRule, OfThePlaneRequestsMoreAtObliqueLightWithSmallerErrors) {
    FailStage stage(failSceneOf("fail-oblique-undersampling"), 6);
    FrameOptions options = failFrame();
    options.mapsPerLight = 4;
    options.maxFaceTexels = 8192;
    const auto frameOf = [&](ResolutionRule rule) {
        options.resolutionRule = rule;
        return stage.run("texels:0", options);
    };
    const FailOutcome sphere = frameOf(ResolutionRule::kSphere);
    const FailOutcome plane = frameOf(ResolutionRule::kPlane);
    EXPECT_GT(texelsOf(plane.frame), 3 * texelsOf(sphere.frame));
    EXPECT_LT(plane.report.total.absVisibilityErrorSum,
              0.7 * sphere.report.total.absVisibilityErrorSum);
    EXPECT_EQ(plane.frame.counts.missingTapCount, 0u);
    RecordProperty("texels_over_sphere",
                   std::to_string(double(texelsOf(plane.frame)) / texelsOf(sphere.frame)));
    RecordProperty("error_over_sphere", std::to_string(plane.report.total.absVisibilityErrorSum /
                                                       sphere.report.total.absVisibilityErrorSum));
}

} // namespace
} // namespace shadowdag::test
