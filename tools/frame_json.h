// SPDX-License-Identifier: Apache-2.0
// What frames counted and how they erred, under the keys that scripts rely on.
#pragma once

#include "hybrid/error.h"
#include "tools/json.h"

namespace shadowdag {

/// Returns pair_count .. contact_count and mean_abs_visibility_error.
Json toJson(const ErrorCounts& counts);
/// Returns stage names and times.
Json toJson(const StageTimes& stages);
/// Returns traced_light_count .. ray_count, page_count, texel_count, map_bytes and what culling
/// did.
Json toJson(const FrameCounts& counts);
/// Returns one object a map: quantities, route, pairs.
Json toJson(const std::vector<MapRecord>& maps);

} // namespace shadowdag
