// SPDX-License-Identifier: Apache-2.0
// Reading a virtual cube shadow map: from a receiver to a face, page, texel, and the filtered
// answer.
#pragma once

#include "cuda/view.h"
#include "shadowmap/shadow_map_info.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <cstring>

namespace shadowdag {

/// Everything a lookup reads.
/// maps: mapCount; pageTable: pool page or kNoPage; depths: pageCount * pageTexels^2.
/// A depth is the float bits of 1/z, z being the depth along the face's axis (world units) of the
/// nearest surface on the ray through the texel's centre; 0 where there is none. Nearer is greater,
/// as float and as uint32. Of a sun it is the w of sun_window.h.
struct ShadowMapView {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> pageTable;
    View<const uint32_t> depths;
    uint32_t pageTexelsLog2 = 6;
};

/// How a receiver is compared with what the map holds. In texels, never in world units.
struct ShadowMapBias {
    float constantTexels = 0.5f; ///< how many texels before the receiver a blocker is forgiven; 0
                                 ///< leaves what rounding needs
    uint32_t taps = 9;           ///< 1, or 9 (3 x 3 PCF, bilinearly weighted)
};

/// What a lookup found beside its answer.
struct ShadowMapTrace {
    glm::vec3 blockerWorld{0.0f}; ///< a point of the nearest blocking texel; meaningless when lit
    float texelWorld = 0.0f;      ///< side of a texel at the blocker, world
    uint32_t missingTapCount = 0; ///< taps on pages without memory (counted dark)
};

/// A texel of a map.
struct CubeTexel {
    uint32_t face, x, y;
};

/// Returns the texel that column x and row y of a face mean, both possibly outside of the face by
/// less than its side: such a direction belongs to a neighbour face, and the texel that holds it
/// there answers for it.
SDAG_HD inline CubeTexel wrapTexel(uint32_t face, int32_t x, int32_t y, uint32_t faceTexels) {
    const int32_t n = int32_t(faceTexels);
    if (x >= 0 && x < n && y >= 0 && y < n)
        return {face, uint32_t(x), uint32_t(y)};
    const glm::vec3 d = lightFromFace(
        face, glm::vec3(faceCellCentre(x, faceTexels), faceCellCentre(y, faceTexels), 1.0f));
    const uint32_t neighbour = faceOf(d);
    const glm::vec3 q = faceFromLight(neighbour, d);
    return {neighbour, faceCell(q.x / q.z, faceTexels), faceCell(q.y / q.z, faceTexels)};
}

/// Returns the stored depth bits of a texel, or kNoPage where its page has no memory.
SDAG_HD inline uint32_t depthAt(const ShadowMapView& view, const ShadowMapInfo& map,
                                const CubeTexel& texel) {
    const uint32_t log2 = view.pageTexelsLog2;
    const uint32_t page =
        view.pageTable[pageTableIndex(map, texel.face, texel.x >> log2, texel.y >> log2)];
    if (page == kNoPage)
        return kNoPage;
    const uint32_t mask = (1u << log2) - 1;
    return view
        .depths[(size_t(page) << (2 * log2)) + ((texel.y & mask) << log2) + (texel.x & mask)];
}

/// Returns the visibility of the light of map `map` from a receiver, 255 lit .. 0 dark, rounded to
/// nearest. A tap on a page without memory is never lit: it is counted dark and in `trace` (may be
/// null).
///
/// Filter: the 3 x 3 texels around the one that holds the receiver, weighted (1 - f, 1, f) / 2
/// along each side, f being the receiver's place in its texel: the box of two by two texels around
/// the receiver, continuous in its position. Taps beyond a face are read from the neighbour face.
/// Every tap compares along the ray through its own texel's centre.
///
/// Bias. Let P be the receiver, d = P - L, n its normal, h = -n.d > 0 the light's height over its
/// plane. What blocks P lies on the light's side of two planes: the receiver's own, and the one
/// through P across the ray. On a tap's ray, p = z c with c = (u, v, 1) in the face's frame, they
/// lie at 1/z = -n.c / h and 1/z = d.c / d.d, so a texel blocks only if its 1/z exceeds both. A
/// plane lit at any angle answers with the very 1/z that was stored, up to rounding: no slope needs
/// a bias. What does is a receiver that is not a plane within the filter (a concave edge, a fold of
/// cloth): for it blockers within k = constantTexels texels (2 z / N each) before the nearer plane
/// are forgiven:
///     blocks <=> w > max( -n.c / max(h - r, h / 2), d.c / (d.d (1 - s)) ) / (1 - min(2 k / N,
///     1/2)).
/// r = 2^-20 (|P| + |L| + |d|) (largest components) and s = 2^-20 + r / z_P cover rounding:
/// positions are floats of the world. Along the ray and not along the normal: lifting the plane by
/// k texels instead forgives k / cos as much and lost contact shadows on slopes (atrium, 256
/// texels, k = 1: 2.3 % false light against 1.2 %, false shadow 0.3 % both). Price: blockers nearer
/// to the receiver than k texels do not block (detached contact shadows); on a slope a tap on the
/// low side passes under what stands close to the receiver, as its ray meets the plane nearer to
/// the light.
/// @param positionWorld,normalWorld the receiver and its unit geometric normal on the light's side;
/// a normal that does
///        not face the light is replaced by the direction to it
/// @returns 255 for a receiver at the light itself, 0 for a position that is not a number
SDAG_HD inline uint8_t lookupVisibility(const ShadowMapView& view, uint32_t mapIndex,
                                        const glm::vec3& positionWorld,
                                        const glm::vec3& normalWorld, const ShadowMapBias& bias,
                                        ShadowMapTrace* trace = nullptr) {
    const ShadowMapInfo& map = view.maps[mapIndex];
    const glm::vec3 d = positionWorld - map.lightPositionWorld;
    const float dd = glm::dot(d, d);
    if (dd == 0.0f)
        return 255;
    if (!(dd > 0.0f))
        return 0;
    const uint32_t n = map.faceTexels;
    const uint32_t face = faceOf(d);
    const glm::vec3 q = faceFromLight(face, d);
    const float rDepth = 1.0f / q.z;
    const float sx = glm::clamp((q.x * rDepth + 1.0f) * (0.5f * float(n)), 0.0f, float(n));
    const float sy = glm::clamp((q.y * rDepth + 1.0f) * (0.5f * float(n)), 0.0f, float(n));
    const int32_t x = int32_t(sx) < int32_t(n) ? int32_t(sx) : int32_t(n) - 1;
    const int32_t y = int32_t(sy) < int32_t(n) ? int32_t(sy) : int32_t(n) - 1;

    constexpr float kRounding = 1.0f / float(1 << 20);
    const glm::vec3 largest =
        glm::abs(positionWorld) + glm::abs(map.lightPositionWorld) + glm::abs(d);
    const float rounding = kRounding * glm::max(largest.x, glm::max(largest.y, largest.z));
    const float height = -glm::dot(normalWorld, d);
    const bool faces = height > 0.0f;
    const float forgiven = 1.0f / (1.0f - glm::min(2.0f * bias.constantTexels / float(n), 0.5f));
    const float rHeight = faces ? forgiven / glm::max(height - rounding, 0.5f * height) : 0.0f;
    const float rAcross = forgiven / (dd * (1.0f - glm::min(rounding * rDepth + kRounding, 0.5f)));

    // Both planes as linear forms of c: in world axes here, in a face's below.
    const glm::vec3 ownWorld = faces ? normalWorld * -rHeight : glm::vec3(0.0f);
    const glm::vec3 acrossWorld = d * rAcross;

    const int32_t reach = bias.taps > 1 ? 1 : 0;
    const float fx = sx - float(x), fy = sy - float(y);
    const float rTexels = 1.0f / float(n);
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t end = int32_t(n);
    // Nearly all filters lie within one page: its address is then found once.
    const bool isInFace = x >= reach && y >= reach && x + reach < end && y + reach < end;
    const bool isInPage = isInFace && (x - reach) >> log2 == (x + reach) >> log2 &&
                          (y - reach) >> log2 == (y + reach) >> log2;
    const uint32_t page =
        isInPage
            ? view.pageTable[pageTableIndex(map, face, uint32_t(x) >> log2, uint32_t(y) >> log2)]
            : kNoPage;
    const size_t pageStart = size_t(page) << (2 * log2);
    const int32_t inPage = (1 << log2) - 1;
    glm::vec3 own = faceFromLight(face, ownWorld), across = faceFromLight(face, acrossWorld);
    float lit = 0.0f;
    float nearest = 0.0f;
    uint32_t missing = 0;
    for (int32_t j = -reach; j <= reach; ++j) {
        const float wy = reach == 0 || j == 0 ? 1.0f : j < 0 ? 1.0f - fy : fy;
        for (int32_t i = -reach; i <= reach; ++i) {
            const float wx = reach == 0 || i == 0 ? 1.0f : i < 0 ? 1.0f - fx : fx;
            CubeTexel texel{face, uint32_t(x + i), uint32_t(y + j)};
            uint32_t stored = kNoPage;
            if (isInPage) {
                if (page != kNoPage)
                    stored = view.depths[pageStart + (size_t((y + j) & inPage) << log2) +
                                         size_t((x + i) & inPage)];
            } else {
                if (!isInFace) {
                    texel = wrapTexel(face, x + i, y + j, n);
                    own = faceFromLight(texel.face, ownWorld);
                    across = faceFromLight(texel.face, acrossWorld);
                }
                stored = depthAt(view, map, texel);
            }
            if (stored == kNoPage) {
                ++missing;
                continue;
            }
            float w;
            memcpy(&w, &stored, sizeof w);
            const float u = float(2 * int32_t(texel.x) + 1 - end) * rTexels;
            const float v = float(2 * int32_t(texel.y) + 1 - end) * rTexels;
            const float ownHere = own.x * u + own.y * v + own.z;
            const float acrossHere = across.x * u + across.y * v + across.z;
            if (!(w > glm::max(ownHere, acrossHere))) {
                lit += wx * wy;
                continue;
            }
            if (trace && w > nearest) {
                nearest = w;
                trace->blockerWorld =
                    map.lightPositionWorld + lightFromFace(texel.face, glm::vec3(u, v, 1.0f)) / w;
                trace->texelWorld = 2.0f / (float(n) * w);
            }
        }
    }
    if (trace)
        trace->missingTapCount = missing;
    // The weights of 3 x 3 taps sum to 4.
    return uint8_t(lit * (reach ? 63.75f : 255.0f) + 0.5f);
}

} // namespace shadowdag
