// SPDX-License-Identifier: Apache-2.0
// The failure scenes: each provokes one known failure of shadow maps or voxel rays and consists of
// boxes, boards, balls and lights only, so that the correct visibility has a closed form. One
// description gives both the meshes and the closed form.
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
    /// For a flat box (half.y = 0): an alpha mask cuts it out as a chequer board of this many
    /// squares per side, an even number; 0: solid. The square at its least corner is opaque, its
    /// neighbours are holes.
    int chequerCount = 0;
};

/// Returns the box between two corners, not turned.
inline FailBox boxBetween(const glm::dvec3& min, const glm::dvec3& max, uint32_t material = 2) {
    return {(min + max) * 0.5, (max - min) * 0.5, 0.0, 0.0, material};
}

/// A ball of facets whose corners lie on a sphere: many triangles, for polygon levels of detail.
struct FailBall {
    glm::dvec3 center;
    double radius;
    int segments = 96, rings = 48; ///< facets around and from pole to pole
};

struct FailLight {
    glm::dvec3 position;
    double range;
    double intensity; ///< candela; lux for directional lights
    /// Direction of a directional light; zero: another kind. Its position and range are not used.
    glm::dvec3 sunDirection{0.0};
    /// Moves by this many metres per second from time 0 to 4 seconds; not for directional lights.
    glm::dvec3 velocity{0.0};
};

struct FailScene {
    std::string name;
    std::string description; ///< one line: what it shows, and its source
    std::vector<FailBox> boxes;
    std::vector<FailLight> lights;
    glm::dvec3 eye, target;
    /// Degenerate, doubled and flipped triangles are added, which must not change anything.
    bool isMessy = false;
    std::vector<FailBall> balls = {};
    /// The camera moves by this distance to one side and back to the other side every two seconds,
    /// from time 0 to 4 seconds.
    glm::dvec3 eyeSway{0.0};
};

/// Returns every failure scene, in the order in which they are listed to the user.
std::vector<FailScene> failScenes();

/// Returns the failure scenes with lights in lamps: lanterns, shades, sconces and crates.
std::vector<FailScene> lampFailScenes();

/// Half the width of a lantern's bar, in distances from the light to its near face.
constexpr double kLanternBarHalf = 0.06;

/// Returns a lantern like those of fail-lantern, with its light at the origin and the near faces of
/// its middle bars at `barDistance`, before a wall at z = -wallDistance that is twice as wide and
/// high. The umbra of the middle bar there is |x| < kLanternBarHalf * wallDistance, whatever the
/// distance of the bar, above the ring below and below the ring above.
FailScene makeLanternStage(double barDistance, double wallDistance);

/// Returns it as an ordinary scene: meshes, lights, a camera node "camera".
Scene makeFailScene(const FailScene& description);

/// Returns the point from which light number `light` shines on a point: its position, or, for a
/// directional light, a point beyond the scene.
glm::dvec3 lightPointOf(const FailScene& scene, const glm::dvec3& pointWorld, int light,
                        double timeSeconds = 0.0);

/// Returns whether light number `light` is visible from point p of a surface whose normal faces it,
/// at a time: true lit, false dark. Returns nothing if the result depends on less than 1e-6 of the
/// scene's extent (a ray along an edge, a hole's too, or along its own surface), if p is inside a
/// solid, or if it depends on the difference between a ball's facets and its sphere, as for all
/// points of a ball itself. In closed form: the segment (towards a directional light one that
/// leaves the scene), shortened by 1e-4 of the extent at both ends, is tested against every box and
/// sphere. So a light that touches a surface lights the side on which it lies, and a point is not
/// shadowed by the surface it lies on. The light's range is ignored.
std::optional<bool> expectedLit(const FailScene& scene, const glm::dvec3& pointWorld, int light,
                                double timeSeconds = 0.0);

} // namespace shadowdag
