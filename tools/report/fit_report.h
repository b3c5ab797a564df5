// SPDX-License-Identifier: Apache-2.0
// The results of `fit`, as a file and as text.
#pragma once

#include "tools/workspace/fit_measure.h"

#include <ostream>
#include <string>

namespace shadowdag {

/// The request and its results.
struct FitFindings {
    FitMetric metric;
    FitObjective objective;
    double bound;
    FitSettings settings;
    const FitModels& models;
    const FitSearch& search;
    const FitMeasurer& measurer;
    size_t choice; ///< SIZE_MAX if no model keeps the bound
};

/// Return the names in options and results: "false", "visibility", "flip"; "time", "bytes".
std::string metricName(FitMetric metric);
std::string objectiveName(FitObjective objective);

/// Returns the result file's content except provenance and experiment: every model with its
/// measurements and status, the choice and its neighbours, the laws and their violations. With
/// FitObjective::kBytes nothing in it depends on time except the time of the choice.
Json fitJson(const FitFindings& found);

/// Prints the choice, the cheaper neighbours that break the bound, the number of models excluded by
/// each rule, and the laws' violations. @param result as fitJson returned it
void printFit(std::ostream& out, const Json& result);

} // namespace shadowdag
