// SPDX-License-Identifier: Apache-2.0
// The rays of a camera's pixels, built once on the host, so that no processor computes a tangent.
#pragma once

#include "scenes/camera.h"

#include <cstdint>

namespace shadowdag {

/// Pixel (x, y)'s sample lies on origin + t * direction(x, y), where t is the distance along the
/// camera's forward axis in metres. Doubles: a sample is then exact to the rounding of its float
/// position.
struct ViewRays {
    glm::dvec3 origin;
    glm::dvec3 right, up, forward; ///< orthonormal
    glm::dvec3 first;              ///< direction of pixel (0, 0); first . forward = 1
    glm::dvec3 stepX, stepY; ///< from a pixel's direction to that of its right and lower neighbour
    double firstX, firstY;   ///< first = forward + firstX * right + firstY * up
    double pixelSize;        ///< side of a pixel at distance 1: |stepX| = |stepY|
    double znear, zfar;      ///< metres
    uint32_t width, height;  ///< pixels

    SDAG_HD glm::dvec3 direction(uint32_t x, uint32_t y) const {
        return first + double(x) * stepX + double(y) * stepY;
    }
    bool operator==(const ViewRays&) const = default;
};

/// Returns the rays of a camera for an image of width x height pixels. Throws Error kUsage for an
/// empty image, one of more than 16384 pixels a side, or a camera that is not a finite perspective
/// one with 0 < znear < zfar and
/// kMinFieldOfView <= yfov < 3.1.
ViewRays makeViewRays(const Camera& camera, uint32_t width, uint32_t height);

} // namespace shadowdag
