// SPDX-License-Identifier: Apache-2.0
// What frames counted and how they erred, under the keys that scripts rely on.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns pair_count .. contact_count and mean_abs_visibility_error.
Json toJson(const ErrorCounts& counts);
/// Returns null_rate, tap_null_rate, tap_only_null_rate and the counts of right answers that they
/// are shares of: what explaining and settling errors is worth (ErrorReport).
Json nullRatesJson(const ErrorReport& report);
/// Returns stage names and times.
Json toJson(const StageTimes& stages);
/// Returns traced_light_count .. ray_count, page_count, texel_count, map_bytes and what culling
/// did.
Json toJson(const FrameCounts& counts);
/// Returns, where the page pool was full, what that cost: "pool full: resolutions divided by 1.41;
/// wanted 27641 pages, 15156 fit"; else "". A frame whose maps are coarser than its parameters ask
/// for must say so wherever its numbers are read.
std::string poolNote(const FrameCounts& counts);
/// The same of a run as results.json holds it; "" where it lacks the counts.
std::string poolNote(const Json& run);

/// Returns one object a map: quantities, route, pairs.
Json toJson(const std::vector<MapRecord>& maps);
/// Returns one object a light that has maps: map_count and drawn_map_count; route "map" or "rays",
/// "both" where some of its maps are drawn and some traced; texels and face_texels, the most that
/// any of its maps requests and is allocated; pages, the sum over its maps.
/// @param maps ascending light
Json lightsJson(const std::vector<MapRecord>& maps);

} // namespace shadowdag
