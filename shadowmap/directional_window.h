// SPDX-License-Identifier: Apache-2.0
// The part of the world that one shadow map of a directional light covers: a square window
// perpendicular to the light, with texels on a lattice fixed in the world, and a range of depths
// along the light.
//
// A directional light's map is a cube map of one face whose light is infinitely far. A window maps
// a world point to (u, v, w): u and v in [-1, 1] across the light, w from 1 at the far end of the
// depths to 2 at their near end, all three affine in the point. For the map, the point (u / w, v /
// w, 1 / w) takes the place of a point relative to the light for a face of a cube: its u and v are
// quotients by depth, planes stay planes (the map is projective), and 1/z = w is linear across a
// plane and greater when nearer. So masks, culling, rasterization and stored depths are those of
// cubes; w keeps 2^-23 of the depths' range.
#pragma once

#include "cuda/macros.h"
#include "scenes/box.h"
#include "scenes/light.h"
#include "shadowmap/cube_face_leaf.h"

#include <glm/glm.hpp>

#include <cstdint>

namespace shadowdag {

/// World to window: component i is dot(row i, point) - offset i. All zero: not a window. Rows are
/// perpendicular to each other, u and v of equal length.
struct DirectionalWindow {
    glm::dvec3 u{0.0}, v{0.0}, w{0.0};
    double u0 = 0.0, v0 = 0.0, w0 = 0.0;

    SDAG_HD bool isDirectional() const { return w.x != 0.0 || w.y != 0.0 || w.z != 0.0; }
    SDAG_HD glm::dvec3 windowFromWorld(const glm::dvec3& p) const {
        return windowPoint(u, v, w, glm::dvec3(u0, v0, w0), p);
    }
    SDAG_HD glm::dvec3 worldFromWindow(const glm::dvec3& q) const {
        return u * ((q.x + u0) / glm::dot(u, u)) + v * ((q.y + v0) / glm::dot(v, v)) +
               w * ((q.z + w0) / glm::dot(w, w));
    }
    /// Returns the side of a texel in the world if `faceTexels` of them make the window.
    SDAG_HD double texelWorld(uint32_t faceTexels) const {
        return 2.0 / (glm::sqrt(glm::dot(u, u)) * double(faceTexels));
    }
    /// Returns the window's equivalent of a cube's light-relative point.
    SDAG_HD glm::dvec3 lightFromWorld(const glm::dvec3& p) const {
        return lightFromWindow(windowFromWorld(p));
    }

    bool operator==(const DirectionalWindow&) const = default;
};

/// The directions and lengths that all windows of a directional light share.
struct DirectionalFrame {
    glm::dvec3 right, up, toLight; ///< unit, perpendicular
    double extentWorld;            ///< a power of two, at least the width of the scene
    double farWorld;               ///< along toLight: where w is 1
    double depthWorld;             ///< from there to where w is 2; a power of two
};

/// Returns the least power of two that is not below the width of the scene that the light
/// illuminates: the unit of a directional light's resolutions.
SDAG_HD inline double directionalExtentWorld(const Light& light) {
    const double width = 2.0 * double(light.rangeWorld);
    double extent = 1.0;
    while (extent < width)
        extent *= 2.0;
    while (extent * 0.5 >= width)
        extent *= 0.5;
    return extent;
}

/// Returns the frame of a directional light. It depends on the direction and, in steps, on the
/// sphere around the scene: while that changes by less than an eighth of itself, depths mostly keep
/// their meaning, and texels keep their places while its width stays between two powers of two.
DirectionalFrame makeDirectionalFrame(const Light& light);

/// A rectangle across a directional light, world units along right and up. Starts empty.
struct DirectionalRect {
    double uMin = 1e300, uMax = -1e300, vMin = 1e300, vMax = -1e300;

    /// Grows to contain what a box covers.
    void add(const DirectionalFrame& frame, const Box& boxWorld);
};

/// A window, and the number of texels of its side.
struct FittedWindow {
    DirectionalWindow window;
    uint32_t faceTexels = 0;      ///< a power of two
    uint32_t texelsPerExtent = 0; ///< of the lattice: a texel is extentWorld / this wide
    double widthTexels = 0;       ///< of the rectangle, its longer side
};

/// Returns the smallest window over a rectangle that contains filters around any point of it. Its
/// texels lie on the lattice of `texelsPerExtent`, which is fixed in the world: texel (0, 0) starts
/// at the world's origin. The window moves by a quarter of itself at a time, so that it mostly
/// stays in place when the rectangle moves. If it would have more than `maxFaceTexels`, the texel
/// width is doubled until it has not.
/// @param rect not empty @param maxFaceTexels a power of two, 64 or more
FittedWindow fitDirectionalWindow(const DirectionalFrame& frame, const DirectionalRect& rect,
                                  uint32_t texelsPerExtent, uint32_t maxFaceTexels);

} // namespace shadowdag
