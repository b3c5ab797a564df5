// SPDX-License-Identifier: Apache-2.0
// The camera that keys and mouse control, and its text form, which gives the same camera in every
// program.
#pragma once

#include "scenes/camera.h"

#include <string>

namespace shadowdag {

/// The keys that are held and the mouse movement since the last step.
struct FlyInput {
    glm::vec3 along{0.0f}; ///< right, up, forward; each -1, 0 or 1
    glm::vec2 turn{0.0f};  ///< of the mouse, pixels: right and down are positive
    bool isFast = false;   ///< four times the speed
    bool any() const { return along != glm::vec3(0.0f) || turn != glm::vec2(0.0f); }
};

/// A camera that is moved by steps and keeps its roll. Position in double: steps are small.
class FlyCamera {
public:
    FlyCamera() = default;
    /// Copies position, direction, roll, field of view and planes of a camera; one that looks
    /// straight up or down is tilted by 4 degrees.
    explicit FlyCamera(const Camera& camera);

    /// Moves and turns, as the picture has right and up; E and Q rise and fall in the world.
    /// @param seconds since the last step, @param metresPerSecond at normal speed
    /// @param radiansPerPixel of the mouse
    void step(const FlyInput& input, double seconds, double metresPerSecond,
              double radiansPerPixel);

    /// Returns px,py,pz,tx,ty,tz,fovDegrees,near,far and, if it is not zero, the roll, as
    /// --camera accepts it. The target is one metre ahead. Equal texts give equal cameras in every
    /// program.
    std::string text() const;

private:
    glm::dvec3 position_{0.0};
    double yaw_ = 0;   // about +y, 0 looks along -z, radians
    double pitch_ = 0; // up is positive, radians
    double roll_ = 0;  // by how much up leans to the right, radians
    double yfov_ = 0.9;
    float znear_ = Camera{}.znear, zfar_ = Camera{}.zfar;
};

/// Returns a speed, in metres a second, that crosses a scene of this size in about ten seconds.
double flySpeed(float sceneDiagonalWorld);

} // namespace shadowdag
