// SPDX-License-Identifier: Apache-2.0
// The part of the world that one shadow map of a sun sees: a square window across its light, with
// texels that lie on a lattice fixed in the world, and a range of depths along the light.
//
// A sun's map is a cube map of one face whose light is infinitely far. A window takes a world point
// to (u, v, w): u and v in [-1, 1] across the light, w from 1 at the far end of the depths to 2 at
// their near end, all three affine in the point. The point (u / w, v / w, 1 / w) is then to the map
// what a point relative to the light is to a face of a cube: its u and v are quotients by depth,
// planes stay planes (the map is projective), and 1/z = w is linear across a plane and greater when
// nearer. So masks, culling, rasterization and the depths that are stored are those of cubes; w
// keeps 2^-23 of the depths' range.
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
struct SunWindow {
    glm::dvec3 u{0.0}, v{0.0}, w{0.0};
    double u0 = 0.0, v0 = 0.0, w0 = 0.0;

    SDAG_HD bool isSun() const { return w.x != 0.0 || w.y != 0.0 || w.z != 0.0; }
    SDAG_HD glm::dvec3 windowFromWorld(const glm::dvec3& p) const {
        return windowPoint(u, v, w, glm::dvec3(u0, v0, w0), p);
    }
    SDAG_HD glm::dvec3 worldFromWindow(const glm::dvec3& q) const {
        return u * ((q.x + u0) / glm::dot(u, u)) + v * ((q.y + v0) / glm::dot(v, v)) +
               w * ((q.z + w0) / glm::dot(w, w));
    }
    /// Returns what the texel's side is in the world when `faceTexels` of them make the window.
    SDAG_HD double texelWorld(uint32_t faceTexels) const {
        return 2.0 / (glm::sqrt(glm::dot(u, u)) * double(faceTexels));
    }
    /// Returns the point that stands to the window's map as one relative to the light to a cube's.
    SDAG_HD glm::dvec3 lightFromWorld(const glm::dvec3& p) const {
        return lightFromWindow(windowFromWorld(p));
    }

    bool operator==(const SunWindow&) const = default;
};

/// The directions and lengths that all windows of a sun share.
struct SunFrame {
    glm::dvec3 right, up, toSun; ///< unit, perpendicular
    double extentWorld;          ///< a power of two, no less than the scene is wide
    double farWorld;             ///< along toSun: where w is 1
    double depthWorld;           ///< from there to where w is 2; a power of two
};

/// Returns the least power of two that is not under the width of the scene a sun shines on: what
/// resolutions of suns are counted in.
SDAG_HD inline double sunExtentWorld(const Light& sun) {
    const double width = 2.0 * double(sun.rangeWorld);
    double extent = 1.0;
    while (extent < width)
        extent *= 2.0;
    while (extent * 0.5 >= width)
        extent *= 0.5;
    return extent;
}

/// Returns the frame of a sun. It depends on the direction and, in steps, on the sphere around the
/// scene: while that changes by less than an eighth of itself depths keep their meaning mostly, and
/// texels keep their place while its width stays between two powers of two.
SunFrame makeSunFrame(const Light& sun);

/// A rectangle across a sun's light, world units along right and up. Starts empty.
struct SunRect {
    double uMin = 1e300, uMax = -1e300, vMin = 1e300, vMax = -1e300;

    /// Grows to hold what a box covers.
    void add(const SunFrame& frame, const Box& boxWorld);
};

/// A window, and how many texels make a side of it.
struct SunMap {
    SunWindow window;
    uint32_t faceTexels = 0;      ///< a power of two
    uint32_t texelsPerExtent = 0; ///< of the lattice: a texel is extentWorld / this wide
    double widthTexels = 0;       ///< of the rectangle, its longer side
};

/// Returns the least window over a rectangle that filters around any point of it stay within. Its
/// texels lie on the lattice of `texelsPerExtent`, which is world-fixed: texel (0, 0) starts at the
/// world's origin. The window moves by a quarter of itself at a time, so that it mostly stays where
/// it is when the rectangle moves. Where it would have more than `maxFaceTexels`, texels are made
/// twice as wide until it has not.
/// @param rect not empty @param maxFaceTexels a power of two, 64 or more
SunMap fitSunWindow(const SunFrame& frame, const SunRect& rect, uint32_t texelsPerExtent,
                    uint32_t maxFaceTexels);

} // namespace shadowdag
