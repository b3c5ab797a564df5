// SPDX-License-Identifier: Apache-2.0
#include "hybrid/cost_fit.h"

#include "cuda/error.h"
#include "hybrid/cost_solve.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace shadowdag {

namespace {

constexpr size_t kMaxTerms = 6; ///< a sum; what fits thousands of maps needs no more
static_assert(kMaxTerms <= kMaxUnknowns);

/// Returns one sum of a form, fitted.
std::vector<CostSummand> fitSum(const ObservedFrames& frames, const std::vector<CostSummand>& form,
                                double MapCost::*cost) {
    std::vector<std::vector<double>> rows;
    std::vector<double> values;
    for (const ObservedFrame* frame : frames)
        for (size_t m = 0; m < frame->maps.size(); ++m) {
            const MapCost& measured = frame->costs[m];
            const double both = measured.raysMs + measured.mapMs;
            if (!(both > 0))
                continue;
            const double weight = 1 / std::sqrt(both);
            std::vector<double> row;
            for (const CostSummand& summand : form)
                row.push_back(weight * summand.term->of(frame->maps[m]));
            rows.push_back(std::move(row));
            values.push_back(weight * (measured.*cost));
        }
    const std::vector<double> fitted = solveNonNegative(rows, values);
    std::vector<CostSummand> sum = form;
    for (size_t i = 0; i < fitted.size(); ++i)
        sum[i].ms = fitted[i];
    return sum;
}

ObservedFrames pointersTo(const std::vector<ObservedFrame>& frames) {
    ObservedFrames pointers;
    for (const ObservedFrame& frame : frames)
        if (!frame.maps.empty())
            pointers.push_back(&frame);
    return pointers;
}

std::vector<double> regretsOf(const ObservedFrames& frames, const CostModel& model) {
    std::vector<double> regrets;
    for (const ObservedFrame* frame : frames)
        regrets.push_back(
            routingRegret(*frame, model.route(frame->maps), model.needsGeometryCounts()));
    return regrets;
}

std::vector<double> differences(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> result;
    for (size_t i = 0; i < a.size(); ++i)
        result.push_back(a[i] - b[i]);
    return result;
}

std::unique_ptr<CostModel> thresholdModel(double texels) {
    if (std::isinf(texels))
        return makeCostModel("texels:inf");
    char text[64];
    std::snprintf(text, sizeof text, "texels:%.17g", texels);
    return makeCostModel(text);
}

/// Forms and how they fare.
class FormSearch {
public:
    explicit FormSearch(const ObservedFrames& frames, HeldOut judgedBy)
        : frames_(frames), judgedBy_(judgedBy) {}

    std::vector<double> regret(const CostCalibration& form, HeldOut heldOut) const {
        return heldOutRegret(frames_, heldOut, [&](const ObservedFrames& fitted) {
            return makeCostModelOf(fitForm(fitted, form));
        });
    }

    /// Returns the trials of the search, the last kept one being its result.
    std::vector<FitTrial> search() const {
        const CostSummand constant{findCostTerm("maps"), 0};
        CostCalibration kept{{constant}, {constant}};
        std::vector<FitTrial> trials{trial(kept)};
        trials.back().isKept = true;
        std::vector<double> regrets = regret(kept, judgedBy_);
        while (true) {
            // One term first; only when none helps by itself, one to either sum at once.
            bool isAdded = false;
            for (const bool both : {false, true}) {
                FitTrial best;
                std::vector<double> bestRegrets;
                for (const CostCalibration& form : additions(kept, both)) {
                    std::vector<double> candidate = regret(form, judgedBy_);
                    if (!bestRegrets.empty() &&
                        !(meanRegret(candidate).mean < meanRegret(bestRegrets).mean))
                        continue;
                    bestRegrets = std::move(candidate);
                    best.form = form;
                }
                if (bestRegrets.empty())
                    continue;
                best = trial(best.form);
                best.gain = meanRegret(differences(regrets, bestRegrets));
                best.isKept = best.gain.mean > best.gain.standardError;
                trials.push_back(best);
                if (best.isKept) {
                    kept = best.form;
                    regrets = std::move(bestRegrets);
                    isAdded = true;
                    break;
                }
            }
            if (!isAdded)
                return trials;
        }
    }

private:
    FitTrial trial(const CostCalibration& form) const {
        FitTrial trial;
        trial.form = form;
        trial.byScene = meanRegret(regret(form, HeldOut::kScenes));
        trial.byFrame = meanRegret(regret(form, HeldOut::kFrames));
        return trial;
    }

    static std::vector<std::vector<CostSummand>> longer(const std::vector<CostSummand>& sum) {
        std::vector<std::vector<CostSummand>> all;
        if (sum.size() == kMaxTerms)
            return all;
        for (const CostTerm& term : costTerms()) {
            if (std::any_of(sum.begin(), sum.end(),
                            [&](const CostSummand& s) { return s.term == &term; }))
                continue;
            all.push_back(sum);
            all.back().push_back({&term, 0});
        }
        return all;
    }

    static std::vector<CostCalibration> additions(const CostCalibration& form, bool both) {
        std::vector<CostCalibration> all;
        const auto rays = longer(form.rays), map = longer(form.map);
        if (!both) {
            for (const auto& sum : rays)
                all.push_back({sum, form.map});
            for (const auto& sum : map)
                all.push_back({form.rays, sum});
            return all;
        }
        for (const auto& r : rays)
            for (const auto& m : map)
                all.push_back({r, m});
        return all;
    }

    const ObservedFrames& frames_;
    HeldOut judgedBy_;
};

} // namespace

double routingRegret(const ObservedFrame& frame, const std::vector<Route>& routes,
                     bool paysForGeometry) {
    double least = 0, lost = paysForGeometry ? frame.geometryMs : 0;
    for (size_t m = 0; m < frame.costs.size(); ++m) {
        const MapCost& cost = frame.costs[m];
        const double cheaper = std::min(cost.raysMs, cost.mapMs);
        least += cheaper;
        lost += (routes[m] == Route::kRays ? cost.raysMs : cost.mapMs) - cheaper;
    }
    return least > 0 ? lost / least : 0;
}

Regret meanRegret(const std::vector<double>& ofFrames) {
    const double count = double(ofFrames.size());
    Regret regret;
    for (const double r : ofFrames)
        regret.mean += r / count;
    double squares = 0;
    for (const double r : ofFrames)
        squares += (r - regret.mean) * (r - regret.mean);
    if (count > 1)
        regret.standardError = std::sqrt(squares / (count - 1) / count);
    return regret;
}

CostCalibration fitForm(const ObservedFrames& frames, const CostCalibration& form) {
    return {fitSum(frames, form.rays, &MapCost::raysMs), fitSum(frames, form.map, &MapCost::mapMs)};
}

double bestThreshold(const ObservedFrames& frames) {
    // A map moves from the map's to the rays' side as the threshold passes what it requires: its
    // frame's regret changes by what that costs.
    struct Change {
        double texels, by;
    };
    std::vector<Change> changes;
    for (const ObservedFrame* frame : frames) {
        double least = 0;
        for (const MapCost& cost : frame->costs)
            least += std::min(cost.raysMs, cost.mapMs);
        if (!(least > 0))
            continue;
        for (size_t m = 0; m < frame->costs.size(); ++m)
            changes.push_back(
                {frame->maps[m].texels, (frame->costs[m].raysMs - frame->costs[m].mapMs) / least});
    }
    std::sort(changes.begin(), changes.end(),
              [](const Change& a, const Change& b) { return a.texels < b.texels; });
    double best = 0, least = 0, sum = 0;
    for (size_t i = 0; i < changes.size(); ++i) {
        sum += changes[i].by;
        // All maps up to here are traced: thresholds up to the next requirement do that.
        const bool isLast = i + 1 == changes.size();
        if (!isLast && changes[i + 1].texels == changes[i].texels)
            continue;
        if (sum < least) {
            least = sum;
            best = isLast ? std::numeric_limits<double>::infinity() : changes[i + 1].texels;
        }
    }
    return best;
}

std::vector<double>
heldOutRegret(const ObservedFrames& frames, HeldOut heldOut,
              const std::function<std::unique_ptr<CostModel>(const ObservedFrames&)>& fit) {
    std::vector<double> regrets(frames.size(), 0.0);
    std::vector<bool> isDone(frames.size(), false);
    for (size_t i = 0; i < frames.size(); ++i) {
        if (isDone[i])
            continue;
        ObservedFrames fitted;
        std::vector<size_t> held;
        for (size_t k = 0; k < frames.size(); ++k) {
            // One frame in several views is one frame: what it shows is the same.
            const bool isHeld =
                frames[k]->scene == frames[i]->scene &&
                (heldOut == HeldOut::kScenes || frames[k]->frame == frames[i]->frame);
            if (isHeld)
                held.push_back(k);
            else
                fitted.push_back(frames[k]);
        }
        const std::unique_ptr<CostModel> model = fit(fitted.empty() ? frames : fitted);
        for (const size_t k : held) {
            regrets[k] = routingRegret(*frames[k], model->route(frames[k]->maps),
                                       model->needsGeometryCounts());
            isDone[k] = true;
        }
    }
    return regrets;
}

CostFit fitCosts(const std::vector<ObservedFrame>& frames) {
    const ObservedFrames observed = pointersTo(frames);
    if (observed.empty())
        throw Error(ErrorKind::kUsage, "costs cannot be fitted: no frame measured has a map; "
                                       "choose scenes and cameras that see lit surfaces");
    CostFit fit;
    fit.judgedBy = std::all_of(observed.begin(), observed.end(),
                               [&](const auto* f) { return f->scene == observed[0]->scene; })
                       ? HeldOut::kFrames
                       : HeldOut::kScenes;
    fit.trials = FormSearch(observed, fit.judgedBy).search();
    for (const FitTrial& trial : fit.trials)
        if (trial.isKept) {
            fit.calibration = fitForm(observed, trial.form);
            fit.byScene = trial.byScene;
            fit.byFrame = trial.byFrame;
        }
    fit.rays = meanRegret(regretsOf(observed, *makeCostModel("texels:inf")));
    fit.maps = meanRegret(regretsOf(observed, *makeCostModel("texels:0")));
    fit.texels96 = meanRegret(regretsOf(observed, *makeCostModel("texels:96")));
    const auto threshold = [](const ObservedFrames& fitted) {
        return thresholdModel(bestThreshold(fitted));
    };
    fit.thresholdByScene = meanRegret(heldOutRegret(observed, HeldOut::kScenes, threshold));
    fit.thresholdByFrame = meanRegret(heldOutRegret(observed, HeldOut::kFrames, threshold));
    fit.threshold = bestThreshold(observed);
    return fit;
}

std::string formText(const std::vector<CostSummand>& sum) {
    std::string text;
    for (const CostSummand& summand : sum) {
        if (!text.empty())
            text += " + ";
        if (summand.ms > 0) {
            char number[32];
            std::snprintf(number, sizeof number, "%.4g x ", summand.ms);
            text += number;
        }
        text += summand.term->name;
    }
    return text;
}

} // namespace shadowdag
