// SPDX-License-Identifier: Apache-2.0
// The prediction of a shadow map's cost: terms, and sums of them. Every term is one or a product of
// a map's quantities, so that a prediction is the same on every machine that has the same
// calibration.
#pragma once

#include "hybrid/routing/cost_model.h"

#include <span>
#include <string>
#include <vector>

namespace shadowdag {

/// A quantity that a cost may grow with.
struct CostTerm {
    const char* name;    ///< its name in calibration files
    const char* meaning; ///< for reports
    double (*of)(const MapQuantities&);
    uint32_t counts;        ///< its Counts
    bool isOfRays, isOfMap; ///< the costs it may explain: rays do not use pages, maps do not test
                            ///< moving objects
};

/// Returns all terms, in the order in which a fit tries them: simpler ones first. "maps" is 1.
std::span<const CostTerm> costTerms();

/// Returns the term of a name, null when there is none.
const CostTerm* findCostTerm(const std::string& name);

/// One summand of a cost: the time per unit of the term.
struct CostSummand {
    const CostTerm* term = nullptr; ///< of costTerms()
    double ms = 0;                  ///< >= 0
};

/// The cost of a map by either method: sums.
struct CostCalibration {
    std::vector<CostSummand> rays, map;

    /// Returns the Counts that the summands read.
    uint32_t counts() const;
};

/// Returns the sum's value for a map, milliseconds. Summands are added in order.
double predictMs(const std::vector<CostSummand>& sum, const MapQuantities& map);

/// Returns the model that routes by predicted costs: a map is traced when its rays are predicted to
/// take less time than the map. Throws Error kUsage when a sum is empty or a coefficient is not a
/// finite number >= 0.
std::unique_ptr<CostModel> makeCostModelOf(const CostCalibration& calibration);

/// Returns the same without a calibration: model `cost`, which takes no argument.
std::unique_ptr<CostModel> makeCalibratedModel(const std::string& argument);

} // namespace shadowdag
