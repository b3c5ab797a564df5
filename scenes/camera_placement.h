// SPDX-License-Identifier: Apache-2.0
// Several automatic cameras of a scene; placeCamera of world.h returns the first of them.
#pragma once

#include "cuda/progress.h"
#include "scenes/world.h"

#include <vector>

namespace shadowdag {

struct QueryCost;

/// Returns up to `count` cameras, best first; the first few do not depend on the count. Each camera
/// after the first scores more the farther it stands or looks from those before it, and the more
/// lights it shows that they do not; where there are lights, it sees some samples lit and some
/// dark, and there are fewer cameras than `count` if too few views do. See placeCamera for where
/// they stand and how they are scored. Queries are cut as for placeLights (light_placement.h).
/// @param cost receives what the queries took; may be null
/// @param progress the share of the rays that score views; 0 while places for them are searched
std::vector<Camera> placeCameras(const World& world, size_t count, QueryCost* cost = nullptr,
                                 const Progress& progress = {});

} // namespace shadowdag
