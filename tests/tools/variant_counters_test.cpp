// SPDX-License-Identifier: Apache-2.0
// The effect of every part of a variant's name on the counters of one small frame, and on no other:
// visibilities that culling, static optimization and order of lights must not change stay.
#include "tools/settings/variants.h"

#include "scenes/world.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

namespace shadowdag {

namespace {

/// A floor, 6 x 6 crates, a finely tessellated mound; two lamps that reach over everything and six
/// small ones between the crates.
Scene crateScene() {
    Scene scene;
    scene.materials.resize(1);
    const auto place = [&](Mesh mesh) {
        mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
        scene.nodes.emplace_back().mesh = int(scene.meshes.size());
        scene.roots.push_back(int(scene.nodes.size()) - 1);
        scene.meshes.push_back(std::move(mesh));
    };
    const auto grid = [](uint32_t cells, const auto& at) {
        Mesh mesh;
        for (uint32_t z = 0; z <= cells; ++z)
            for (uint32_t x = 0; x <= cells; ++x)
                mesh.positions.push_back(at(float(x) / float(cells), float(z) / float(cells)));
        for (uint32_t z = 0; z < cells; ++z)
            for (uint32_t x = 0; x < cells; ++x) {
                const uint32_t a = z * (cells + 1) + x, b = a + cells + 1;
                mesh.triangles.insert(mesh.triangles.end(), {{a, b, a + 1}, {a + 1, b, b + 1}});
            }
        return mesh;
    };
    place(grid(24, [](float u, float v) { return glm::vec3(20 * u - 10, 0, 20 * v - 10); }));
    place(grid(48, [](float u, float v) {
        const float x = 2 * u - 1, z = 2 * v - 1;
        return glm::vec3(2 * x + 5, 1.5f * (1 - x * x) * (1 - z * z) + 0.01f, 2 * z - 6);
    }));
    for (int i = 0; i < 36; ++i) {
        const glm::vec3 lo(-7.0f + 2.4f * float(i % 6), 0, -7.0f + 2.4f * float(i / 6));
        Mesh mesh;
        for (int c = 0; c < 8; ++c)
            mesh.positions.push_back(
                lo + glm::vec3(c & 1 ? 0.8f : 0, c & 2 ? 0.8f : 0, c & 4 ? 0.8f : 0));
        mesh.triangles = {{0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}, {0, 4, 5}, {0, 5, 1},
                          {2, 3, 7}, {2, 7, 6}, {0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}};
        place(std::move(mesh));
    }
    scene.lights.resize(2);
    scene.lights[0].rangeWorld = 30.0f;
    scene.lights[1].rangeWorld = 3.0f;
    for (int i = 0; i < 8; ++i) {
        scene.nodes.emplace_back().light = i < 2 ? 0 : 1;
        scene.nodes.back().local.translation =
            i < 2 ? glm::vec3(i == 0 ? -6 : 6, 5, 2)
                  : glm::vec3(-5.8f + 2.4f * float(i - 2), 1.4f, 1.4f);
        scene.roots.push_back(int(scene.nodes.size()) - 1);
    }
    return scene;
}

class VariantCounters : public testing::Test {
protected:
    VariantCounters()
        : scene_(crateScene()), world_(scene_, {}),
          dag_(voxelize(world_.triangles(), viewOf(world_.staticTriangles()),
                        gridAround(world_.boundsWorld(), 8))),
          renderer_(Backend::kCpu, world_, dag_) {
        camera_.positionWorld = {0, 4, 11};
        camera_.forward = glm::normalize(glm::vec3(0, -0.35f, -1));
        camera_.up = glm::normalize(
            glm::cross(glm::cross(camera_.forward, glm::vec3(0, 1, 0)), camera_.forward));
    }

    static RunParameters runOf(const std::string& name) {
        FrameOptions base;
        base.width = 192;
        base.height = 108;
        base.maps.pageTexels = 16;
        return variantRun(parseVariant("name", name), base);
    }

    /// Returns a frame of a variant, rendered `frames` times in sequence.
    FrameResult render(const std::string& name, int frames = 1) {
        const RunParameters run = runOf(name);
        renderer_.reset();
        FrameResult result;
        for (int frame = 0; frame < frames; ++frame)
            result = renderer_.render(camera_, *makeCostModel(run.model), run.frame);
        return result;
    }

    /// Returns how many maps change their method between the frames of a variant while the camera
    /// steps back and forth.
    size_t countRouteChanges(const std::string& name) {
        const RunParameters run = runOf(name);
        const Camera still = camera_;
        renderer_.reset();
        size_t changes = 0;
        std::map<std::pair<uint32_t, uint32_t>, Route> before;
        for (int frame = 0; frame < 8; ++frame) {
            camera_.positionWorld = still.positionWorld + glm::vec3(0, 0, frame % 2 ? 0.25f : 0);
            for (const MapRecord& map :
                 renderer_.render(camera_, *makeCostModel(run.model), run.frame).maps) {
                const std::pair key(map.quantities.light, map.quantities.octave);
                const auto [found, isNew] = before.try_emplace(key, map.route);
                changes += !isNew && found->second != map.route;
                found->second = map.route;
            }
        }
        camera_ = still;
        return changes;
    }

    static uint64_t lightingComputations(const FrameResult& frame) {
        uint64_t count = frame.counts.provenPairCount;
        for (const MapRecord& map : frame.maps)
            count += map.quantities.samples;
        return count;
    }

    Scene scene_;
    World world_;
    Dag dag_;
    FrameRenderer renderer_;
    Camera camera_;
};

/// Expects `less` to be at most `share` of `more`, neither of them 0.
void expectShare(uint64_t less, uint64_t more, double share) {
    EXPECT_GT(less, 0u);
    EXPECT_LE(double(less), share * double(more)) << less << " of " << more;
}

} // namespace

TEST_F(VariantCounters, EveryCullingDrawsFewerTrianglesWithTheSameResults) {
    const FrameResult sphere = render("Sphere"), cfm = render("CFM"), pmc = render("PMC"),
                      pmcd = render("PMCD"), pmcc = render("PMCC");
    const auto drawn = [](const FrameResult& f) { return f.counts.maps.triangleDrawCount; };
    EXPECT_EQ(drawn(sphere), sphere.counts.maps.triangleSphereCount);
    expectShare(drawn(cfm), drawn(sphere), 0.6);
    expectShare(drawn(pmc), drawn(cfm), 0.95);
    expectShare(drawn(pmcd), drawn(pmc), 1.0);
    expectShare(drawn(pmcc), drawn(pmcd), 1.0);
    for (const FrameResult* other : {&cfm, &pmc, &pmcd, &pmcc}) {
        EXPECT_EQ(other->visibility, sphere.visibility);
        EXPECT_EQ(other->counts.maps.pageCount, sphere.counts.maps.pageCount);
    }
}

TEST_F(VariantCounters, ExplicitBoundsNeedFewerTexelsAndTriangles) {
    const FrameResult implicit = render("PMCD"), eb = render("PMCD-EB"), tight = render("PMCD-TB");
    expectShare(eb.counts.clusterLightCount, implicit.counts.clusterLightCount, 0.98);
    expectShare(eb.counts.maps.triangleDrawCount, implicit.counts.maps.triangleDrawCount, 0.95);
    EXPECT_LE(tight.counts.clusterLightCount, eb.counts.clusterLightCount);
    EXPECT_EQ(eb.counts.clusterCount, implicit.counts.clusterCount);
    EXPECT_EQ(eb.counts.pairCount, implicit.counts.pairCount);
}

TEST_F(VariantCounters, MapsALightSplitWhatOneMapAllocatesByItsNearest) {
    const FrameResult one = render("PMCD-EB-1SM"), four = render("PMCD-EB");
    EXPECT_EQ(one.maps.size(), 8u);
    EXPECT_GT(four.maps.size(), one.maps.size());
    EXPECT_LE(four.maps.size(), 4 * one.maps.size());
    expectShare(four.counts.maps.texelCount, one.counts.maps.texelCount, 1.0);
}

TEST_F(VariantCounters, UndersamplingByTwoHalvesTheRequests) {
    const FrameResult full = render("PMCD-EB-1SM"), half = render("PMCD-EB-1SM-u2");
    ASSERT_EQ(full.maps.size(), half.maps.size());
    for (size_t m = 0; m < full.maps.size(); ++m)
        EXPECT_NEAR(half.maps[m].quantities.texels, 0.5f * full.maps[m].quantities.texels,
                    1e-3f * full.maps[m].quantities.texels);
    expectShare(half.counts.maps.texelCount, full.counts.maps.texelCount, 0.6);
}

TEST_F(VariantCounters, NormalClustersAreMoreAndShadeFewerPairs) {
    const FrameResult plain = render("PMCD-EB"), nk3 = render("PMCD-EB-Nk3");
    EXPECT_GT(nk3.counts.clusterCount, plain.counts.clusterCount);
    expectShare(lightingComputations(nk3), lightingComputations(plain), 0.9);
    EXPECT_EQ(nk3.counts.pairCount, plain.counts.pairCount);
}

TEST_F(VariantCounters, StaticOptimizationRedrawsNoStaticGeometry) {
    const FrameResult plain = render("PMCD-EB", 2), kept = render("PMCD-EB-SO", 2);
    EXPECT_GT(plain.counts.maps.triangleDrawCount, 0u);
    EXPECT_EQ(kept.counts.maps.triangleDrawCount, 0u);
    EXPECT_GT(kept.counts.maps.triangleKeptCount, 0u);
    EXPECT_EQ(kept.counts.maps.pagesCommittedCount, 0u);
    EXPECT_EQ(kept.visibility, plain.visibility);
}

TEST_F(VariantCounters, LevelsOfDetailDrawFewerTriangles) {
    expectShare(render("PMCD-EB-PLOD2").counts.maps.triangleDrawCount,
                render("PMCD-EB").counts.maps.triangleDrawCount, 0.9);
}

TEST_F(VariantCounters, PairsThatDoNotFaceOrAreProvenLitNeedNoPage) {
    const FrameResult plain = render("PMCD-EB"), facing = render("PMCD-EB-FP"),
                      lit = render("PMCD-EB-LP");
    EXPECT_EQ(plain.counts.prunedClusterLightCount, 0u);
    EXPECT_GT(facing.counts.prunedClusterLightCount, 0u);
    EXPECT_EQ(facing.counts.pairCount, plain.counts.pairCount);
    EXPECT_GT(lit.counts.prunedClusterLightCount, facing.counts.prunedClusterLightCount);
    EXPECT_GT(lit.counts.provenPairCount, 0u);
    expectShare(lit.counts.maps.pageCount, plain.counts.maps.pageCount, 0.98);
}

TEST_F(VariantCounters, PagesOfLookupsAreFewerWithTheSameResults) {
    const FrameResult boxes = render("PMCD-EB"), lookups = render("PMCD-EB-SP");
    EXPECT_EQ(lookups.visibility, boxes.visibility);
    EXPECT_EQ(lookups.counts.missingTapCount, 0u);
    EXPECT_EQ(lookups.counts.maps.degradeDivisor, boxes.counts.maps.degradeDivisor);
    expectShare(lookups.counts.maps.pageCount, boxes.counts.maps.pageCount, 0.9);
}

TEST_F(VariantCounters, OneTapIsLitOrDark) {
    const FrameResult nine = render("PMCD-EB-T9"), one = render("PMCD-EB-T1");
    for (const uint8_t visibility : one.visibility)
        ASSERT_TRUE(visibility == 0 || visibility == 255);
    size_t between = 0;
    for (const uint8_t visibility : nine.visibility)
        between += visibility > 0 && visibility < 255;
    EXPECT_GT(between, 100u);
    EXPECT_EQ(one.counts.lookupCount, nine.counts.lookupCount);
    EXPECT_LE(one.counts.maps.pageCount, nine.counts.maps.pageCount);
}

TEST_F(VariantCounters, ReorderedListsChangeNoCounterAndNoResult) {
    const FrameResult plain = render("PMCD-EB"), ordered = render("PMCD-EB-RL");
    EXPECT_EQ(ordered.visibility, plain.visibility);
    EXPECT_EQ(ordered.counts.clusterLightCount, plain.counts.clusterLightCount);
    EXPECT_EQ(ordered.counts.maps.triangleDrawCount, plain.counts.maps.triangleDrawCount);
}

TEST_F(VariantCounters, DagTracesAllAndTheHybridSomePairs) {
    const FrameResult rays = render("RT"), hybrid = render("Hybrid:texels:48");
    EXPECT_EQ(rays.counts.rayCount, rays.counts.pairCount);
    EXPECT_EQ(rays.counts.lookupCount, 0u);
    EXPECT_EQ(rays.counts.maps.pageCount, 0u);
    EXPECT_GT(hybrid.counts.rayCount, 0u);
    EXPECT_GT(hybrid.counts.lookupCount, 0u);
    EXPECT_EQ(hybrid.counts.rayCount + hybrid.counts.lookupCount, rays.counts.pairCount);
}

TEST_F(VariantCounters, AMarginKeepsRoutesWhileRequestsVary) {
    // A threshold between what a lamp asks for from the camera's two places: without a margin it
    // changes its method in every frame.
    const float here = render("PMCD-EB-1SM").maps.front().quantities.texels;
    camera_.positionWorld.z += 0.25f;
    const float there = render("PMCD-EB-1SM").maps.front().quantities.texels;
    camera_.positionWorld.z -= 0.25f;
    ASSERT_NE(here, there);
    const std::string name = "Hybrid:texels:" + std::to_string(0.5f * (here + there)) + "-1SM";
    EXPECT_GE(countRouteChanges(name), 7u);
    EXPECT_EQ(countRouteChanges(name + "-RH0"), countRouteChanges(name));
    EXPECT_EQ(countRouteChanges(name + "-RH0.2"), 0u);
}

TEST_F(VariantCounters, AnotherRuleRequestsOtherResolutions) {
    const FrameResult paper = render("PMCD-EB-1SM"), plane = render("PMCD-EB-1SM-RP");
    ASSERT_EQ(paper.maps.size(), plane.maps.size());
    bool differs = false;
    for (size_t m = 0; m < paper.maps.size(); ++m)
        differs |= paper.maps[m].quantities.texels != plane.maps[m].quantities.texels;
    EXPECT_TRUE(differs);
    EXPECT_EQ(paper.counts.clusterLightCount, plane.counts.clusterLightCount);
}

} // namespace shadowdag
