// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/directional_window.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// Texels that a filter may reach from the one that holds the receiver, and one for rounding.
constexpr double kBorderTexels = 3.0;
constexpr uint32_t kLeastWindowTexels = 64;

} // namespace

DirectionalFrame makeDirectionalFrame(const Light& light) {
    DirectionalFrame frame;
    frame.toLight = -glm::normalize(glm::dvec3(light.directionWorld));
    // Across: from the world axis that the light is least along, so that a light along an axis has
    // a window along the axes.
    const glm::dvec3 size = glm::abs(frame.toLight);
    const glm::dvec3 axis = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                            : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                 : glm::dvec3(0, 0, 1);
    frame.right = glm::normalize(glm::cross(axis, frame.toLight));
    frame.up = glm::cross(frame.toLight, frame.right);
    frame.extentWorld = directionalExtentWorld(light);
    // Twice the extent contains the sphere and the step by which its end is rounded down.
    frame.depthWorld = 2.0 * frame.extentWorld;
    const double step = frame.depthWorld / 8.0;
    const double radius = light.rangeWorld;
    frame.farWorld =
        std::floor((glm::dot(frame.toLight, glm::dvec3(light.positionWorld)) - radius) / step) *
        step;
    return frame;
}

void DirectionalRect::add(const DirectionalFrame& frame, const Box& boxWorld) {
    const glm::dvec3 center = 0.5 * (glm::dvec3(boxWorld.min) + glm::dvec3(boxWorld.max));
    const glm::dvec3 half = 0.5 * (glm::dvec3(boxWorld.max) - glm::dvec3(boxWorld.min));
    const double u = glm::dot(frame.right, center), v = glm::dot(frame.up, center);
    const double du = glm::dot(glm::abs(frame.right), half);
    const double dv = glm::dot(glm::abs(frame.up), half);
    uMin = std::min(uMin, u - du);
    uMax = std::max(uMax, u + du);
    vMin = std::min(vMin, v - dv);
    vMax = std::max(vMax, v + dv);
}

FittedWindow fitDirectionalWindow(const DirectionalFrame& frame, const DirectionalRect& rect,
                                  uint32_t texelsPerExtent, uint32_t maxFaceTexels) {
    SDAG_ASSERT(rect.uMin <= rect.uMax && rect.vMin <= rect.vMax);
    SDAG_ASSERT(texelsPerExtent >= 1 && maxFaceTexels >= kLeastWindowTexels);
    FittedWindow map;
    for (uint32_t texels = texelsPerExtent;; texels = std::max(texels / 2, 1u)) {
        const double texel = frame.extentWorld / double(texels);
        const double u0 = std::floor(rect.uMin / texel) - kBorderTexels,
                     v0 = std::floor(rect.vMin / texel) - kBorderTexels;
        const double u1 = std::floor(rect.uMax / texel) + kBorderTexels,
                     v1 = std::floor(rect.vMax / texel) + kBorderTexels;
        for (uint32_t side = kLeastWindowTexels; side <= maxFaceTexels; side *= 2) {
            const double step = double(side) / 4.0;
            const double first[2] = {std::floor(u0 / step) * step, std::floor(v0 / step) * step};
            if (!(u1 < first[0] + double(side) && v1 < first[1] + double(side)))
                continue;
            map.faceTexels = side;
            map.texelsPerExtent = texels;
            map.widthTexels = std::max(u1 - u0, v1 - v0) + 1.0 - 2.0 * kBorderTexels;
            // Each of the (x - first) texels is 2 / side of the window.
            const double scale = 2.0 / (double(side) * texel);
            map.window.u = frame.right * scale;
            map.window.v = frame.up * scale;
            map.window.w = frame.toLight / frame.depthWorld;
            map.window.u0 = first[0] * (2.0 / double(side)) + 1.0;
            map.window.v0 = first[1] * (2.0 / double(side)) + 1.0;
            map.window.w0 = frame.farWorld / frame.depthWorld - 1.0;
            return map;
        }
        if (texels <= 1) // a texel as wide as the scene does not hold the receivers
            throw Error(ErrorKind::kResource, "a directional light's window does not hold its "
                                              "receivers at one texel per scene; allow "
                                              "more texels across a face");
    }
}

} // namespace shadowdag
