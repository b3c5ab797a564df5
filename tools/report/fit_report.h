// SPDX-License-Identifier: Apache-2.0
// What `fit` found, as its result file and for people.
#pragma once

#include "tools/workspace/fit_measure.h"

#include <ostream>
#include <string>

namespace shadowdag {

/// What was asked for and what was found.
struct FitFindings {
    FitMetric metric;
    FitObjective objective;
    double bound;
    FitSettings settings;
    const FitModels& models;
    const FitSearch& search;
    const FitMeasurer& measurer;
    size_t choice; ///< SIZE_MAX where no model holds the bound
};

/// Returns the names that options and results know them by: "false", "visibility", "flip"; "time",
/// "bytes".
std::string metricName(FitMetric metric);
std::string objectiveName(FitObjective objective);

/// Returns the result file's content but for provenance and experiment: every model with what was
/// measured and what became of it, the choice and its neighbours, the laws and how they fared. With
/// FitObjective::kBytes nothing in it depends on time.
Json fitJson(const FitFindings& found);

/// Prints the choice, the cheaper neighbours that break the bound, what was ruled out by what, and
/// how the laws fared. @param result as fitJson returned it
void printFit(std::ostream& out, const Json& result);

} // namespace shadowdag
