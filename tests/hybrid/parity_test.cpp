// SPDX-License-Identifier: Apache-2.0
// Parity of the frame: every pass, and whole frames by every method, over every built-in scene;
// over large scenes by the methods that are marked so, and under a part of many lights. With the
// code shared with CUDA on the CPU everywhere, and on a device if there is one.
#include "tests/hybrid/parity_stage.h"

#include "hybrid/frame/lookup_pages_pass.h"

#include <algorithm>
#include <bit>

namespace shadowdag::test {
namespace {

class PassParity : public ParityStage {
    uint32_t lightStride() const override { return 4; }
};

/// Adds everything that gathering wrote.
void addGathered(Snapshot& snapshot, const FrameState& state) {
    const GBuffer& gbuffer = state.surface.buffers();
    const ClusterSet& clusters = state.clusters.clusters();
    const ClusterLights& lists = state.clusters.lights();
    const LightDemand& demand = state.clusters.demand();
    // Positions, normals and depths are floats that clusters, pairs and pages are decided by.
    snapshot.add("g-buffer triangle", gbuffer.triangle);
    snapshot.add("g-buffer depth", gbuffer.depthView);
    snapshot.add("g-buffer position", gbuffer.positionWorld);
    snapshot.add("g-buffer normal", gbuffer.normalWorld);
    snapshot.add("cluster cell", clusters.cell);
    snapshot.add("cluster sample start", clusters.sampleStart);
    snapshot.add("cluster samples", clusters.samples);
    snapshot.add("cluster of sample", clusters.clusterOfSample);
    snapshot.add("cluster normals", clusters.normalCell);
    snapshot.add("cluster boxes", clusters.boxesWorld);
    snapshot.add("cluster light start", lists.start);
    snapshot.add("cluster lights", lists.lights);
    snapshot.add("cluster light records", lists.record);
    snapshot.add("demand of lights", demand.resolutionSquaredBits);
    // Removed pairs are not requested, and nothing is written.
    std::vector<float> wanted = demand.wantedSquared.download();
    const std::vector<uint32_t> records = lists.record.download();
    for (size_t i = 0; i < wanted.size(); ++i)
        wanted[i] = records[i] == kProvenLit ? 0.0f : wanted[i];
    snapshot.add("demand of pairs", wanted);
    std::vector<uint32_t> ofMaps = state.clusters.demandOfMaps();
    ofMaps.resize(3 * demand.slotCount()); // without what only guesses note there
    snapshot.add("demand of maps", ofMaps);
}

/// Adds everything that shading wrote, and the pairs.
void addShaded(Snapshot& snapshot, FrameState& state, const FrameOptions& options) {
    ShadeSamples shading = state.prepareShading(options);
    shadeUnlit(state.context.backend, shading);
    shadeLights(state.context.backend, shading);
    snapshot.addNear("colour", state.shading.color().download(), kColorTolerance);
    snapshot.add("ray counts", state.shading.rayCount());
    snapshot.add("lookup counts", state.shading.lookupCount());
    snapshot.add("proven counts", state.shading.provenCount());
    snapshot.add("missing tap counts", state.shading.missingTapCount());
    snapshot.add("mover test counts", state.shading.moverTestCount());
    snapshot.add("exact ray counts", state.shading.exactCount());
    FrameResult result;
    result.maps = state.routing.describe(state.clusters, options);
    state.shading.recordPairs(state.surface, state.clusters, shading,
                              state.clusters.lights().record.download(), result);
    snapshot.add("pair start", result.pairs.sampleStart);
    snapshot.add("pair lights", result.pairs.light);
    snapshot.add("pair visibility", result.visibility);
    snapshot.add("pair maps", result.pairServer);
    state.clusters.orderedLists();
    snapshot.add("ordered cluster lights", state.clusters.ordered().lights);
    snapshot.add("ordered cluster light records", state.clusters.ordered().record);
}

/// Runs all passes over two frames between which the scene moves; every other map is traced.
Snapshot passesOf(Backend backend, World& world, const Dag& dag, const Camera& camera,
                  const FrameOptions& options, bool isOneText) {
    FrameState state(backend, world, dag);
    if (isOneText || backend == Backend::kCuda)
        state.guessLengths(true, 1); // with little to spare, so that some are too short
    Snapshot snapshot;
    StageTimes stages;
    for (const float time : {0.0f, 0.5f}) {
        snapshot.under("time " + std::to_string(time) + ": ");
        if (time > 0)
            state.context.scene.update(world.setTime(time), stages, stages, stages);
        state.gather(makeViewRays(camera, options.width, options.height), options, stages);
        addGathered(snapshot, state);
        std::vector<MapRecord> records = state.routing.describe(state.clusters, options);
        state.routing.count(state.surface, state.clusters, options, kCountsAll, records, stages);
        for (size_t r = 0; r < records.size(); ++r)
            records[r].route = r % 2 ? Route::kRays : Route::kMap;
        addRecords(snapshot, records);
        state.maps.build(state.surface, state.clusters, records, options, stages);
        addMaps(snapshot, state.maps.hostView());
        addCounts(snapshot, state.maps.maps().counts());
        snapshot.add("pages per map", state.maps.maps().pagesPerMap());
        snapshot.add("triangles per map", state.maps.maps().trianglesPerMap());
        addShaded(snapshot, state, options);
    }
    return snapshot;
}

TEST_P(PassParity, OfEveryPassOverTwoFramesIsBitForBit) {
    EXPECT_EQ(differenceOf([&](Backend backend, bool isOneText) {
                  return passesOf(backend, *world, dag, camera(), options(isOneText), isOneText);
              }),
              "");
}

INSTANTIATE_TEST_SUITE_P(Scenes, PassParity, testing::ValuesIn(parityCases()), caseName);

// The CPU marks pages in lanes, by cluster; here is the pass of devices, item by item.
TEST_P(PassParity, OfMarkingPagesIsThatOfEveryItem) {
    FrameState state(Backend::kCpu, *world, dag);
    const FrameOptions options = this->options(false);
    StageTimes stages;
    state.gather(makeViewRays(camera(), options.width, options.height), options, stages);
    std::vector<MapRequest> requests;
    for (const MapRecord& record : state.routing.describe(state.clusters, options))
        requests.push_back(requestOf(world->lights(), record));
    MapReceivers receivers(Backend::kCpu);
    listReceivers(Backend::kCpu, state.clusters.lists(), {}, receivers, true);
    // Three resolutions, one after the other.
    std::vector<ShadowMapInfo> maps;
    uint32_t words = 0;
    for (const double divisor : {1.0, 2.0, 8.0}) {
        const MapLayout layout = layOutMaps(requests, options.maps.pageTexels, divisor);
        for (ShadowMapInfo map : layout.maps) {
            map.pageTableStart += words * 32;
            maps.push_back(map);
        }
        words += uint32_t(layout.maskWordCount);
    }
    std::vector<uint32_t> expected(words), found(words);
    const auto workOf = [&](std::vector<uint32_t>& pages) {
        return MarkLookupPages{state.surface.view(),
                               state.clusters.view(),
                               std::as_const(receivers.list).view(),
                               state.context.scene.lights(),
                               {viewOf(maps),
                                uint32_t(requests.size()),
                                3,
                                {pages.data(), pages.size()},
                                uint32_t(std::countr_zero(options.maps.pageTexels)),
                                options.maps.taps}};
    };
    const MarkLookupPages byItem = workOf(expected);
    for (size_t item = 0; item < byItem.itemCount(); ++item)
        byItem(item);
    runPass(Backend::kCpu, workOf(found));
    EXPECT_EQ(found, expected);
    for (size_t m = 0; m < maps.size(); m += requests.size()) { // something at every resolution
        const auto first = found.begin() + maps[m].pageTableStart / 32;
        const auto last = m + requests.size() < maps.size()
                              ? found.begin() + maps[m + requests.size()].pageTableStart / 32
                              : found.end();
        EXPECT_TRUE(std::any_of(first, last, [](uint32_t word) { return word != 0; }));
    }
}

class PassParityOfOptions : public ParityStage {
    uint32_t lightStride() const override { return 8; } // four maps each
};

// What the defaults leave out: clusters by normals and explicit bounds, several maps a light,
// everything asked for by pixels on its plane, small pages that are kept, pages of boxes, and a
// full pool.
TEST_P(PassParityOfOptions, ThatAreNotDefaultsIsBitForBit) {
    EXPECT_EQ(differenceOf([&](Backend backend, bool isOneText) {
                  FrameOptions o = options(isOneText);
                  o.clusterBounds = ClusterBounds::kExplicit;
                  o.normalClusters = 3;
                  o.mapsPerLight = 4;
                  o.resolutionRule = ResolutionRule::kPlane;
                  o.maps.pageTexels = 32;
                  o.maps.retainsPages = true;
                  o.maps.poolBytes = 1ull << 20;
                  o.maps.taps = o.bias.taps = 9;
                  o.pageMarks = PageMarks::kBoxes;
                  return passesOf(backend, *world, dag, camera(), o, isOneText);
              }),
              "");
}

INSTANTIATE_TEST_SUITE_P(Scenes, PassParityOfOptions, testing::ValuesIn(parityCases()), caseName);

// PassParity compares the passes under more lights. Here are many frames.
class FrameParity : public ParityStage {
    uint32_t lightStride() const override { return 8; }
};

/// Adds a whole frame as callers see it.
void addFrame(Snapshot& snapshot, const FrameResult& frame) {
    snapshot.add("pair start", frame.pairs.sampleStart);
    snapshot.add("pair lights", frame.pairs.light);
    addRecords(snapshot, frame.maps);
    std::vector<uint32_t> routes;
    for (const Route route : frame.pairRoute)
        routes.push_back(uint32_t(route));
    snapshot.add("pair routes", routes);
    snapshot.add("pair maps", frame.pairServer);
    snapshot.add("visibility", frame.visibility);
    snapshot.addNear("colour", frame.color, kColorTolerance);
    const FrameCounts& counts = frame.counts;
    snapshot.add("counts",
                 std::vector<uint64_t>{
                     counts.sampleCount, counts.clusterCount, counts.clusterLightCount,
                     counts.prunedClusterLightCount, counts.pairCount, counts.rayCount,
                     counts.moverTestCount, counts.wholeLitPairCount, counts.wholeDarkPairCount,
                     counts.mixedPairCount, counts.lookupCount, counts.provenPairCount,
                     counts.tracedLightCount, counts.mappedLightCount, counts.tracedMapCount,
                     counts.drawnMapCount, counts.missingTapCount});
    addCounts(snapshot, frame.counts.maps);
}

struct Method {
    const char *name, *model;
    bool isOfLargeScenes; ///< also run in large scenes, which take minutes
    float believe = RayOptions{}.believe;
    LodRule lod = LodRule::kFixed;
    float polygonLod = 0.0f;
};
const Method kMethods[] = {
    {"dag", "texels:inf", false},
    {"dag by footprint", "texels:inf", false, RayOptions{}.believe, LodRule::kFootprint},
    {"dag by coverage", "texels:inf", false, RayOptions{}.believe, LodRule::kCoverage},
    {"dag, what is displaced by 4 pixels believed", "texels:inf", true, 4.0f},
    {"dag, no voxel believed", "texels:inf", true, 0.0f},
    {"maps", "texels:0", true},
    {"maps of simplified polygons", "texels:0", false, RayOptions{}.believe, LodRule::kFixed, 2.0f},
    {"hybrid", "texels:32", true},
    {"hybrid by all quantities",
     "expr:pairs + 3 * pages + triangles / 64 + 8 * movers < 900 + samples / 4", false}};
constexpr size_t kLargeTriangleCount = 500'000;

TEST_P(FrameParity, OfEveryMethodHasTheSameAnswers) {
    const auto framesOf = [&](Backend backend, bool isOneText) {
        FrameRenderer renderer(backend, *world, dag);
        if (isOneText)
            renderer.guessLengths(true);
        Snapshot snapshot;
        for (const float time : {0.0f, 0.5f}) {
            if (time > 0)
                renderer.worldChanged(world->setTime(time));
            for (const Method& method : kMethods) {
                if (!method.isOfLargeScenes && world->triangles().count() > kLargeTriangleCount)
                    continue;
                FrameOptions o = options(isOneText);
                o.width = 96;
                o.height = 54;
                o.rays.believe = method.believe;
                o.rays.lod = method.lod;
                o.maps.lodTexels = method.polygonLod;
                snapshot.under(std::string(method.name) + " at " + std::to_string(time) + ": ");
                addFrame(snapshot, renderer.render(camera(), *makeCostModel(method.model), o));
            }
        }
        return snapshot;
    };
    EXPECT_EQ(differenceOf(framesOf), "");
}

INSTANTIATE_TEST_SUITE_P(Scenes, FrameParity, testing::ValuesIn(parityCases()), caseName);

} // namespace
} // namespace shadowdag::test
