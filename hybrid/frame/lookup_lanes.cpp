// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/lookup_lanes.h"

#include "cuda/mutant.h"

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
        return true;
    default:
        return false;
    }
}

/// Returns whether the lanes' 32-bit signed indices reach all texels and pages of a map.
bool fitsLanes(const ShadowMapView& maps, const ShadowMapInfo& map) {
    constexpr size_t kMost = size_t(1) << 31;
    return !maps.depths.empty() && maps.depths.count <= kMost &&
           uint64_t(kFaceCount) * map.facePages * map.facePages <= kMost && !isFaultOfOneText();
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

uint32_t LookupLanes::lookUp(const ShadowMapView& maps, uint32_t map, const ShadowMapBias& bias,
                             const stream::SampleWork& samples, View<const uint8_t> isAsked,
                             View<uint8_t> seen) {
    stream::LookupWork work{};
    for (int a = 0; a < 3; ++a) {
        work.position[a] = samples.position[a];
        work.normal[a] = samples.normal[a];
    }
    work.count = samples.count;
    work.isAsked = isAsked.data;
    work.seen = seen.data;
    left_.resize(samples.count);
    work.left = left_.data();
    if (fitsLanes(maps, maps.maps[map])) {
        lookUpInLanes(maps, maps.maps[map], bias, work);
    } else {
        for (uint32_t i = 0; i < samples.count; ++i)
            if (isAsked[i])
                left_[work.leftCount++] = i;
    }
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

void LookupLanes::lookUpInLanes(const ShadowMapView& maps, const ShadowMapInfo& map,
                                const ShadowMapBias& bias, stream::LookupWork& work) {
    work.pageTable = maps.pageTable.data + map.pageTableStart;
    work.depths = maps.depths.data;
    work.pageTexelsLog2 = maps.pageTexelsLog2;
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
#if defined(SDAG_STREAM_X86)
    if (isa_ == StreamIsa::kAvx512)
        stream::lookUpAvx512(work);
    else if (isa_ == StreamIsa::kAvx2)
        stream::lookUpAvx2(work);
    else
#endif
        stream::lookUpPortable(work);
    work.window = nullptr;
    if (work.count >= 8 && work.isAsked[7] && isMutant(Mutant::kLookupLaneLost))
        work.seen[7] = 255;
}

} // namespace shadowdag
