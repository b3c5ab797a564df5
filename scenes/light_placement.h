// SPDX-License-Identifier: Apache-2.0
// Seeded point lights for scenes without lights, and for `--lights N --seed S`, which also replaces
// a directional light.
#pragma once

#include "scenes/light.h"
#include "scenes/world.h"

namespace shadowdag {

struct QueryCost;

/// Returns `count` static point lights in free space near the surfaces of the world at its current
/// time. Each starts at an area-weighted random point of the triangles and is moved away along the
/// side of the surface that has more space, else the other. Places are rejected, while there are
/// others, if they are nearer to another surface than half of that distance, outside the bounds, or
/// visible from fewer than four of the nearest stations of OpenSpace (open_space.h), as in gaps and
/// solids. Ranges differ by a factor of up to four, smaller ones more often, around a radius chosen
/// so that on average twelve lights reach a surface point visible from a station, from the visible
/// side; or 3/4 of those on that side, if that is less. Intensities give each light an irradiance
/// of about 1 lux at half its range. No scale is assumed. Deterministic in (world, count, seed);
/// places do not depend on the count, ranges do. Takes time in proportion to the count, and to n
/// log n for n triangles: where too many of them overlap, queries are cut (triangle_tree.h) with a
/// warning.
/// @param cost receives what the queries took; may be null
std::vector<Light> placeLights(const World& world, int count, uint64_t seed,
                               QueryCost* cost = nullptr);

} // namespace shadowdag
