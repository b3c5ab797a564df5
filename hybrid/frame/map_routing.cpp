// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/map_routing.h"

#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "hybrid/clusters/pairs_pass.h"
#include "hybrid/frame/directional_maps.h"
#include "hybrid/frame/page_marker.h"
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

// Counts moving boxes within the map's range, and estimates how many of them a ray crosses: a line
// through a convex body crosses S_i / S of the boxes in it on average (S_i: a box's surface, S: the
// body's; Crofton's formula; Santalo, Integral Geometry and Geometric Probability, 1976, III.14), a
// box that is larger than the body at most 1. A directional light's rays are parallel: S_i / 4 over
// the window's area.
void countMovers(const MoverView& movers, View<const Box> batchBoxes, const ShadowMapInfo& info,
                 MapQuantities& map) {
    map.movers = 0;
    map.moverCrossings = 0;
    if (!movers.mayShadow(map.light))
        return;
    const double pi = glm::pi<double>(), range = info.rangeWorld;
    const double across = info.window.isDirectional()
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

// Counts the pages that the lookups of every record would read at its allocated resolution, by the
// marks of the shadow maps; a full pool is ignored.
void MapRouting::countPages(const VisibleSurface& surface, const FrameClusters& clusters,
                            const FrameOptions& options, std::vector<MapRecord>& records) {
    const std::vector<Light>& lights = context_.scene.world().lights();
    const uint32_t pageTexelsLog2 = uint32_t(std::countr_zero(options.maps.pageTexels));
    std::vector<MapRequest> requests;
    for (const MapRecord& record : records)
        requests.push_back(requestOf(lights, record));
    const MapLayout layout = layOutMaps(requests, options.maps.pageTexels);
    listReceivers(context_.backend, clusters.lists(), {}, receivers_, clusters.isGuessing());

    auto& [maps, counts, pages, pairs] = counting_;
    maps.upload(layout.maps);
    counts.resize(records.size());
    pages.resize(layout.maskWordCount);
    pages.fill(0);
    pageMarkerOf(context_, surface, clusters, receivers_.list.view(), options.pageMarks)
        ->mark({maps.view(), uint32_t(records.size()), 1, pages.view(), pageTexelsLog2,
                options.maps.taps});
    runPass(context_.backend, CountPagesOfMaps{maps.view(), pages.view(), counts.view()});
    const std::vector<uint32_t> found = counts.download();
    for (size_t m = 0; m < records.size(); ++m)
        records[m].quantities.pages = found[m];
}

// Counts the static batches in the spheres of lights that were not there in the frame before.
// Directional lights have none: their windows move with the camera.
void MapRouting::countStanding(const std::vector<MapRecord>& maps) {
    const World& world = context_.scene.world();
    const BatchView batches = context_.scene.hostBatches();
    spheres_.resize(world.lights().size());
    std::vector<uint32_t> lights;
    for (const MapRecord& map : maps)
        if (lights.empty() || lights.back() != map.quantities.light)
            lights.push_back(map.quantities.light);
    parallelFor<CpuTag>(
        lights.size(),
        [&](size_t i) {
            const Light& light = world.lights()[lights[i]];
            SphereCount& sphere = spheres_[lights[i]];
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

void MapRouting::estimatePairs(const VisibleSurface& surface, const FrameClusters& clusters,
                               std::vector<MapRecord>& records) {
    Buffer<uint32_t>& pairs = counting_.pairs;
    pairs.resize(records.size());
    pairs.fill(0);
    shadowdag::estimatePairs(context_.backend, {surface.view(), clusters.view(), clusters.lists(),
                                                context_.scene.lights(), pairs.view()});
    const std::vector<uint32_t> counts = pairs.download();
    for (size_t r = 0; r < records.size(); ++r)
        records[r].quantities.pairs = counts[r];
}

MapRequest requestOf(const std::vector<Light>& lights, const MapRecord& record) {
    const MapQuantities& map = record.quantities;
    const Light& light = lights[map.light];
    return {light.positionWorld,
            light.rangeWorld,
            map.light,
            mutated(Mutant::kMapFaceHalved, map.faceTexels, (map.faceTexels + 1) / 2),
            map.octave,
            record.window,
            light.kind == Light::kSpot ? SpotCone{light.directionWorld, light.cosOuter}
                                       : SpotCone{}};
}

std::vector<MapRecord> MapRouting::describe(const FrameClusters& clusters,
                                            const FrameOptions& options) const {
    const std::vector<Light>& lights = context_.scene.world().lights();
    const size_t slotCount = clusters.demand().slotCount();
    const uint32_t *const bits = clusters.demandOfMaps().data(), *const samples = bits + slotCount,
                          *const clusterCounts = samples + slotCount;
    const std::vector<uint32_t> steps = makeResolutionSteps(options.maxFaceTexels),
                                directionalSteps = makeDirectionalResolutionSteps();
    std::vector<MapRecord> records;
    uint32_t lightCount = 0;
    for (uint32_t slot = 0; slot < slotCount; ++slot) {
        if (clusterCounts[slot] == 0)
            continue;
        const uint32_t light = slot / kMaxMapsPerLight;
        const double undersample = options.undersample;
        const double wantedSquared =
            double(std::bit_cast<float>(bits[slot])) / (undersample * undersample);
        const uint32_t held = slot < heldFaceTexels_.size() ? heldFaceTexels_[slot] : 0;
        if (records.empty() || records.back().quantities.light != light)
            ++lightCount;
        MapRecord record;
        record.quantities.light = light;
        record.quantities.octave = slot % kMaxMapsPerLight;
        record.quantities.texels = float(std::sqrt(wantedSquared));
        record.heldTexels =
            allocateResolution(lights[light].kind == Light::kSun ? directionalSteps : steps,
                               wantedSquared, options.minFaceTexels, held);
        record.quantities.faceTexels = record.heldTexels;
        record.quantities.samples = samples[slot];
        record.quantities.clusters = clusterCounts[slot];
        record.quantities.range = lights[light].rangeWorld;
        if (slot < heldRoutes_.size())
            record.quantities.previous = heldRoutes_[slot];
        records.push_back(record);
    }
    for (MapRecord& record : records)
        record.quantities.lights = lightCount;
    fitDirectionalWindows(clusters, lights, options, records);
    return records;
}

void MapRouting::count(const VisibleSurface& surface, const FrameClusters& clusters,
                       const FrameOptions& options, uint32_t counts, std::vector<MapRecord>& maps,
                       StageTimes& times) {
    if (maps.empty())
        return;
    const std::vector<Light>& lights = context_.scene.world().lights();
    const BatchView batches = context_.scene.hostBatches();
    const auto measure = [&](Counts what, const auto& body) {
        if (!(counts & what))
            return;
        const StageTimer timer(context_.backend, times,
                               kCountNames[std::countr_zero(uint32_t(what))]);
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
    measure(kCountsPages, [&] { countPages(surface, clusters, options, maps); });
    measure(kCountsPairs, [&] { estimatePairs(surface, clusters, maps); });
    measure(kCountsTriangles, [&] {
        const MoverView movers = context_.scene.hostMovers();
        // Levels of detail follow the size of a map's texels, so earlier counts do not apply.
        const bool hasLevels = options.maps.lodTexels > 0.0f;
        const BatchView drawn = context_.scene.mapGeometry(options.maps.lodTexels).batches;
        if (!hasLevels)
            countStanding(maps);
        countEach([&](const ShadowMapInfo& info, MapQuantities& map) {
            const bool isAll = hasLevels || info.window.isDirectional();
            map.batches = isAll ? 0 : spheres_[map.light].batches;
            map.triangles = isAll ? 0 : spheres_[map.light].triangles;
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
    measure(kCountsMovers, [&] {
        const MoverView movers = context_.scene.hostMovers();
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

void MapRouting::hold(const FrameClusters& clusters, const std::vector<MapRecord>& maps) {
    heldFaceTexels_.assign(clusters.demand().slotCount(), 0);
    heldRoutes_.assign(clusters.demand().slotCount(), PreviousRoute::kNone);
    for (const MapRecord& map : maps) {
        const size_t slot = map.quantities.light * kMaxMapsPerLight + map.quantities.octave;
        heldFaceTexels_[slot] = map.heldTexels;
        heldRoutes_[slot] = map.route == Route::kRays ? PreviousRoute::kRays : PreviousRoute::kMap;
    }
}

void MapRouting::forget() {
    heldFaceTexels_.clear();
    heldRoutes_.clear();
    for (SphereCount& sphere : spheres_)
        if (sphere.hasMoved)
            sphere.rangeWorld = -1; // the cost of a light that moves is incurred every frame
}

} // namespace shadowdag
