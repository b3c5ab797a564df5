// SPDX-License-Identifier: Apache-2.0
// The search for the cheapest model that keeps an error bound: which models to measure next, and
// which are ruled out without measurement, by which rule. Works on numbers only, without scenes or
// renderers (fit_measure.h).
//
// A model is a point of a grid: on every axis that its method reads, the rank of a value, 0 the
// coarsest. The rules that exclude a model without measuring it:
//
//   known cost       the model costs at least what is known beforehand (its voxels' bytes), and
//   that
//                    is more than the least model found. Proven.
//   costlier         the model itself, or one that is coarser along axes of the cost law, was
//                    measured and costs more than the least model found.
//   error of finer   one that is finer along axes of the error law was measured and breaks the
//                    bound.
//   dominated        one that is coarser along axes of the cost law holds the bound.
//
// The last three assume laws: along these axes a finer model costs no less, or has no larger error.
// Every two measured models that a law orders are compared; after one violation beyond the slack
// the law is rejected for all models of that method, and the models that only it ruled out are open
// again. So a choice is the cheapest up to the slack, unless all violations of a law are among
// models that were never measured; the choice's neighbours are measured to look for one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace shadowdag {

/// The assumptions about the models of a method along one axis, from coarse to fine.
struct FitLaw {
    bool costGrows = false;  ///< finer costs no less
    bool errorFalls = false; ///< finer has no larger error
};

/// One model: all of its data that the search uses.
struct FitModel {
    size_t group = 0;            ///< its method, index into FitSpace::laws
    std::vector<int> at;         ///< by axis: the rank of its value, 0 the coarsest; -1: not read
    std::vector<int> simplicity; ///< lexicographically less is simpler; no two models are equal
    double knownCost = 0;        ///< lower bound of its cost, proven before any measurement
};

/// All models. Methods are searched in the order of their groups, so that early results rule out
/// later models.
struct FitSpace {
    std::vector<FitModel> models;
    std::vector<std::vector<FitLaw>> laws; ///< by group, then axis
};

/// The measurements of a model, in the first cell (a scene's frame) or in all of them.
struct FitObservation {
    double error = 0;        ///< the worst of the cells
    double firstError = 0;   ///< in the first cell
    double cost = 0;         ///< cost: bytes, ms
    double leastCost = 0;    ///< lower bound of the cost, considering noise; at most `cost`
    bool isComplete = false; ///< all cells were measured
};

/// When the search treats a value as larger.
struct FitSettings {
    double bound = 0;      ///< a model keeps it when its error is at most this
    double errorSlack = 0; ///< of the error law, in units of the bound
    double costSlack = 0;  ///< of the cost law, as a share of the cost
    double ownSlack = 0;   ///< of a model's own cost in the first cell: 0 where costs are exact
};

/// The status of a model.
struct FitVerdict {
    enum class Kind : uint8_t {
        kOpen,
        kHolds,
        kBreaks,
        kKnownCost,
        kCostlier,
        kErrorOfFiner,
        kDominated
    };
    Kind kind = Kind::kOpen;
    size_t by = SIZE_MAX; ///< the model that ruled it out; SIZE_MAX: measured, or open
};

/// A model to measure: in the first cell, or in all.
struct FitRequest {
    size_t model;
    bool inAllCells;
    bool operator==(const FitRequest&) const = default;
};

/// The result of a law among the models measured.
struct FitLawReport {
    uint64_t pairCount = 0;      ///< measured models that it orders
    uint64_t violationCount = 0; ///< of these, beyond the slack
    double worst = 0; ///< largest violation: error in units of the bound, cost as a share; 0: none
    bool isGivenUp = false;
};

class FitSearch {
public:
    FitSearch(const FitSpace& space, const FitSettings& settings);

    /// Returns the models to measure next, in order; none once every model is measured or ruled
    /// out. Deterministic: depends on the recorded values, not on their order.
    std::vector<FitRequest> next() const;
    /// Records the measurements of a model, replacing earlier ones.
    void record(size_t model, const FitObservation& observation);
    /// Returns the models beside one that differ on one axis by one step and might cost less, but
    /// were not measured in all cells: they must be measured before it is accepted as the cheapest.
    /// If no model keeps the bound: those that were not measured at all, to be measured in the
    /// first cell before that is concluded for the others.
    std::vector<FitRequest> unmeasuredNeighbours(size_t model) const;
    /// Returns the models that differ from one on one axis by one step.
    std::vector<size_t> neighbours(size_t model) const;

    /// Returns the status of every model.
    std::vector<FitVerdict> verdicts() const;
    /// Returns the models that keep the bound in all cells and may be the cheapest, considering
    /// noise.
    std::vector<size_t> finalists() const;
    /// Returns the cost of the cheapest model that keeps the bound in all cells; infinity if there
    /// is none.
    double limit() const;
    /// Returns the measured model with the least error, of equal ones the first; there is at least
    /// one.
    size_t leastError() const;
    const FitObservation* observation(size_t model) const {
        return isObserved_[model] ? &observations_[model] : nullptr;
    }
    const FitLawReport& costLaw(size_t group) const { return costLaws_[group]; }
    const FitLawReport& errorLaw(size_t group) const { return errorLaws_[group]; }

private:
    enum class Law : uint8_t { kCost, kError };
    /// Returns whether a law that is not rejected orders `fine` as no coarser than `coarse`; a
    /// model is no coarser than itself.
    bool isOrdered(size_t coarse, size_t fine, Law law) const;
    bool isOrderedOnAxes(size_t coarse, size_t fine, Law law) const;
    bool holds(size_t model) const;
    size_t cheapest() const;
    size_t proposal(const std::vector<size_t>& family, const std::vector<FitVerdict>& verdicts,
                    const std::function<bool(size_t)>& waits) const;

    const FitSpace& space_;
    FitSettings settings_;
    std::vector<FitObservation> observations_;
    std::vector<char> isObserved_;
    std::vector<size_t> observed_;                   ///< ascending
    std::vector<FitLawReport> costLaws_, errorLaws_; ///< by group
};

/// A model that keeps the bound, with its cost measured for the choice.
struct FitCandidate {
    size_t model;
    double cost;
    double standardError; ///< of the cost; 0 where costs are exact
};

/// Returns the cheapest of the candidates: of those that cost more than the cheapest by no more
/// than one standard error of the difference, the simplest. There is at least one.
FitCandidate chooseLeast(const FitSpace& space, const std::vector<FitCandidate>& candidates);

} // namespace shadowdag
