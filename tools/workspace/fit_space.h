// SPDX-License-Identifier: Apache-2.0
// The models that `fit` searches: every method with every value of the parameters that it reads,
// the laws that the search assumes of them, and which of two is simpler.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/fit_search.h"

#include <string>
#include <vector>

namespace shadowdag {

/// What the least model is least in.
enum class FitObjective : uint8_t { kTime, kBytes };

/// All models with what it takes to run them; one entry a model in each list.
struct FitModels {
    FitSpace space;
    std::vector<Experiment> experiments; ///< that compare replays: this model alone
    std::vector<RunParameters> runs;     ///< `dag` counts the resolutions of the sweep, ascending
    std::vector<std::string> groups;     ///< by FitModel::group: "dag", "maps", "hybrid cost", ...
};

/// Returns the models of a sweep: its methods but embree, by its lists of resolutions, levels of
/// detail, undersampling, taps, maps a light, page sizes and, for hybrid, thresholds (but 0 and
/// infinity, which are maps and dag) and models. A method is not varied in what it does not read.
/// Of bias and offset the first value is used.
/// @param sweep resolutions ascending
FitModels makeFitModels(const Experiment& sweep, FitObjective objective);

/// Sets what every model costs at least in bytes: its voxels.
/// @param dagBytes by resolution of the sweep
void setKnownBytes(FitModels& models, const std::vector<uint64_t>& dagBytes);

/// Returns the names of the axes of FitModel::at.
const std::vector<std::string>& fitAxes();
/// Returns by what a model is simpler than another, the first that differs deciding: for people.
std::vector<std::string> simplicityOrder();

} // namespace shadowdag
