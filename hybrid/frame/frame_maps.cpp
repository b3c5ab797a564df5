// SPDX-License-Identifier: Apache-2.0
// From what lights ask for to the maps that are drawn: records, quantities, requests.
#include "hybrid/frame/frame_state.h"

#include "cuda/parallel_for.h"
#include "hybrid/clusters/light_bvh.h"
#include "hybrid/rays/mover_rays.h"
#include "hybrid/routing/resolution_steps.h"
#include "shadowmap/cull.h"
#include "shadowmap/page_mask.h"

#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace shadowdag {

namespace {

// Counts the pages that the clusters of every record touch at its allocated resolution, by the
// shadow maps' own marks; what a full pool does to them is left out.
void countPagesOf(FrameState& state, const FrameOptions& options, std::vector<MapRecord>& records) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const uint32_t pageTexelsLog2 = uint32_t(std::countr_zero(options.maps.pageTexels));
    std::vector<MapRequest> requests;
    for (const MapRecord& record : records)
        requests.push_back(requestOf(lights, record));
    const MapLayout layout = layOutMaps(requests, options.maps.pageTexels);
    listReceivers(state.backend, state.lists.view(), {}, state.receivers, state.isGuessing);

    auto& [maps, counts, pages, projection, faces, depths, pairs] = state.routing;
    maps.upload(layout.maps);
    counts.resize(records.size());
    pages.resize(layout.maskWordCount);
    projection.resize(records.size() * kProjectionWordsPerMap);
    faces.resize(records.size());
    depths.resize(records.size() * kFaceCount);
    for (Buffer<uint32_t>* words : {&pages, &projection, &faces, &depths})
        words->fill(0);
    runPass(state.backend,
            MarkReceiver{
                maps.view(), state.clusters.boxesWorld.view(), state.receivers.list.view(),
                PageMaskView{pages.view(), projection.view(), faces.view(), depths.view(), {}, {}},
                pageTexelsLog2, options.maps.taps});
    runPass(state.backend, CountPagesOfMaps{maps.view(), pages.view(), counts.view()});
    const std::vector<uint32_t> found = counts.download();
    for (size_t m = 0; m < records.size(); ++m)
        records[m].quantities.pages = found[m];
}

// Counts what stands still in the spheres of lights that were not there in the frame before. Suns
// have none: their windows move with the camera.
void countStanding(FrameState& state, const std::vector<MapRecord>& maps) {
    const World& world = state.scene.world();
    const BatchView batches = state.scene.hostBatches();
    state.spheres.resize(world.lights().size());
    std::vector<uint32_t> lights;
    for (const MapRecord& map : maps)
        if (lights.empty() || lights.back() != map.quantities.light)
            lights.push_back(map.quantities.light);
    parallelFor<CpuTag>(
        lights.size(),
        [&](size_t i) {
            const Light& light = world.lights()[lights[i]];
            SphereCount& sphere = state.spheres[lights[i]];
            if (light.kind == Light::kSun || (sphere.rangeWorld == light.rangeWorld &&
                                              sphere.positionWorld == light.positionWorld))
                return;
            const bool hasMoved = sphere.hasMoved || sphere.rangeWorld >= 0.0f;
            sphere = {light.positionWorld, light.rangeWorld, 0, 0, hasMoved};
            const ShadowMapInfo info{light.positionWorld, light.rangeWorld, 0, 0, 0, {}};
            traverse(
                batches.bvh, [&](const Box& box) { return reachesMap(info, box); },
                [&](uint32_t index) {
                    const Batch& batch = batches.batches[index];
                    if (world.instances()[batch.instance].isMoving)
                        return;
                    ++sphere.batches;
                    sphere.triangles += batch.count;
                });
        },
        1);
}

void estimatePairsOf(FrameState& state, std::vector<MapRecord>& records) {
    Buffer<uint32_t>& pairs = state.routing.pairs;
    pairs.resize(records.size());
    pairs.fill(0);
    estimatePairs(state.backend, {state.gbuffer.view(), state.clusters.view(), state.lists.view(),
                                  state.scene.lights(), pairs.view()});
    const std::vector<uint32_t> counts = pairs.download();
    for (size_t r = 0; r < records.size(); ++r)
        records[r].quantities.pairs = counts[r];
}

// Counts what moves within the map's reach. By how much it hinders rays: a line through a convex
// body crosses S_i / S of the boxes in it on average (S_i: a box's surface, S: the body's;
// Crofton's formula; Santalo, Integral Geometry and Geometric Probability, 1976, III.14), a box
// that is larger than the body at most 1. A sun's rays are parallel: S_i / 4 over the window's
// area.
void countMovers(const MoverView& movers, View<const Box> batchBoxes, const ShadowMapInfo& info,
                 MapQuantities& map) {
    map.movers = 0;
    map.moverCrossings = 0;
    if (!movers.mayShadow(map.light))
        return;
    const double pi = glm::pi<double>(), range = info.rangeWorld;
    const double across = info.window.isSun()
                              ? 4.0 / (glm::length(info.window.u) * glm::length(info.window.v))
                              : pi * range * range;
    double crossings = 0;
    traverse(
        movers.bvh, [&](const Box& box) { return reachesMap(info, box); },
        [&](uint32_t batch) {
            const glm::dvec3 e = batchBoxes[batch].extent();
            const double surface = 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x);
            ++map.movers;
            crossings += std::min(surface / (4.0 * across), 1.0);
        });
    map.moverCrossings = float(crossings);
}

} // namespace

MapRequest requestOf(const std::vector<Light>& lights, const MapRecord& record) {
    const MapQuantities& map = record.quantities;
    const Light& light = lights[map.light];
    return {light.positionWorld,
            light.rangeWorld,
            map.light,
            map.faceTexels,
            map.octave,
            record.window,
            light.kind == Light::kSpot ? SpotCone{light.directionWorld, light.cosOuter}
                                       : SpotCone{}};
}

std::vector<MapRecord> describeMaps(const FrameState& state, const FrameOptions& options) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const size_t slotCount = state.demand.slotCount();
    const uint32_t *const bits = state.ofMaps.data(), *const samples = bits + slotCount,
                          *const clusters = samples + slotCount;
    const std::vector<uint32_t> steps = makeResolutionSteps(options.maxFaceTexels),
                                sunSteps = makeSunResolutionSteps();
    std::vector<MapRecord> records;
    uint32_t lightCount = 0;
    for (uint32_t slot = 0; slot < slotCount; ++slot) {
        if (clusters[slot] == 0)
            continue;
        const uint32_t light = slot / kMaxMapsPerLight;
        const double undersample = options.undersample;
        const double wantedSquared =
            double(std::bit_cast<float>(bits[slot])) / (undersample * undersample);
        const uint32_t held = slot < state.heldFaceTexels.size() ? state.heldFaceTexels[slot] : 0;
        if (records.empty() || records.back().quantities.light != light)
            ++lightCount;
        MapRecord record;
        record.quantities.light = light;
        record.quantities.octave = slot % kMaxMapsPerLight;
        record.quantities.texels = float(std::sqrt(wantedSquared));
        record.heldTexels = allocateResolution(lights[light].kind == Light::kSun ? sunSteps : steps,
                                               wantedSquared, options.minFaceTexels, held);
        record.quantities.faceTexels = record.heldTexels;
        record.quantities.samples = samples[slot];
        record.quantities.clusters = clusters[slot];
        record.quantities.range = lights[light].rangeWorld;
        if (slot < state.heldRoutes.size())
            record.quantities.previous = state.heldRoutes[slot];
        records.push_back(record);
    }
    for (MapRecord& record : records)
        record.quantities.lights = lightCount;
    fitSunWindows(state, options, records);
    return records;
}

void countQuantities(FrameState& state, const FrameOptions& options, uint32_t counts,
                     std::vector<MapRecord>& maps, StageTimes& times) {
    if (maps.empty())
        return;
    const std::vector<Light>& lights = state.scene.world().lights();
    const BatchView batches = state.scene.hostBatches();
    const MoverView movers = state.scene.hostMovers();
    const auto count = [&](Counts what, const auto& body) {
        if (!(counts & what))
            return;
        const StageTimer timer(state.backend, times, kCountNames[std::countr_zero(uint32_t(what))]);
        body();
    };
    const auto countEach = [&](const auto& countOne) {
        parallelFor<CpuTag>(
            maps.size(),
            [&](size_t m) {
                const MapQuantities& map = maps[m].quantities;
                const Light& light = lights[map.light];
                countOne(ShadowMapInfo{light.positionWorld, light.rangeWorld, map.faceTexels, 0, 0,
                                       maps[m].window},
                         maps[m].quantities);
            },
            1);
    };
    count(kCountsPages, [&] { countPagesOf(state, options, maps); });
    count(kCountsPairs, [&] { estimatePairsOf(state, maps); });
    count(kCountsTriangles, [&] {
        // Levels of detail follow what a map's texels are worth: nothing is known from before.
        const bool hasLevels = options.maps.lodTexels > 0.0f;
        const BatchView drawn = state.scene.mapGeometry(options.maps.lodTexels).batches;
        if (!hasLevels)
            countStanding(state, maps);
        countEach([&](const ShadowMapInfo& info, MapQuantities& map) {
            const bool isAll = hasLevels || info.window.isSun();
            map.batches = isAll ? 0 : state.spheres[map.light].batches;
            map.triangles = isAll ? 0 : state.spheres[map.light].triangles;
            traverse(
                isAll ? drawn.bvh : movers.bvh,
                [&](const Box& box) { return reachesMap(info, box); },
                [&](uint32_t index) {
                    const Batch& batch = drawn.batches[index];
                    if (levelOf(drawn.levels, batch.instance) !=
                        levelFor(drawn.levels, info, batch.instance))
                        return;
                    ++map.batches;
                    map.triangles += batch.count;
                });
        });
    });
    count(kCountsMovers, [&] {
        countEach([&](const ShadowMapInfo& info, MapQuantities& map) {
            countMovers(movers, batches.boxesWorld, info, map);
        });
    });
}

std::vector<MapQuantities> quantitiesOf(const std::vector<MapRecord>& maps) {
    std::vector<MapQuantities> quantities;
    quantities.reserve(maps.size());
    for (const MapRecord& map : maps)
        quantities.push_back(map.quantities);
    return quantities;
}

std::vector<PairServer> serversOf(const std::vector<MapRecord>& maps) {
    std::vector<PairServer> servers;
    uint32_t drawnCount = 0;
    for (const MapRecord& map : maps)
        servers.push_back(map.route == Route::kMap ? PairServer::drawnMap(drawnCount++)
                                                   : PairServer::rays());
    return servers;
}

void holdMaps(FrameState& state, const std::vector<MapRecord>& maps) {
    state.heldFaceTexels.assign(state.demand.slotCount(), 0);
    state.heldRoutes.assign(state.demand.slotCount(), PreviousRoute::kNone);
    for (const MapRecord& map : maps) {
        const size_t slot = map.quantities.light * kMaxMapsPerLight + map.quantities.octave;
        state.heldFaceTexels[slot] = map.heldTexels;
        state.heldRoutes[slot] =
            map.route == Route::kRays ? PreviousRoute::kRays : PreviousRoute::kMap;
    }
}

void buildMaps(FrameState& state, const std::vector<MapRecord>& records,
               const FrameOptions& options, StageTimes& stages) {
    const World& world = state.scene.world();
    const std::vector<Light>& lights = world.lights();
    std::vector<MapRequest> requests;
    {
        const StageTimer timer(state.backend, stages, "routing");
        state.servers = serversOf(records);
        for (size_t r = 0; r < records.size(); ++r) {
            if (records[r].route == Route::kMap) {
                requests.push_back(requestOf(lights, records[r]));
            } else if (!state.scene.hasDag()) {
                throw Error(ErrorKind::kUsage,
                            "light " + std::to_string(records[r].quantities.light) +
                                " is routed to rays, but there is no voxel DAG; voxelize the "
                                "scene, or route every light to maps with texels:0");
            }
        }
        state.serversOnBackend.set(state.servers);
        if (requests.empty())
            state.receivers.list.resize(0);
        else
            listReceivers(state.backend, state.lists.view(), {state.serversOnBackend.view()},
                          state.receivers, state.isGuessing);
    }
    const MapGeometry onBackend = state.scene.mapGeometryOnBackend(options.maps.lodTexels);
    const std::vector<uint32_t> moved = state.movedBatches.take(options.maps.lodTexels);
    state.maps.build(requests,
                     {std::as_const(state.clusters.boxesWorld).view(),
                      std::as_const(state.receivers.list).view(), onBackend.triangles,
                      onBackend.batches},
                     state.scene.mapGeometry(options.maps.lodTexels).batches, options.maps, stages,
                     viewOf(moved));
}

} // namespace shadowdag
