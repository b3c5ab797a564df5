// SPDX-License-Identifier: Apache-2.0
// The failure scenes: each provokes one known failure of shadow maps or voxel rays and is made of
// boxes, boards, balls and lights only, so that the right answer has a closed form. One description
// makes both.
#pragma once

#include "scenes/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// A box in any orientation; may be flat (one half extent 0). Moves by `velocity` metres a second
/// from time 0 to 4 seconds.
struct FailBox {
    glm::dvec3 center, half;
    double yawTurns = 0.0, pitchTurns = 0.0; ///< turned about its own X, then about Y
    uint32_t material = 1;                   ///< 1 floor, 2 occluder, 3 second occluder
    glm::dvec3 velocity{0.0};
    /// Of a flat box (half.y = 0): an alpha mask cuts it out as a chequer board of this many
    /// squares a side, an even number; 0: solid. The square at its least corner is there, its
    /// neighbours are holes.
    int chequerCount = 0;
};

/// A ball of facets whose corners lie on a sphere: many triangles, for polygon levels of detail.
struct FailBall {
    glm::dvec3 center;
    double radius;
    int segments = 96, rings = 48; ///< facets around and from pole to pole
};

struct FailLight {
    glm::dvec3 position;
    double range;
    double intensity; ///< candela; of a sun lux
    /// Where a sun's light goes; zero: not a sun. A sun's position and range are not used.
    glm::dvec3 sunDirection{0.0};
    /// Moves by as many metres a second from time 0 to 4 seconds; not of a sun.
    glm::dvec3 velocity{0.0};
};

struct FailScene {
    std::string name;
    std::string description; ///< one line: the rows of the list of failures that it is, what it
                             ///< shows, and the source where that is not the list's
    std::vector<FailBox> boxes;
    std::vector<FailLight> lights;
    glm::dvec3 eye, target;
    /// Degenerate, doubled and flipped triangles are added, which must change nothing.
    bool isMessy = false;
    std::vector<FailBall> balls = {};
    /// The camera goes to and fro, as far as this and back to the other side every two seconds,
    /// from time 0 to 4 seconds.
    glm::dvec3 eyeSway{0.0};
};

/// Returns every failure scene, in the order in which they are listed to the user.
std::vector<FailScene> failScenes();

/// Returns the scene as any other: meshes, lights, a camera node "camera".
Scene makeFailScene(const FailScene& description);

/// Returns the point that light number `light` shines on a point from: its position, or, of a sun,
/// one beyond the scene.
glm::dvec3 lightPointOf(const FailScene& scene, const glm::dvec3& pointWorld, int light,
                        double timeSeconds = 0.0);

/// Returns whether light number `light` is seen from point p of a surface whose normal faces it, at
/// a time: true lit, false dark, nothing where the answer hangs on less than 1e-6 of the scene's
/// extent (a ray along an edge, a hole's too, or along its own surface) or where p is buried in a
/// solid; nothing, too, where it hangs on how facets differ from the sphere of a ball, so of all
/// points of a ball itself. In closed form: the segment (towards a sun one that leaves the scene),
/// shortened by 1e-4 of the extent at both ends, against every box and sphere. So a light that
/// touches a surface lights the side on which it lies, and a point is not shadowed by the surface
/// it lies on. The light's range is not asked.
std::optional<bool> expectedLit(const FailScene& scene, const glm::dvec3& pointWorld, int light,
                                double timeSeconds = 0.0);

} // namespace shadowdag
