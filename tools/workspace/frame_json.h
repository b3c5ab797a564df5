// SPDX-License-Identifier: Apache-2.0
// The counts and errors of frames under the keys that scripts rely on.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns pair_count .. magnified_count and mean_abs_visibility_error.
Json toJson(const ErrorCounts& counts);
/// Returns null_rate, tap_null_rate, tap_only_null_rate and the counts of right results that they
/// are shares of: the selectivity of explaining and settling errors (ErrorReport).
Json nullRatesJson(const ErrorReport& report);
/// Returns stage names and times.
Json toJson(const StageTimes& stages);
/// Returns traced_light_count .. ray_count, page_count, texel_count, map_bytes and the counts of
/// culling.
Json toJson(const FrameCounts& counts);
/// Returns the effect of a full page pool: "pool full: resolutions divided by 1.41; wanted 27641
/// pages, 15156 fit"; else "". Every report of a frame whose maps are coarser than requested must
/// contain it.
std::string poolNote(const FrameCounts& counts);
/// The same for a run of results.json; "" if it lacks the counts.
std::string poolNote(const Json& run);
/// Returns whether the maps of a run's frame are coarser than requested, or lack pages.
bool isPoolFull(const Json& run);

/// Returns one object per map: quantities, route, pairs.
Json toJson(const std::vector<MapRecord>& maps);
/// Returns one object per light that has maps: map_count and drawn_map_count; route "map" or
/// "rays", "both" if some of its maps are drawn and some traced; texels and face_texels, the
/// maximum requested and allocated by its maps; pages, the sum over its maps.
/// @param maps ascending light
Json lightsJson(const std::vector<MapRecord>& maps);

} // namespace shadowdag
