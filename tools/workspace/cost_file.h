// SPDX-License-Identifier: Apache-2.0
// Costs as files, for --costs: the costs of every map that `oracle` measured, and calibrations
// fitted by `calibrate`.
#pragma once

#include "hybrid/routing/cost_fit.h"
#include "hybrid/routing/cost_model.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/json.h"
#include "tools/workspace/scene_setup.h"

#include <nlohmann/json.hpp>

#include <compare>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// What costs were measured of.
struct CostKey {
    std::string scene; ///< its name
    uint32_t frame = 0;
    FrameStart start = FrameStart::kCold;

    auto operator<=>(const CostKey&) const = default;
};

/// The costs of a frame, and what they depend on besides the costs' key.
struct TableCosts : FrameCosts {
    TableCosts() = default;
    TableCosts(FrameCosts costs, Json measuredOf = {})
        : FrameCosts(std::move(costs)), of(std::move(measuredOf)) {}

    Json of; ///< costConditions of the measurement; null in older files
};

using CostTable = std::map<CostKey, TableCosts>;

/// Returns what the costs of a frame depend on besides their key: {"scene_hash", "size",
/// "camera_numbers", "time_s", "light_hash" (of the lights at that time), "lights", "light_seed"
/// (of placed lights)}.
Json costConditions(const LoadedScene& scene, const Camera& camera, const Experiment& experiment,
                    float timeSeconds);

/// Returns the name of a route in files: "rays" or "map".
const char* routeName(Route route);
/// Returns FrameCosts::wholeFrameTexels as files have it: the name of one method's route, or a
/// number.
Json wholeFrameJson(float texels);
/// Returns the threshold of such a value. Throws Error kInput naming `where` for another.
float wholeFrameFromJson(const Json& json, const std::string& where);

/// Returns {"costs": [{"scene", "frame", "start" ("cold" or "warm"; absent: cold), "rays_scale",
/// "maps_scale", "degrade_divisor", "whole_frame" (wholeFrameJson; may be absent), "maps":
/// [{"light", "octave", "rays_ms", "map_ms"}], "of" (costConditions; may be absent)}]}.
Json toJson(const CostTable& costs);
/// Returns the same with the measurement's "provenance" and "experiment".
Json toJson(const CostTable& costs, const Json& provenance, const Json& experiment);
/// Reads such a file. Throws Error kInput naming the file and the error in it, such as two entries
/// of one key.
CostTable readCosts(const std::string& path);
/// Returns the costs of a frame. Throws Error kInput naming the file when it does not have them.
const TableCosts& findCosts(const CostTable& costs, const std::string& path, const CostKey& key);
/// Returns what differs from the conditions under which costs were measured: "FILE: its costs of
/// ... were measured with size \"64x36\" instead of ..."; "" if nothing does, as far as the file
/// has them.
/// @param here costConditions of the frame
std::string otherConditions(const TableCosts& costs, const std::string& path, const CostKey& key,
                            const Json& here);
/// Returns the costs of a frame to replay. Throws Error kInput also for otherConditions; if
/// `allowStale`, those are a warning. @param permit what the user does to allow them, for messages
const TableCosts& findCosts(const CostTable& costs, const std::string& path, const CostKey& key,
                            const Json& here, bool allowStale, const Console& console,
                            const char* permit = "pass --allow-stale");
/// Throws Error kInput naming the file when it has no costs of one of the scenes, frames or starts;
/// call it before long work. @param scenes names, with the camera if there are several views
void requireCosts(const CostTable& costs, const std::string& path,
                  const std::vector<std::string>& scenes, const std::vector<uint32_t>& frames,
                  const std::vector<FrameStart>& starts);

/// Returns {"rays": [{"term", "ms"}], "map": [...]}.
Json toJson(const CostCalibration& calibration);
/// Returns the calibration in such an object. Throws Error kInput naming `where` and the error: an
/// unknown term, a coefficient that is not a cost, a sum without terms.
CostCalibration calibrationFromJson(const Json& json, const std::string& where);

/// A file given to --costs: one of both kinds.
struct CostSource {
    std::string path;
    std::optional<CostTable> table;
    std::optional<CostCalibration> calibration;
    /// The name of the machine of the measurement or fit if it is not this one, for messages; empty
    /// if it is the same or the file does not contain it.
    std::string otherMachine;
    /// The settings of a calibration's fit, as an experiment's lists, and "sizes"; null if the file
    /// does not contain them.
    Json fittedWith;
};

/// Returns the differences of a run from the settings of the calibration's fit: picture size,
/// voxels, and every setting of frames that is not of routing; empty if there are none, or if they
/// are unknown. For messages.
std::string otherSettings(const CostSource& source, const RunParameters& run);

/// Throws Error kUsage for a calibration that no run uses for routing. @param runs all
void refuseUnusedOptions(const CostSource& source, const std::vector<RunParameters>& runs);

/// Returns warnings for the user: costs of another machine, costs without the conditions of their
/// measurement, runs with settings that were not fitted.
std::vector<std::string> remarksOn(const CostSource& source,
                                   const std::vector<RunParameters>& runs);

/// Reads a file of either kind, distinguished by its keys "costs" and "calibration". Throws Error
/// kInput as the functions above do.
/// @param provenance of this program (buildProvenance)
CostSource readCostSource(const std::string& path, const Json& provenance);

/// Sets the calibration of the model, if the file contains one for all frames. Throws Error kUsage
/// when the model needs a calibration and there is none.
void giveCalibration(CostModel& model, const CostSource& source);

/// Returns observed frames as JSON, and back; `calibrate` writes and reads them. Throws Error
/// kInput naming `where`.
Json toJson(const std::vector<ObservedFrame>& frames);
std::vector<ObservedFrame> observationsFromJson(const Json& json, const std::string& where);

/// Returns a fit as JSON: the forms that were tried with their held-out regret, compared with other
/// models.
Json toJson(const CostFit& fit);

} // namespace shadowdag
