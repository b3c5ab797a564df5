// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/lookup_lanes.h"

#include "cuda/mutant.h"
#include "voxel/stream_kernel.h"

#include <cmath>

namespace shadowdag {

namespace {

/// Returns whether the fault of this process is one of the one text's, which lanes do not share.
bool isFaultOfOneText() {
    switch (chosenMutant()) {
    case Mutant::kMapTexelShifted:
    case Mutant::kMapCentreShifted:
    case Mutant::kMapFaceMirrored:
    case Mutant::kMapPlaneDropped:
    case Mutant::kMapWeightsSwapped:
    case Mutant::kMapSeamClamped:
    case Mutant::kMapPageDropped:
    case Mutant::kMapMarginZero:
        return true;
    default:
        return false;
    }
}

/// What the lanes' 32-bit signed indices reach.
constexpr size_t kMostIndices = size_t(1) << 31;

/// Returns whether lanes reach all pages of a map and do what the one text does.
bool fitsLanes(const ShadowMapInfo& map) {
    return uint64_t(kFaceCount) * map.facePages * map.facePages <= kMostIndices &&
           !isFaultOfOneText();
}

/// Returns what makeDirectionalReceiver (shadowmap/directional_filter.h) derives of a window for
/// every receiver.
stream::WindowLookup windowLookupOf(const ShadowMapInfo& map, const ShadowMapBias& bias) {
    const DirectionalWindow& w = map.window;
    stream::WindowLookup r{};
    const glm::dvec3 rows[] = {w.u, w.v, w.w};
    const double offsets[] = {w.u0, w.v0, w.w0};
    for (int row = 0; row < 3; ++row) {
        for (int a = 0; a < 3; ++a)
            r.row[row][a] = rows[row][a];
        r.offset[row] = offsets[row];
        r.light[row] = std::fabs(map.lightPositionWorld[row]);
    }
    r.face = kDirectionalFace;
    r.halfSide = 0.5f * double(map.faceTexels);
    r.perWorld = squareRoot(dotInOrder(w.w, w.w));
    r.perWindow = squareRoot(dotInOrder(w.u, w.u));
    const double texel = 1.0f / (r.perWindow * r.halfSide);
    r.steepest = -texel * r.perWorld;
    r.wayRounding = double(kWayRounding);
    r.range = double(map.rangeWorld);
    r.depthRounding = kDepthRounding;
    const auto texelDepth = float(texel * r.perWorld);
    r.forgiven = bias.constantTexels * texelDepth;
    r.low = filterSide(bias.taps) > 1 ? kLowTapTexels * texelDepth : kNoLowTap;
    r.leastFacing = kLeastFacing;
    r.lodDepth = map.lodTexels > 0.0f ? map.lodTexels * texelDepth : 0.0f;
    r.leastFacingOfLevels = kLeastFacingOfLevels;
    return r;
}

glm::vec3 vectorOf(const float* const (&arrays)[3], uint32_t i) {
    return {arrays[0][i], arrays[1][i], arrays[2][i]};
}

} // namespace

LookupLanes::LookupLanes(StreamIsa isa) : isa_(isa) {
    SDAG_ASSERT(hasStreamIsa(isa));
}

stream::LookupWork LookupLanes::workOf(const stream::SampleWork& samples,
                                       View<const uint8_t> isAsked) {
    stream::LookupWork work{};
    for (int a = 0; a < 3; ++a) {
        work.position[a] = samples.position[a];
        work.normal[a] = samples.normal[a];
    }
    work.count = samples.count;
    work.isAsked = isAsked.data;
    left_.resize(samples.count);
    work.left = left_.data();
    return work;
}

uint32_t LookupLanes::lookUp(const ShadowMapView& maps, uint32_t map, const ShadowMapBias& bias,
                             const stream::SampleWork& samples, View<const uint8_t> isAsked,
                             View<uint8_t> seen) {
    const ShadowMapInfo& info = maps.maps[map];
    stream::LookupWork work = workOf(samples, isAsked);
    work.seen = seen.data;
    work.pageTable = maps.pageTable.data + info.pageTableStart;
    work.depths = maps.depths.data;
    const bool doDepthsFit = !maps.depths.empty() && maps.depths.count <= kMostIndices;
    run(SDAG_KERNEL_OF(isa_, stream::lookUp), info, doDepthsFit && fitsLanes(info),
        maps.pageTexelsLog2, bias, work);
    if (work.count >= 8 && work.isAsked[7] && isMutant(Mutant::kLookupLaneLost))
        work.seen[7] = 255;
    uint32_t missingCount = work.missingCount;
    for (uint32_t k = 0; k < work.leftCount; ++k) {
        const uint32_t i = left_[k];
        ShadowMapTrace trace;
        seen[i] = lookupVisibility(maps, map, vectorOf(work.position, i), vectorOf(work.normal, i),
                                   bias, &trace);
        missingCount += trace.missingTapCount;
    }
    return missingCount;
}

void LookupLanes::markPages(const PageDemand& demand, uint32_t map,
                            const stream::SampleWork& samples, View<const uint8_t> isAsked) {
    const ShadowMapInfo& info = demand.maps[map];
    stream::LookupWork work = workOf(samples, isAsked);
    work.pages = demand.pages.data + info.pageTableStart / 32;
    run(SDAG_KERNEL_OF(isa_, stream::markPages), info, fitsLanes(info), demand.pageTexelsLog2,
        {0.0f, demand.taps}, work);
    for (uint32_t k = 0; k < work.leftCount; ++k) {
        const uint32_t i = left_[k];
        markLookup(demand, map, vectorOf(work.position, i), vectorOf(work.normal, i));
    }
}

void LookupLanes::run(void (*kernel)(stream::LookupWork&), const ShadowMapInfo& map,
                      bool doLanesFit, uint32_t pageTexelsLog2, const ShadowMapBias& bias,
                      stream::LookupWork& work) {
    if (!doLanesFit) {
        for (uint32_t i = 0; i < work.count; ++i)
            if (work.isAsked[i])
                work.left[work.leftCount++] = i;
        return;
    }
    work.pageTexelsLog2 = pageTexelsLog2;
    for (int a = 0; a < 3; ++a)
        work.light[a] = map.lightPositionWorld[a];
    work.faceTexels = map.faceTexels;
    work.facePages = map.facePages;
    // As makeCubeReceiver and endsFilter (shadowmap/filter_leaf.h) derive them.
    const float n = float(map.faceTexels);
    work.side = filterSide(bias.taps);
    work.rTexels = quotient(1.0f, n);
    work.forgiven = quotient(1.0f, 1.0f - lesser(quotient(2.0f * bias.constantTexels, n), 0.5f));
    work.low = work.side > 1 ? greater(1.0f - 2.0f * kLowTapTexels * work.rTexels, 0.0f) : 0.0f;
    work.twoLod = map.lodTexels > 0.0f ? 2.0f * map.lodTexels : 0.0f;
    work.placeRounding = kPlaceRounding;
    work.wayRounding = kWayRounding;
    work.total = filterTotal(int(work.side));
    work.largestOut = 0.99f * work.total;
    stream::WindowLookup window;
    if (map.window.isDirectional()) {
        window = windowLookupOf(map, bias);
        work.window = &window;
    }
    kernel(work);
    work.window = nullptr;
}

} // namespace shadowdag
