// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/fit_search.h"

#include "cuda/macros.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <numeric>

namespace shadowdag {

namespace {

constexpr size_t kNoModel = SIZE_MAX;

} // namespace

FitSearch::FitSearch(const FitSpace& space, const FitSettings& settings)
    : space_(space), settings_(settings), observations_(space.models.size()),
      isObserved_(space.models.size(), 0), costLaws_(space.laws.size()),
      errorLaws_(space.laws.size()) {}

bool FitSearch::isOrderedOnAxes(size_t coarse, size_t fine, Law law) const {
    const FitModel &a = space_.models[coarse], &b = space_.models[fine];
    if (a.group != b.group)
        return false;
    const std::vector<FitLaw>& laws = space_.laws[a.group];
    for (size_t axis = 0; axis < laws.size(); ++axis) {
        const bool isFree = law == Law::kCost ? laws[axis].costGrows : laws[axis].errorFalls;
        if (isFree ? a.at[axis] > b.at[axis] : a.at[axis] != b.at[axis])
            return false;
    }
    return true;
}

bool FitSearch::isOrdered(size_t coarse, size_t fine, Law law) const {
    if (coarse == fine)
        return true;
    const size_t group = space_.models[coarse].group;
    const bool isGivenUp =
        law == Law::kCost ? costLaws_[group].isGivenUp : errorLaws_[group].isGivenUp;
    return !isGivenUp && isOrderedOnAxes(coarse, fine, law);
}

bool FitSearch::holds(size_t model) const {
    return isObserved_[model] && observations_[model].isComplete &&
           observations_[model].error <= settings_.bound;
}

size_t FitSearch::cheapest() const {
    size_t best = kNoModel;
    for (const size_t model : observed_)
        if (holds(model) &&
            (best == kNoModel || observations_[model].cost < observations_[best].cost ||
             (observations_[model].cost == observations_[best].cost &&
              space_.models[model].simplicity < space_.models[best].simplicity)))
            best = model;
    return best;
}

size_t FitSearch::leastError() const {
    SDAG_ASSERT(!observed_.empty());
    return *std::min_element(observed_.begin(), observed_.end(), [&](size_t a, size_t b) {
        return observations_[a].error < observations_[b].error;
    });
}

double FitSearch::limit() const {
    const size_t best = cheapest();
    return best == kNoModel ? std::numeric_limits<double>::infinity() : observations_[best].cost;
}

void FitSearch::record(size_t model, const FitObservation& observation) {
    observations_[model] = observation;
    if (!isObserved_[model]) {
        isObserved_[model] = 1;
        observed_.insert(std::upper_bound(observed_.begin(), observed_.end(), model), model);
    }
    // From all models again: an observation may have replaced another.
    const auto tally = [](FitLawReport& report, double violation, double slack) {
        ++report.pairCount;
        report.worst = std::max(report.worst, violation);
        if (violation > slack) {
            ++report.violationCount;
            report.isGivenUp = true;
        }
    };
    const size_t group = space_.models[model].group;
    // A rejected law stays rejected: the models that it ruled out have been measured since.
    FitLawReport cost, error;
    cost.isGivenUp = costLaws_[group].isGivenUp;
    error.isGivenUp = errorLaws_[group].isGivenUp;
    for (const size_t coarse : observed_)
        for (const size_t fine : observed_) {
            if (coarse == fine || space_.models[coarse].group != group)
                continue;
            const FitObservation &a = observations_[coarse], &b = observations_[fine];
            if (isOrderedOnAxes(coarse, fine, Law::kCost) && a.isComplete == b.isComplete)
                tally(cost, b.cost > 0 ? a.leastCost / b.cost - 1 : 0, settings_.costSlack);
            if (isOrderedOnAxes(coarse, fine, Law::kError))
                tally(error,
                      settings_.bound > 0 ? (b.firstError - a.firstError) / settings_.bound
                      : b.firstError > a.firstError ? std::numeric_limits<double>::infinity()
                                                    : 0,
                      settings_.errorSlack);
        }
    costLaws_[group] = cost;
    errorLaws_[group] = error;
}

std::vector<FitVerdict> FitSearch::verdicts() const {
    using Kind = FitVerdict::Kind;
    const size_t best = cheapest();
    const double limit = this->limit();
    // Equal cost is no reason to keep a model open that could not win the tie.
    const auto isNoLess = [&](double cost, size_t model) {
        return best != kNoModel && model != best &&
               (cost > limit || (cost == limit &&
                                 space_.models[best].simplicity < space_.models[model].simplicity));
    };
    const auto verdict = [&](size_t model) -> FitVerdict {
        if (isObserved_[model] && observations_[model].error > settings_.bound)
            return {Kind::kBreaks};
        if (isObserved_[model] && observations_[model].isComplete)
            return {Kind::kHolds};
        if (isNoLess(space_.models[model].knownCost, model))
            return {Kind::kKnownCost, best};
        if (isObserved_[model] &&
            isNoLess(observations_[model].leastCost / (1 + settings_.ownSlack), model))
            return {Kind::kCostlier, model};
        for (const size_t other : observed_)
            if (other != model && isOrdered(other, model, Law::kCost)) {
                if (holds(other))
                    return {Kind::kDominated, other};
                if (observations_[other].leastCost > limit * (1 + settings_.costSlack))
                    return {Kind::kCostlier, other};
            }
        for (const size_t other : observed_)
            if (other != model && isOrdered(model, other, Law::kError) &&
                observations_[other].error > settings_.bound * (1 + settings_.errorSlack))
                return {Kind::kErrorOfFiner, other};
        return {};
    };
    std::vector<FitVerdict> all;
    for (size_t model = 0; model < space_.models.size(); ++model)
        all.push_back(verdict(model));
    return all;
}

size_t FitSearch::proposal(const std::vector<size_t>& family,
                           const std::vector<FitVerdict>& verdicts,
                           const std::function<bool(size_t)>& waits) const {
    const auto& models = space_.models;
    std::vector<size_t> open;
    bool isKnown = false;
    for (const size_t model : family) {
        if (isObserved_[model])
            isKnown = true;
        else if (verdicts[model].kind == FitVerdict::Kind::kOpen && !waits(model))
            open.push_back(model);
    }
    if (open.empty())
        return kNoModel;
    const auto fineness = [&](size_t model) {
        return std::accumulate(models[model].at.begin(), models[model].at.end(), 0);
    };
    // The coarsest first: if it costs too much, all do; if it keeps the bound, none costs less.
    if (!isKnown)
        return *std::min_element(open.begin(), open.end(),
                                 [&](size_t a, size_t b) { return fineness(a) < fineness(b); });
    // Then the finest: if it breaks the bound, so do all that it rules out.
    for (const size_t model : open)
        if (std::none_of(family.begin(), family.end(),
                         [&](size_t other) {
                             return other != model && isOrdered(model, other, Law::kError);
                         }) &&
            std::any_of(open.begin(), open.end(), [&](size_t other) {
                return other != model && isOrdered(other, model, Law::kError);
            }))
            return model;
    // Then the one that decides most of the others, whatever its result.
    size_t best = open.front(), bestCount = 0;
    for (const size_t model : open) {
        size_t ifHolds = 0, ifBreaks = 0;
        for (const size_t other : open) {
            ifHolds += isOrdered(model, other, Law::kCost) ? 1 : 0;
            ifBreaks += isOrdered(other, model, Law::kError) ? 1 : 0;
        }
        if (std::min(ifHolds, ifBreaks) > bestCount) {
            bestCount = std::min(ifHolds, ifBreaks);
            best = model;
        }
    }
    return best;
}

std::vector<FitRequest> FitSearch::next() const {
    const std::vector<FitVerdict> all = verdicts();
    std::vector<FitRequest> requests;
    size_t group = kNoModel;
    for (size_t model = 0; model < all.size(); ++model)
        if (all[model].kind == FitVerdict::Kind::kOpen)
            group = std::min(group, space_.models[model].group);
    if (group == kNoModel)
        return {};
    // A model that keeps the bound in the first cell may keep it in all. While a cheaper model is
    // open, the models that it would rule out wait; then the cheapest of these are measured in all
    // cells.
    std::vector<size_t> hopeful;
    for (const size_t model : observed_)
        if (all[model].kind == FitVerdict::Kind::kOpen && space_.models[model].group == group)
            hopeful.push_back(model);
    const auto waits = [&](size_t model) {
        return std::any_of(hopeful.begin(), hopeful.end(), [&](size_t other) {
            return other != model && isOrdered(other, model, Law::kCost);
        });
    };
    // A family: models that some law orders, directly or through others between them.
    std::map<std::vector<int>, std::vector<size_t>> families;
    for (size_t model = 0; model < all.size(); ++model) {
        if (space_.models[model].group != group)
            continue;
        std::vector<int> key = space_.models[model].at;
        for (size_t axis = 0; axis < key.size(); ++axis) {
            const FitLaw& law = space_.laws[group][axis];
            if ((law.costGrows && !costLaws_[group].isGivenUp) ||
                (law.errorFalls && !errorLaws_[group].isGivenUp))
                key[axis] = -1;
        }
        families[key].push_back(model);
    }
    for (const auto& [key, family] : families)
        if (const size_t model = proposal(family, all, waits); model != kNoModel)
            requests.push_back({model, false});
    if (requests.empty())
        for (const size_t model : hopeful)
            if (!waits(model))
                requests.push_back({model, true});
    std::sort(requests.begin(), requests.end(),
              [](const FitRequest& a, const FitRequest& b) { return a.model < b.model; });
    SDAG_ASSERT(!requests.empty());
    return requests;
}

std::vector<size_t> FitSearch::neighbours(size_t model) const {
    const FitModel& center = space_.models[model];
    std::vector<size_t> found;
    for (size_t other = 0; other < space_.models.size(); ++other) {
        const FitModel& m = space_.models[other];
        if (m.group != center.group)
            continue;
        int steps = 0;
        for (size_t axis = 0; axis < m.at.size(); ++axis)
            steps += std::abs(m.at[axis] - center.at[axis]);
        if (steps == 1)
            found.push_back(other);
    }
    return found;
}

std::vector<FitRequest> FitSearch::unmeasuredNeighbours(size_t model) const {
    std::vector<FitRequest> requests;
    const std::vector<FitVerdict> all = verdicts();
    const bool isHeld = cheapest() != kNoModel;
    for (const size_t other : neighbours(model)) {
        if (!isHeld) {
            if (!isObserved_[other])
                requests.push_back({other, false});
            continue;
        }
        if (isObserved_[other] && observations_[other].isComplete)
            continue;
        // A model that is measured or known to cost more, or is finer along every axis of the cost
        // law, cannot cost less.
        using Kind = FitVerdict::Kind;
        const FitVerdict& verdict = all[other];
        const bool isCostlier = verdict.kind == Kind::kKnownCost ||
                                (verdict.kind == Kind::kCostlier && verdict.by == other) ||
                                isOrdered(model, other, Law::kCost);
        if (!isCostlier)
            requests.push_back({other, true});
    }
    return requests;
}

std::vector<size_t> FitSearch::finalists() const {
    std::vector<size_t> found;
    const double limit = this->limit();
    for (const size_t model : observed_)
        if (holds(model) && observations_[model].leastCost <= limit * (1 + settings_.ownSlack))
            found.push_back(model);
    return found;
}

FitCandidate chooseLeast(const FitSpace& space, const std::vector<FitCandidate>& candidates) {
    SDAG_ASSERT(!candidates.empty());
    const FitCandidate& cheapest =
        *std::min_element(candidates.begin(), candidates.end(),
                          [](const auto& a, const auto& b) { return a.cost < b.cost; });
    const FitCandidate* chosen = nullptr;
    for (const FitCandidate& candidate : candidates) {
        const double standardError = std::hypot(candidate.standardError, cheapest.standardError);
        if (candidate.cost - cheapest.cost <= standardError &&
            (chosen == nullptr ||
             space.models[candidate.model].simplicity < space.models[chosen->model].simplicity))
            chosen = &candidate;
    }
    return *chosen;
}

} // namespace shadowdag
