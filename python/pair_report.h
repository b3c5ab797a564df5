// SPDX-License-Identifier: Apache-2.0
// What is known of one pair of a frame: for following an error to its pixel and its blocker.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/settings/json.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/workspace.h"

namespace shadowdag::python {

/// Returns {"pixel", "light", "position_world", "normal_world", "light_world", "triangle",
/// "server", "visibility", "truth", "truth_blocker" (null if lit, else triangle, distance_world,
/// surface), "voxel" (null unless rays through voxels stopped: cell, level, center_world,
/// size_world), "map" (null unless a map served: face_texels, texel_world, blocker_world)}.
/// @param answers of the workspace's last frame
Json pairReport(Workspace& workspace, const RunParameters& run, const PairResults& answers,
                const std::vector<uint8_t>& truth, uint64_t pair);

} // namespace shadowdag::python
