// SPDX-License-Identifier: Apache-2.0
// One shadow map: a virtual cube map around a light, or a directional light's window
// (directional_window.h), which has one face; the indices of its pages, and the projection of world
// points and boxes on its faces.
#pragma once

#include "shadowmap/cube_face.h"
#include "shadowmap/directional_window.h"
#include "shadowmap/spot_cone.h"

#include <cstdint>

namespace shadowdag {

/// One map, as lookups and the rasterizer see it.
struct ShadowMapInfo {
    glm::vec3 lightPositionWorld; ///< of a directional light: the sphere around the scene
    float rangeWorld;
    uint32_t faceTexels;     ///< side of a face in texels, after any degrading
    uint32_t facePages;      ///< side of a face in pages
    uint32_t pageTableStart; ///< first of 6 * facePages^2 entries; a multiple of 32
    DirectionalWindow window = {};
    SpotCone cone = {};
    /// Polygon level of detail that it is drawn at (ShadowMapOptions::lodTexels): its surfaces may
    /// be so many texels off the receivers'. Lookups compensate for this.
    float lodTexels = 0.0f;
    uint32_t light = 0; ///< MapRequest::light

    bool operator==(const ShadowMapInfo&) const = default;
};

/// Returns the page-table index of page (x, y) of a face: faces one after the other, rows of v, u
/// fastest.
SDAG_HD inline uint32_t pageTableIndex(const ShadowMapInfo& map, uint32_t face, uint32_t x,
                                       uint32_t y) {
    return pageTableIndexOf(map.pageTableStart, map.facePages, face, x, y);
}

/// Returns the faces that a map has, bit f: face f.
SDAG_HD inline uint32_t facesOf(const ShadowMapInfo& map) {
    return map.window.isDirectional() ? 1u << kDirectionalFace : (1u << kFaceCount) - 1;
}

/// Returns whether a world box reaches a face of a map, and its rectangle there: projectBox. Depths
/// are relative to the light; for a directional light they are 1/w, of which only the order
/// matters.
SDAG_HD inline bool projectOnMap(const ShadowMapInfo& map, const Box& boxWorld, uint32_t face,
                                 float margin, FaceRect& rect) {
    if (!map.window.isDirectional())
        return projectBox(
            {boxWorld.min - map.lightPositionWorld, boxWorld.max - map.lightPositionWorld}, face,
            margin, rect);
    if (face != kDirectionalFace || boxWorld.empty())
        return false;
    const DirectionalWindow& window = map.window;
    const glm::dvec3 lo(boxWorld.min), hi(boxWorld.max);
    const glm::dvec3 half = 0.5 * (hi - lo);
    const glm::dvec3 center = window.windowFromWorld(0.5 * (lo + hi));
    const double grow = double(margin) + double(kProjectionSlack);
    const double du = glm::dot(glm::abs(window.u), half) + grow;
    const double dv = glm::dot(glm::abs(window.v), half) + grow;
    if (!(center.x - du <= 1.0 && center.x + du >= -1.0 && center.y - dv <= 1.0 &&
          center.y + dv >= -1.0))
        return false;
    rect.uMin = float(glm::max(center.x - du, -1.0));
    rect.uMax = float(glm::min(center.x + du, 1.0));
    rect.vMin = float(glm::max(center.y - dv, -1.0));
    rect.vMax = float(glm::min(center.y + dv, 1.0));
    // Depths are bounded outwards, by more than float rounds.
    const double dw = glm::dot(glm::abs(window.w), half) + double(kProjectionSlack);
    constexpr double kLeast = 1e-3; // beyond the far end there is no content, and nothing is lost
    rect.depthMin = float(1.0 / glm::max(center.z + dw, kLeast));
    rect.depthMax = float(1.0 / glm::max(center.z - dw, kLeast));
    return true;
}

/// Returns whether a world box intersects the region of a map: the light's sphere, or a directional
/// light's window over the whole length of the light.
SDAG_HD inline bool reachesMap(const ShadowMapInfo& map, const Box& boxWorld) {
    FaceRect rect;
    if (map.window.isDirectional())
        return projectOnMap(map, boxWorld, kDirectionalFace, 0.0f, rect);
    return !boxWorld.empty() &&
           distanceSquared(boxWorld, map.lightPositionWorld) < map.rangeWorld * map.rangeWorld;
}

/// Returns a world point relative to the light, in double: for a cube the difference of two floats,
/// nearly always exact; for a directional light see DirectionalWindow::lightFromWorld.
SDAG_HD inline glm::dvec3 lightFromWorld(const ShadowMapInfo& map, const glm::vec3& pointWorld) {
    return map.window.isDirectional() ? map.window.lightFromWorld(glm::dvec3(pointWorld))
                                      : glm::dvec3(pointWorld) - glm::dvec3(map.lightPositionWorld);
}

/// Returns the world point at coordinates (u, v) of a face and depth 1/w.
SDAG_HD inline glm::vec3 worldFromMap(const ShadowMapInfo& map, uint32_t face, float u, float v,
                                      float w) {
    return map.window.isDirectional()
               ? glm::vec3(map.window.worldFromWindow(glm::dvec3(u, v, w)))
               : map.lightPositionWorld + lightFromFace(face, glm::vec3(u, v, 1.0f)) / w;
}

/// Returns the side of a texel of a map in the world, at a world point.
SDAG_HD inline double texelWorldAt(const ShadowMapInfo& map, const glm::vec3& pointWorld) {
    if (map.window.isDirectional())
        return map.window.texelWorld(map.faceTexels);
    const glm::vec3 d = glm::abs(pointWorld - map.lightPositionWorld);
    return 2.0 * double(glm::max(d.x, glm::max(d.y, d.z))) / double(map.faceTexels);
}

/// Surfaces nearer to the light than this, in units of lightFromWorld, do not block.
SDAG_HD inline double nearDepth(const ShadowMapInfo& map) {
    return nearDepthOf(map.window.isDirectional(), map.rangeWorld);
}

} // namespace shadowdag
