// SPDX-License-Identifier: Apache-2.0
// Reading a virtual cube shadow map: from a receiver to a face, page, texel, and the filtered answer.
#pragma once

#include "cuda/view.h"

#include <glm/glm.hpp>

#include <cstdint>

namespace shadowdag {

constexpr uint32_t kNoPage = 0xffffffffu;

/// One map, as lookups and the rasterizer see it.
struct ShadowMapInfo {
    glm::vec3 lightPositionWorld;
    float rangeWorld;
    uint32_t faceTexels;     ///< side of a face in texels, after any degrading
    uint32_t facePages;      ///< side of a face in pages
    uint32_t pageTableStart; ///< first of 6 * facePages^2 entries
};

/// Everything a lookup reads.
/// maps: mapCount; pageTable: pool page or kNoPage; depths: pageCount * pageTexels^2, written by rasterization (see depth
/// convention in shadow_maps.cpp's rasterizer header).
struct ShadowMapView {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> pageTable;
    View<const uint32_t> depths;
    uint32_t pageTexelsLog2 = 6;
};

/// How a receiver is compared with what the map holds. In texels, never in world units.
struct ShadowMapBias {
    float constantTexels = 1.0f; ///< scales the derived bias; 0 none
    uint32_t taps = 9;           ///< 1, or 9 (3 x 3 PCF, bilinearly weighted)
};

/// What a lookup found beside its answer.
struct ShadowMapTrace {
    glm::vec3 blockerWorld; ///< a point of the nearest blocking texel; meaningless when lit
    float texelWorld;       ///< side of a texel at the blocker, world
    uint32_t missingTapCount; ///< taps on pages without memory (counted dark)
};

/// Returns the visibility of the light of map `map` from a receiver, 255 lit .. 0 dark, rounded to nearest.
/// A tap on a page without memory is never lit: it is counted dark and in `trace` (may be null).
/// @param positionWorld,normalWorld the receiver and its unit geometric normal on the light's side
SDAG_HD uint8_t lookupVisibility(const ShadowMapView& view, uint32_t map, const glm::vec3& positionWorld,
                                 const glm::vec3& normalWorld, const ShadowMapBias& bias, ShadowMapTrace* trace = nullptr);

} // namespace shadowdag
