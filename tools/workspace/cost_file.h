// SPDX-License-Identifier: Apache-2.0
// Costs as files, for --costs: what `oracle` measured of every map, and what `calibrate` fitted.
#pragma once

#include "hybrid/routing/cost_fit.h"
#include "hybrid/routing/cost_model.h"
#include "tools/settings/experiment.h"
#include "tools/settings/json.h"

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Costs by scene name and frame.
using CostTable = std::map<std::pair<std::string, uint32_t>, FrameCosts>;

/// Returns {"costs": [{"scene", "frame", "maps": [{"light", "octave", "rays_ms", "map_ms"}]}]}.
Json toJson(const CostTable& costs);
/// Returns the same with "provenance": the processor, device, backend and number of threads that
/// they were measured on, as provenance has them.
Json toJson(const CostTable& costs, const Json& provenance);
/// Reads such a file. Throws Error kInput naming the file and what is wrong in it.
CostTable readCosts(const std::string& path);
/// Returns the costs of a frame. Throws Error kInput naming the file when it does not have them.
const FrameCosts& findCosts(const CostTable& costs, const std::string& path,
                            const std::string& scene, uint32_t frame);

/// Returns {"rays": [{"term", "ms"}], "map": [...]}.
Json toJson(const CostCalibration& calibration);
/// Returns the calibration that such an object is. Throws Error kInput naming `where` and what is
/// wrong: a term that is not known, a coefficient that is no cost, a sum without terms.
CostCalibration calibrationFromJson(const Json& json, const std::string& where);

/// A file that --costs names: one of both.
struct CostSource {
    std::string path;
    std::optional<CostTable> table;
    std::optional<CostCalibration> calibration;
    /// What the machine that it was measured or fitted on is called and this one is not, for
    /// people; empty where both are alike, or the file does not say.
    std::string otherMachine;
    /// What a calibration was fitted with, as an experiment's lists, and "sizes"; null where the
    /// file does not say.
    Json fittedWith;
};

/// Returns in what a run differs from all that the calibration was fitted with, of what costs
/// depend on: picture size, voxels, level of detail, texel density, maps a light, page size, taps,
/// polygon levels; empty where nothing does, or nothing is known. For people.
std::string otherSettings(const CostSource& source, const RunParameters& run);

/// Throws Error kUsage where a calibration is given and no run routes by one. @param runs all
void refuseUnheeded(const CostSource& source, const std::vector<RunParameters>& runs);

/// Returns remarks for people: costs of another machine, runs with other settings than were fitted.
std::vector<std::string> remarksOn(const CostSource& source,
                                   const std::vector<RunParameters>& runs);

/// Reads a file of either kind, told apart by its keys "costs" and "calibration". Throws Error
/// kInput as the functions above do.
/// @param provenance of this program (buildProvenance)
CostSource readCostSource(const std::string& path, const Json& provenance);

/// Gives the model what it routes by, as far as the file holds it for all frames. Throws Error
/// kUsage when the model needs a calibration and there is none.
void giveCalibration(CostModel& model, const CostSource& source);

/// Returns observed frames as JSON, and back; `calibrate` writes and reads them. Throws Error
/// kInput naming `where`.
Json toJson(const std::vector<ObservedFrame>& frames);
std::vector<ObservedFrame> observationsFromJson(const Json& json, const std::string& where);

/// Returns a fit as JSON: what was tried and how it fared held out, beside other models.
Json toJson(const CostFit& fit);

} // namespace shadowdag
