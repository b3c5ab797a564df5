// SPDX-License-Identifier: Apache-2.0
// Seeded point lights for scenes without lights, and for `--lights N --seed S`, which also replaces
// a sun.
#pragma once

#include "scenes/light.h"
#include "scenes/world.h"

namespace shadowdag {

/// Returns `count` static point lights in free space near the surfaces of the world as it stands
/// now. Each starts at an area-weighted random point of the triangles and is pushed out along the
/// side of the surface that has more room, else the other; places nearer to another surface than
/// half of the distance kept, outside the bounds, or seen from fewer than four of the nearest
/// stations of OpenSpace (open_space.h), as in gaps and solids, are rejected while there are
/// others. Ranges differ by a factor of up to four, smaller ones more often, around a radius chosen
/// so that twelve lights on average reach a surface point that a station sees, from the side on
/// which it does; or 3/4 of those on that side, when that is less. Intensities give each light an
/// irradiance of about 1 lux at half its range. Nothing assumes a scale. Deterministic in (world,
/// count, seed); places do not depend on the count, ranges do.
std::vector<Light> placeLights(const World& world, int count, uint64_t seed);

} // namespace shadowdag
