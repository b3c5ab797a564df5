// SPDX-License-Identifier: Apache-2.0
// A compare in parts: `--part k/n` measures a share, `--join` makes the report of all of them.
//
// What is shared out are frames, each with all its configurations: their times can be compared only
// when one process measured them in turn, and they share the truth and the maps' isolated costs.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/measure.h"

#include <string>
#include <vector>

namespace shadowdag {

/// More parts than this are more than frames.
constexpr uint32_t kMaxPartCount = 65536;

/// Which frames of a compare a part measures: neighbours, scene by scene, so that as few scenes as
/// possible are loaded twice.
struct CompareShare {
    uint32_t part = 1, partCount = 1; ///< 1 <= part <= partCount <= kMaxPartCount

    /// Returns the frames of the scene-th scene that this part measures, ascending as in
    /// `experiment`.
    std::vector<uint32_t> frames(const Experiment& experiment, size_t scene) const;
};

/// What a compare measured, scenes and frames in order.
struct CompareFindings {
    Json results; ///< as results.json holds them
    Json lights = Json::array();
    CostTable costs;

    /// Nothing yet.
    CompareFindings(const Json& provenance, const Json& experiment);
    /// Adds the measurements of a scene.
    void add(SceneMeasurement&& measurement);
};

/// What parts must agree on: everything that answers depend on, by name.
Json partKey(const Json& provenance, const Experiment& experiment, const Json& inputHashes);

/// Returns what a part's directory keeps in part.json: the findings, the hashes of costs.json and
/// of the images that stand beside it in `directory`, and that of all this (partHash).
Json toJson(const CompareFindings& findings, const CompareShare& share, const Json& key,
            const std::string& directory);

/// Returns the hash of a part without its "content_hash", which it must equal.
std::string partHash(Json part);

/// Reads the parts in these directories and joins what they found. Their results.json is that of
/// one compare, but for times; its provenance is that of the first part, with "parts", the machine
/// of each, beside it. Throws Error kInput naming the directory, for one without a part in it, a
/// damaged part (also one whose costs.json or image is gone or another), one of another compare
/// (naming what differs), one that is there twice, and naming the parts that are missing.
CompareFindings joinParts(const std::vector<std::string>& directories);

} // namespace shadowdag
