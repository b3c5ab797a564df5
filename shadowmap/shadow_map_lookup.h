// SPDX-License-Identifier: Apache-2.0
// Reads a virtual cube shadow map: from a receiver to a face, page and texel, and the filtered
// visibility.
#pragma once

#include "cuda/mutant.h"
#include "cuda/view.h"
#include "shadowmap/directional_filter.h"
#include "shadowmap/filter_taps.h"
#include "shadowmap/shadow_map_info.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <cstring>

namespace shadowdag {

/// The input of a lookup.
/// maps: mapCount; pageTable: pool page or kNoPage; depths: pageCount * pageTexels^2.
/// A depth is the float bits of 1/z, z being the depth along the face's axis (world units) of the
/// nearest surface on the ray through the texel's centre; 0 without a surface. Nearer is greater,
/// as float and as uint32. For a directional light it is the w of directional_window.h.
struct ShadowMapView {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> pageTable;
    View<const uint32_t> depths;
    uint32_t pageTexelsLog2 = 6;
};

/// What a lookup returns besides the visibility.
struct ShadowMapTrace {
    glm::vec3 blockerWorld{0.0f}; ///< a point of the nearest blocking texel; meaningless when lit
    float texelWorld = 0.0f;      ///< side of a texel at the blocker, world
    uint32_t missingTapCount = 0; ///< taps on pages without memory (counted dark)
};

/// Returns the stored depth bits of a texel, or kNoPage where its page has no memory.
SDAG_HD inline uint32_t depthAt(const ShadowMapView& view, const ShadowMapInfo& map,
                                const CubeTexel& texel) {
    const uint32_t log2 = view.pageTexelsLog2;
    const uint32_t page =
        view.pageTable[pageTableIndex(map, texel.face, texel.x >> log2, texel.y >> log2)];
    if (page == kNoPage)
        return kNoPage;
    return view.depths[(size_t(page) << (2 * log2)) + texelInPage(texel.x, texel.y, log2)];
}

/// The filter of lookupVisibility over any source of taps: the map, or, for the analysis of the
/// error, the truth.
/// @param map,positionWorld,normalWorld,bias as lookupVisibility has them
/// @param taps taps.begin(face, x, y, side) announces the side x side texels from column x and row
/// y of a face, which may reach beyond it; then taps.ask(texel, u, v, limit, isCounted) is called
/// once per texel, in order, and returns whether anything blocks the ray through its centre (u, v,
/// 1) of face texel.face at a 1/z above `limit`. isCounted: false for a tap that is omitted.
/// @tparam kDirectional false: no map is a directional light's, and the code for those is left out
/// @tparam kTaps bias.taps, for code without loops over others; 0: as bias has it
template <bool kDirectional = true, uint32_t kTaps = 0, class Taps>
SDAG_HD inline uint8_t filterVisibility(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                                        const glm::vec3& normalWorld, const ShadowMapBias& bias,
                                        Taps& taps) {
    if (kDirectional && map.window.isDirectional())
        return filterDirectionalVisibility(map, positionWorld, normalWorld, bias, taps);
    const glm::vec3 d = positionWorld - map.lightPositionWorld;
    const float dd = glm::dot(d, d);
    if (dd == 0.0f)
        return 255;
    if (!(dd > 0.0f))
        return 0;
    CubeReceiver r = makeCubeReceiver(
        d, dd, positionWorld, mutated(Mutant::kMapPlaneDropped, normalWorld, glm::vec3(0.0f)),
        map.faceTexels, map.lodTexels, bias.constantTexels, kTaps != 0 ? kTaps : bias.taps);
    if (kTaps != 0)
        r.side = int32_t(filterSide(kTaps));
    if (r.face == 3 && isMutant(Mutant::kMapFaceMirrored))
        r.x0 = int32_t(map.faceTexels) - r.side - r.x0;
    r.fx = mutated(Mutant::kMapWeightsSwapped, r.fx, 1.0f - r.fx);
    // Both planes in the frame of the tap's face.
    glm::vec3 own = faceFromLight(r.face, r.own), across = faceFromLight(r.face, r.across);
    float low = r.low;
    for (;;) {
        taps.begin(r.face, r.x0, r.y0, r.side);
        float lit = 0.0f, leftOut = 0.0f;
        for (int32_t j = 0; j < r.side; ++j) {
            const float wy = tapWeight(r.side, j, r.fy);
            for (int32_t i = 0; i < r.side; ++i) {
                const float w = tapWeight(r.side, i, r.fx) * wy;
                CubeTexel texel{r.face, uint32_t(r.x0 + i), uint32_t(r.y0 + j)};
                if (!r.isInFace && isMutant(Mutant::kMapSeamClamped)) {
                    const int32_t last = int32_t(map.faceTexels) - 1;
                    texel.x = uint32_t(glm::clamp(r.x0 + i, 0, last));
                    texel.y = uint32_t(glm::clamp(r.y0 + j, 0, last));
                } else if (!r.isInFace) {
                    texel = wrapTexel(r.face, r.x0 + i, r.y0 + j, map.faceTexels);
                    own = faceFromLight(texel.face, r.own);
                    across = faceFromLight(texel.face, r.across);
                }
                float u = tapCentre(r, texel.x, map.faceTexels);
                u = mutated(Mutant::kMapCentreShifted, u, u + r.rTexels);
                const float v = tapCentre(r, texel.y, map.faceTexels);
                bool isLow;
                const float limit = cubeTapLimit(own, across, u, v, low, isLow);
                const TapResult answer = taps.ask(texel, u, v, limit, !isLow);
                if (isLow && answer != TapResult::kMissing)
                    leftOut += w;
                else if (answer == TapResult::kLit)
                    lit += w;
            }
        }
        uint32_t visibility;
        if (endsFilter(lit, leftOut, filterTotal(r.side), visibility))
            return uint8_t(visibility);
        low = 0.0f;
    }
}

/// Taps of a drawn map.
struct MapTaps {
    const ShadowMapView& view;
    const ShadowMapInfo& map;
    ShadowMapTrace* trace; ///< may be null
    size_t pageStart = 0;
    bool isInPage = false, hasPage = false;
    float nearest = 0.0f;
    uint32_t missing = 0;

    // Nearly all filters lie within one page, so its address is looked up once.
    SDAG_HD void begin(uint32_t face, int32_t x, int32_t y, int32_t side) {
        const uint32_t log2 = view.pageTexelsLog2;
        const int32_t n = int32_t(map.faceTexels);
        isInPage = x >= 0 && y >= 0 && x + side <= n && y + side <= n &&
                   x >> log2 == (x + side - 1) >> log2 && y >> log2 == (y + side - 1) >> log2;
        nearest = 0.0f;
        missing = 0;
        if (!isInPage)
            return;
        const uint32_t page =
            view.pageTable[pageTableIndex(map, face, uint32_t(x) >> log2, uint32_t(y) >> log2)];
        hasPage = page != kNoPage;
        pageStart = size_t(page) << (2 * log2);
    }

    SDAG_HD TapResult ask(CubeTexel texel, float u, float v, float limit, bool isCounted) {
        if (texel.x + 1 < map.faceTexels && isMutant(Mutant::kMapTexelShifted))
            ++texel.x;
        uint32_t stored = kNoPage;
        if (!isInPage) {
            stored = depthAt(view, map, texel);
        } else if (hasPage) {
            stored = view.depths[pageStart + texelInPage(texel.x, texel.y, view.pageTexelsLog2)];
        }
        if (stored == kNoPage) {
            ++missing;
            return TapResult::kMissing;
        }
        float w;
        memcpy(&w, &stored, sizeof w);
        if (!(w > limit))
            return TapResult::kLit;
        if (trace && isCounted && w > nearest) {
            nearest = w;
            trace->blockerWorld = worldFromMap(map, texel.face, u, v, w);
            trace->texelWorld = map.window.isDirectional()
                                    ? float(map.window.texelWorld(map.faceTexels))
                                    : 2.0f / (float(map.faceTexels) * w);
        }
        return TapResult::kDark;
    }
};

/// Returns the visibility of the light of map `map` from a receiver, 255 lit .. 0 dark, rounded to
/// nearest. A tap on a page without memory is never lit: it is counted dark and in `trace` (may be
/// null).
///
/// Filters, by ShadowMapBias::taps. 9: the 3 x 3 texels around the one that holds the receiver,
/// weighted (1 - f, 1, f) / 2 along each side, f being the receiver's place in its texel: the box
/// of two by two texels around the receiver. 4: the 2 x 2 texels whose centres are around the
/// receiver, bilinearly weighted: the box of one texel. 1: the texel that holds the receiver. The
/// first two are continuous in the receiver's position. Taps beyond a face are read from the
/// neighbour face. Every tap compares along the ray through its own texel's centre.
///
/// Bias. Let P be the receiver, d = P - L, n its normal, h = -n.d > 0 the light's height over its
/// plane. A blocker of P lies on the light's side of two planes: the receiver's own, and the one
/// through P perpendicular to the ray. On a tap's ray, p = z c with c = (u, v, 1) in the face's
/// frame, they lie at 1/z = -n.c / h and 1/z = d.c / d.d, so a texel blocks only if its 1/z exceeds
/// both. For a plane, lit at any angle, the first is exactly the stored 1/z up to rounding, so
/// slopes need no bias. A receiver that is not a plane within the filter needs one (a concave edge,
/// a fold of cloth): for it blockers within k = constantTexels texels (2 z / N each) before the
/// nearer plane are ignored:
///     blocks <=> w > max( -n.c / max(h - r, h / 2), d.c / (d.d (1 - s)) ) / (1 - min(2 k / N,
///     1/2)).
/// r = 2^-22 |P| + 2^-20 |d| (largest components) and s = 2^-20 + r / z_P cover rounding: P is a
/// float of the world, off its plane by up to sqrt(3) 2^-24 |P|, and 2^-22 |P| is also what the
/// truth takes for one surface (hybrid/judge/truth.h); L is exact, so all else rounds relative to
/// d. (A former 2^-20 of |P| + |L| ignored blockers within 13 cm at 1e5 m from the origin, and lost
/// contact shadows.) The bias acts along the ray and not along the normal: lifting the plane by k
/// texels instead ignores k / cos as much and lost contact shadows on slopes (atrium, 256 texels, k
/// = 1: 2.3 % false light against 1.2 %, false shadow 0.3 % both). Cost: blockers nearer to the
/// receiver than k texels do not block (detached contact shadows).
///
/// Level of detail. The surfaces in a map with lodTexels = t > 0 deviate from the full surfaces by
/// less than t texels: 2 t z_P / N in the world at the receiver, whose own part is no nearer to the
/// light than the place that the level was chosen for (PolygonLevelsView::levelFor). So the
/// receiver's own level lies less than e = 2 t z_P / N above its plane, measured perpendicular to
/// it. The bias is raised only in that direction: h is reduced by e, down to half of h (a light
/// nearer to the plane than 2 e). Raising k by t instead left acne: along the ray that surface is e
/// |d| / h away.
///
/// Low taps. On a slope a tap on the low side passes under objects before the receiver: its ray
/// meets the plane nearer to the light, and there it tests another place than the receiver's. Taps
/// that end more than kLowTapTexels before the receiver are omitted and the others weighted up:
/// light at 76 degrees and more. The taps' weighted mean is the receiver itself, so some tap with
/// weight ends behind it and stays. Planes lose nothing: every tap of a lit plane is lit. Measured
/// in FILTERS.md: a tenth less false light, the same false shadow.
/// @param positionWorld,normalWorld the receiver and its unit geometric normal on the light's side;
/// a normal that does
///        not face the light is replaced by the direction to it
/// @returns 255 for a receiver at the light itself, 0 for a position that is not a number
SDAG_HD inline uint8_t lookupVisibility(const ShadowMapView& view, uint32_t mapIndex,
                                        const glm::vec3& positionWorld,
                                        const glm::vec3& normalWorld, const ShadowMapBias& bias,
                                        ShadowMapTrace* trace = nullptr) {
    const ShadowMapInfo& map = view.maps[mapIndex];
    MapTaps taps{view, map, trace};
    const uint8_t visibility = filterVisibility(map, positionWorld, normalWorld, bias, taps);
    if (trace)
        trace->missingTapCount = taps.missing;
    return visibility;
}

/// Returns lookupVisibility, and adds the taps on pages without memory to missingTapCount.
/// @tparam kDirectional,kTaps of filterVisibility
template <bool kDirectional = true, uint32_t kTaps = 0>
SDAG_HD inline uint8_t countedVisibility(const ShadowMapView& view, uint32_t mapIndex,
                                         const glm::vec3& positionWorld,
                                         const glm::vec3& normalWorld, const ShadowMapBias& bias,
                                         uint32_t& missingTapCount) {
    const ShadowMapInfo& map = view.maps[mapIndex];
    MapTaps taps{view, map, nullptr};
    const uint8_t visibility =
        filterVisibility<kDirectional, kTaps>(map, positionWorld, normalWorld, bias, taps);
    missingTapCount += taps.missing;
    return visibility;
}

} // namespace shadowdag
