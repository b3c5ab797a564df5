// SPDX-License-Identifier: Apache-2.0
// A compare in parts: `--part k/n` measures a share, `--join` makes the report of all of them.
//
// The unit of division is a frame with all its configurations: their times can be compared only if
// one process measured them in turn, and they share the truth and the maps' isolated costs.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/measure.h"

#include <string>
#include <vector>

namespace shadowdag {

/// More parts than there can be frames.
constexpr uint32_t kMaxRunPartCount = 65536;

/// The frames of a compare that a part measures: neighbours, scene by scene and view by view, so
/// that as few scenes as possible are loaded twice.
struct CompareShare {
    uint32_t part = 1, partCount = 1; ///< 1 <= part <= partCount <= kMaxRunPartCount

    /// Returns the frames of a view of the scene-th scene that this part measures, ascending as in
    /// `experiment`.
    std::vector<uint32_t> frames(const Experiment& experiment, size_t scene, uint32_t view) const;
    /// Returns whether it measures any frame of the scene.
    bool has(const Experiment& experiment, size_t scene) const;
};

/// The results of a compare, scenes and frames in order.
struct CompareFindings {
    Json results; ///< as results.json holds them
    Json lights = Json::array();
    CostTable costs;

    /// Creates an empty result.
    CompareFindings(const Json& provenance, const Json& experiment);
    /// Adds the measurements of a scene.
    void add(SceneMeasurement&& measurement);
};

/// The values that parts must agree on: everything that results depend on, by name.
Json partKey(const Json& provenance, const Experiment& experiment, const Json& inputHashes);

/// Returns the content of part.json in a part's directory: the findings, the hashes of costs.json
/// and of the images in `directory`, and that of all this (partHash).
Json toJson(const CompareFindings& findings, const CompareShare& share, const Json& key,
            const std::string& directory);

/// Returns the hash of a part without its "content_hash", which it must equal.
std::string partHash(Json part);

/// Reads the parts in these directories and joins their findings. The joined results.json is that
/// of one compare, except for times; its provenance is that of the first part, with "parts", the
/// machine of each, beside it. Throws Error kInput naming the directory, for one without a part in
/// it, a damaged part (also one whose costs.json or image is missing or different), one of another
/// compare (naming the difference), a duplicate one, and naming the parts that are missing.
CompareFindings joinParts(const std::vector<std::string>& directories);

} // namespace shadowdag
