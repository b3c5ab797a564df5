// SPDX-License-Identifier: Apache-2.0
// Isolated costs of maps as a file: what `oracle` measured, for --costs to replay.
#pragma once

#include "hybrid/cost_model.h"
#include "tools/json.h"

#include <map>
#include <string>
#include <utility>

namespace shadowdag {

/// Costs by scene name and frame.
using CostTable = std::map<std::pair<std::string, uint32_t>, FrameCosts>;

/// Returns {"costs": [{"scene", "frame", "maps": [{"light", "octave", "rays_ms", "map_ms"}]}]}.
Json toJson(const CostTable& costs);
/// Reads such a file. Throws Error kInput naming the file and what is wrong in it.
CostTable readCosts(const std::string& path);
/// Returns the costs of a frame. Throws Error kInput naming the file when it does not have them.
const FrameCosts& findCosts(const CostTable& costs, const std::string& path,
                            const std::string& scene, uint32_t frame);

} // namespace shadowdag
