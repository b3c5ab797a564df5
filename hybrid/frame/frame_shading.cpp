// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/frame_shading.h"

#include "cuda/fill_pass.h"
#include "cuda/mutant.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace shadowdag {

namespace {

uint64_t sum(const Buffer<uint32_t>& counts) {
    const std::vector<uint32_t> host = counts.download();
    return std::accumulate(host.begin(), host.end(), uint64_t(0));
}

/// Clusters and their lists of lights on the host.
struct ShadeLists {
    ShadeLists(const FrameClusters& clusters, size_t worldLightCount)
        : sampleStart(clusters.clusters().sampleStart.download()),
          samples(clusters.clusters().samples.download()),
          lightStart(clusters.lights().start.download()),
          lights(clusters.lights().lights.download()), lightCount(worldLightCount) {}

    std::vector<uint32_t> sampleStart, samples, lightStart, lights;
    size_t lightCount; ///< of the world
};

/// Counts the traced pairs by whether their light lights its cluster completely, not at all, or
/// partly.
void countWholeClusters(const ShadeLists& lists, FrameResult& result) {
    const auto& [sampleStart, samples, lightStart, lights, lightCount] = lists;
    std::vector<uint64_t> lit(lightCount, 0), dark = lit;
    FrameCounts& counts = result.counts;
    for (size_t c = 0; c + 1 < sampleStart.size(); ++c) {
        for (uint32_t i = sampleStart[c]; i < sampleStart[c + 1]; ++i)
            for (uint64_t p = result.pairs.sampleStart[samples[i]];
                 p < result.pairs.sampleStart[samples[i] + 1]; ++p)
                if (result.pairRoute[p] == Route::kRays)
                    ++(result.visibility[p] < kHalfLit ? dark : lit)[result.pairs.light[p]];
        for (uint32_t l = lightStart[c]; l < lightStart[c + 1]; ++l) {
            uint64_t &ofLit = lit[lights[l]], &ofDark = dark[lights[l]];
            (ofDark == 0  ? counts.wholeLitPairCount
             : ofLit == 0 ? counts.wholeDarkPairCount
                          : counts.mixedPairCount) += ofLit + ofDark;
            ofLit = ofDark = 0;
        }
    }
}

/// Counts the pairs of every map; those proven lit belong to none.
void countPairsOfMaps(const ShadeLists& lists, const std::vector<uint32_t>& records,
                      FrameResult& result) {
    const auto& [sampleStart, samples, lightStart, lights, lightCount] = lists;
    std::vector<uint32_t> recordOfLight(lightCount, kProvenLit);
    for (size_t c = 0; c + 1 < sampleStart.size(); ++c) {
        for (uint32_t l = lightStart[c]; l < lightStart[c + 1]; ++l)
            recordOfLight[lights[l]] = records[l];
        for (uint32_t i = sampleStart[c]; i < sampleStart[c + 1]; ++i)
            for (uint64_t p = result.pairs.sampleStart[samples[i]];
                 p < result.pairs.sampleStart[samples[i] + 1]; ++p) {
                const uint32_t by = recordOfLight[result.pairs.light[p]];
                if (by != kProvenLit)
                    ++result.maps[by].pairCount;
            }
    }
}

/// A frame makes one beam for so many of its rays at most: to make one takes as long as some 40.
constexpr uint64_t kRaysPerBeam = 240;
/// The same where it is not known yet how many rays there are: for so many samples.
constexpr uint64_t kSamplesPerBeam = 64;

} // namespace

PairNeeds needsOf(bool servesRays, bool servesMaps, const std::vector<Light>& lights,
                  const RayInputs& rays, uint32_t taps) {
    PairNeeds needs;
    needs.taps = taps;
    needs.rays = servesRays;
    needs.maps = servesMaps;
    needs.directional = std::any_of(lights.begin(), lights.end(),
                                    [](const Light& light) { return light.kind == Light::kSun; });
    const RayOptions& options = rays.options;
    needs.ofRays.voxels = servesRays && !options.believesNone();
    needs.ofRays.levels =
        needs.ofRays.voxels && (options.level != 0 || options.lod != LodRule::kFixed);
    needs.ofRays.triangles = servesRays && !options.believesAll();
    needs.ofRays.movers = servesRays && !rays.movers.isNearLight.empty();
    return needs;
}

ShadeSamples FrameShading::prepare(const VisibleSurface& surface, const FrameClusters& clusters,
                                   const DrawnMaps& maps, const FrameOptions& options) {
    color_.resize(surface.view().count());
    for (Buffer<uint32_t>* counts : {&rayCount_, &lookupCount_, &provenCount_, &missingTapCount_,
                                     &moverTestCount_, &exactCount_})
        counts->resize(clusters.clusters().cell.size());
    fillAll(context_.backend, {rayCount_, lookupCount_, provenCount_, missingTapCount_,
                               moverTestCount_, exactCount_});
    FrameScene& scene = context_.scene;
    const float offset = options.rays.offset, bias = options.bias.constantTexels;
    RayOptions rays = options.rays;
    rays.offset = mutated(Mutant::kRayOffsetZero, offset, 0.0f);
    rays.offset = mutated(Mutant::kRayOffsetDoubled, rays.offset, 2.0f * offset);
    ShadowMapBias filter = options.bias;
    filter.constantTexels = mutated(Mutant::kMapBiasZero, bias, 0.0f);
    filter.constantTexels = mutated(Mutant::kMapBiasTenfold, filter.constantTexels, 10.0f * bias);
    filter.taps = mutated(Mutant::kMapTapsDoubled, filter.taps, 9u);
    const bool servesRays = maps.serves(ServedBy::kRays);
    const RayInputs inputs = scene.rayInputs(rays, clusters.rayDetail(), servesRays);
    return {surface.view(),
            scene.triangleMaterial(),
            scene.materials(),
            clusters.view(),
            clusters.lists(),
            scene.lights(),
            maps.servers(),
            VisibilityInputs{inputs, maps.view(), filter},
            color_.view(),
            rayCount_.view(),
            lookupCount_.view(),
            provenCount_.view(),
            missingTapCount_.view(),
            moverTestCount_.view(),
            exactCount_.view(),
            {},
            needsOf(servesRays, maps.serves(ServedBy::kMap), scene.world().lights(), inputs,
                    filter.taps)};
}

void FrameShading::beginBeams(const ViewRays& view, const FrameOptions& options,
                              ShadeSamples& shading) {
    RayInputs& rays = shading.visibility.rays;
    rays.beams = nullptr;
    haveBeams_ = false;
    if (!rays.options.keepsBeams() || context_.backend != Backend::kCpu)
        return forget();
    const bool isStill = lastView_ && *lastView_ == view;
    lastView_ = view;
    const BeamCounts last = beams_.counts(); // of the last frame that asked
    const bool areMostKnown = 2 * last.pairCount > last.askedCount;
    if (!shading.needs.rays || !(options.makeAllBeams || isStill || areMostKnown))
        return beams_.skip();
    const uint64_t share = last.askedCount > 0 ? last.askedCount / kRaysPerBeam
                                               : shading.gbuffer.count() / kSamplesPerBeam;
    beams_.begin(rays.exact.bvh, rays.exact.geometry, context_.scene.lights(),
                 rays.options.beamBytes,
                 options.makeAllBeams ? BeamCache::kMakeAll : isStill * share);
    rays.beams = &beams_;
    haveBeams_ = true;
}

void FrameShading::forget() {
    beams_.forget();
    lastView_.reset();
}

void FrameShading::shade(const ShadeSamples& shading) {
    context_.device.shade(shading, std::as_const(pairs_.light).view());
}

PairList FrameShading::findPairs(const VisibleSurface& surface, const FrameClusters& clusters) {
    listPairs(context_.backend, surface.view(), clusters.view(), clusters.lists(),
              context_.scene.lights(), pairs_);
    PairList pairs;
    const std::vector<uint32_t> start = pairs_.start.download();
    pairs.sampleStart.assign(start.begin(), start.end());
    pairs.light = pairs_.light.download();
    return pairs;
}

void FrameShading::requireAllAnswered(const PairList& pairs) const {
    const std::vector<uint32_t> next = nextPair_.download();
    for (size_t s = 0; s + 1 < pairs.sampleStart.size(); ++s)
        if (next[s] != pairs.sampleStart[s + 1])
            throw std::logic_error("sample " + std::to_string(s) + " has " +
                                   std::to_string(pairs.sampleStart[s + 1] - pairs.sampleStart[s]) +
                                   " pairs and shading answered " +
                                   std::to_string(next[s] - pairs.sampleStart[s]));
}

void FrameShading::recordPairs(const VisibleSurface& surface, const FrameClusters& clusters,
                               const ShadeSamples& shading, const std::vector<uint32_t>& records,
                               FrameResult& result) {
    result.pairs = findPairs(surface, clusters);
    nextPair_.upload(pairs_.start.download());
    pairVisibility_.resize(result.pairs.count());
    pairServer_.resize(result.pairs.count());
    if (haveBeams_)
        beams_.freeze();
    ShadeSamples recording = shading;
    recording.recorder = {nextPair_.view(), pairVisibility_.view(), pairServer_.view()};
    shade(recording);
    requireAllAnswered(result.pairs);
    result.visibility = pairVisibility_.download();
    result.pairServer = pairServer_.download();
    result.pairRoute.clear();
    result.pairRoute.reserve(result.pairServer.size());
    for (const PairServer& server : result.pairServer)
        result.pairRoute.push_back(server.isMap() ? Route::kMap : Route::kRays);
    const ShadeLists lists(clusters, context_.scene.world().lights().size());
    countPairsOfMaps(lists, records, result);
    countWholeClusters(lists, result);
}

void FrameShading::count(FrameCounts& counts) const {
    counts.rayCount = sum(rayCount_);
    counts.lookupCount = sum(lookupCount_);
    counts.provenPairCount = sum(provenCount_);
    counts.pairCount = counts.rayCount + counts.lookupCount + counts.provenPairCount;
    counts.missingTapCount = sum(missingTapCount_);
    counts.moverTestCount = sum(moverTestCount_);
    counts.exactRayCount = sum(exactCount_);
    const BeamCounts beams = haveBeams_ ? beams_.counts() : BeamCounts{};
    counts.beamRayCount = beams.pairCount;
    counts.beamMadeCount = beams.madeCount;
}

} // namespace shadowdag
