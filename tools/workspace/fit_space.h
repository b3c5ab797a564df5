// SPDX-License-Identifier: Apache-2.0
// The models that `fit` searches: every method with every value of the parameters that it reads,
// the laws that the search assumes, and the order of simplicity.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/fit_search.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The quantity to minimise.
enum class FitObjective : uint8_t { kTime, kBytes };

/// All models with the data to run them; one entry per model in each list.
struct FitModels {
    FitSpace space;
    std::vector<Experiment> experiments; ///< that compare replays: this model alone
    std::vector<RunParameters> runs;     ///< `dag` counts the resolutions of the sweep, ascending
    std::vector<std::string> groups;     ///< by FitModel::group: "dag", "maps", "hybrid cost", ...
};

/// Returns the models of a sweep: its methods except embree, by its lists of resolutions, levels of
/// detail, undersampling, taps, maps per light, page sizes and, for hybrid, thresholds (except 0
/// and infinity, which are maps and dag) and models. A parameter that a method does not read is not
/// varied. Of bias and offset the first value is used.
/// @param sweep resolutions ascending
FitModels makeFitModels(const Experiment& sweep, FitObjective objective);

/// Sets the lower bound of every model's bytes: its voxels.
/// @param dagBytes by resolution of the sweep
void setKnownBytes(FitModels& models, const std::vector<uint64_t>& dagBytes);

/// Returns the names of the axes of FitModel::at.
const std::vector<std::string>& fitAxes();
/// Returns the criteria of simplicity, the first that differs deciding, as text.
std::vector<std::string> simplicityOrder();

} // namespace shadowdag
