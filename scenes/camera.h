// SPDX-License-Identifier: Apache-2.0
// A perspective camera and the pixel rays that it defines.
#pragma once

#include "cuda/macros.h"

#include <glm/glm.hpp>

namespace shadowdag {

/// The minimum field of view. The slices of the cluster grid (hybrid/clusters/cluster_grid.h)
/// multiply as it narrows; a tenth of a degree is that of a telescope.
constexpr float kMinFieldOfView = 1e-3f;
/// The widest one that pictures have: below 3.1, where a plane of pixels still makes sense.
constexpr float kMaxFieldOfView = 3.0999f;

/// A pinhole camera in world space. Right-handed, looks along `forward`; y up. Pixel (0, 0) is the
/// top left; a pixel's sample lies at its centre.
struct Camera {
    glm::vec3 positionWorld{0.0f};
    glm::vec3 forward{0, 0, -1}; ///< unit
    glm::vec3 up{0, 1, 0};       ///< unit, orthogonal to forward
    float yfov = 0.9f;           ///< vertical field of view, radians, >= kMinFieldOfView
    float znear = 0.05f;         ///< metres, > 0; first cluster slice starts here
    float zfar = 1000.0f;        ///< metres; samples beyond are background

    SDAG_HD glm::vec3 right() const { return glm::cross(forward, up); }
};

} // namespace shadowdag
