// SPDX-License-Identifier: Apache-2.0
#include "hybrid/routing/cost_fit.h"

#include "cuda/error.h"
#include "cuda/macros.h"
#include "hybrid/routing/cost_solve.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

namespace shadowdag {

namespace {

constexpr size_t kMaxTerms = 3; ///< per sum: all choices of as many are tried
/// The least gain by routing, as a share of a scene's time, at which a scene can judge a fit: less
/// is noise.
constexpr double kContestedGain = 0.02;
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
        regrets.push_back(routingRegret(*frame, model.route(frame->maps), model.counts()));
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

/// Removes the summands that add nothing from a sum, but keeps at least one.
void dropNothing(std::vector<CostSummand>& sum) {
    if (std::any_of(sum.begin(), sum.end(), [](const CostSummand& s) { return s.ms > 0; }))
        std::erase_if(sum, [](const CostSummand& s) { return !(s.ms > 0); });
}

/// Returns the first form, a constant for either method.
CostCalibration constantForm() {
    const CostSummand constant{findCostTerm("maps"), 0};
    return {{constant}, {constant}};
}

/// Returns the frames, by index, of every group that is held out together. One frame in several
/// views is one frame: it shows the same.
std::vector<std::vector<size_t>> groupsOf(const ObservedFrames& frames, HeldOut heldOut) {
    std::vector<std::vector<size_t>> groups;
    for (size_t k = 0; k < frames.size(); ++k) {
        const auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& held) {
            const ObservedFrame& first = *frames[held.front()];
            return first.scene == frames[k]->scene &&
                   (heldOut == HeldOut::kScenes || first.frame == frames[k]->frame);
        });
        if (group == groups.end())
            groups.push_back({k});
        else
            group->push_back(k);
    }
    return groups;
}

/// Calls visit(held, fitted) for every group: its frames by index, and the frames of all others.
template <class Visit>
void forGroups(const ObservedFrames& frames, HeldOut heldOut, const Visit& visit) {
    for (const std::vector<size_t>& held : groupsOf(frames, heldOut)) {
        ObservedFrames fitted;
        for (size_t k = 0; k < frames.size(); ++k)
            if (!std::binary_search(held.begin(), held.end(), k))
                fitted.push_back(frames[k]);
        visit(held, fitted);
    }
}

/// Returns every choice of 1..kMaxTerms terms that may enter a sum, fewer first.
std::vector<std::vector<CostSummand>> choicesOf(bool CostTerm::*isOf) {
    std::vector<std::vector<CostSummand>> choices{{}};
    for (size_t first = 0, size = 1; size <= kMaxTerms; ++size) {
        const size_t end = choices.size();
        for (; first < end; ++first) {
            const std::vector<CostSummand> shorter = choices[first]; // the number of choices grows
            for (const CostTerm& term : costTerms()) {
                if (!(term.*isOf) || (!shorter.empty() && &term <= shorter.back().term))
                    continue;
                choices.push_back(shorter);
                choices.back().push_back({&term, 0});
            }
        }
    }
    choices.erase(choices.begin());
    return choices;
}

/// Returns the mean over the groups that are held out together, each by its own mean: views of one
/// frame, or frames of one scene, are not independent samples.
Regret meanOfGroups(const std::vector<std::vector<size_t>>& groups,
                    const std::vector<double>& ofFrames) {
    std::vector<double> means;
    for (const std::vector<size_t>& held : groups) {
        double sum = 0;
        for (const size_t k : held)
            sum += ofFrames[k];
        means.push_back(sum / double(held.size()));
    }
    return meanRegret(means);
}

Regret meanOfGroups(const ObservedFrames& frames, HeldOut heldOut,
                    const std::vector<double>& ofFrames) {
    return meanOfGroups(groupsOf(frames, heldOut), ofFrames);
}

/// A choice of terms for one sum, and its prediction for every map while the map is held out.
struct HeldOutSum {
    std::vector<CostSummand> form;
    std::vector<uint32_t> counts;               ///< by frame: the input of the fitted sum
    std::vector<std::vector<double>> predicted; ///< by frame, ms per map

    HeldOutSum(const ObservedFrames& frames, HeldOut heldOut, std::vector<CostSummand> terms,
               double MapCost::*cost)
        : form(std::move(terms)), counts(frames.size()), predicted(frames.size()) {
        forGroups(frames, heldOut,
                  [&](const std::vector<size_t>& held, const ObservedFrames& fitted) {
                      const std::vector<CostSummand> sum = fitSum(fitted, form, cost);
                      for (const size_t k : held) {
                          counts[k] = CostCalibration{sum, {}}.counts();
                          for (const MapQuantities& map : frames[k]->maps)
                              predicted[k].push_back(predictMs(sum, map));
                      }
                  });
    }
};

/// Forms and their regrets.
class FormSearch {
public:
    FormSearch(const ObservedFrames& frames, HeldOut judgedBy)
        : frames_(frames), judgedBy_(judgedBy), groups_(groupsOf(frames, judgedBy)) {}

    /// Returns the trials of the search, the last kept one being its result.
    std::vector<FitTrial> search() const {
        const auto sumsOf = [&](bool CostTerm::*isOf, double MapCost::*cost) {
            std::vector<HeldOutSum> sums;
            for (std::vector<CostSummand>& form : choicesOf(isOf))
                sums.emplace_back(frames_, judgedBy_, std::move(form), cost);
            return sums;
        };
        const std::vector<HeldOutSum> rays = sumsOf(&CostTerm::isOfRays, &MapCost::raysMs),
                                      map = sumsOf(&CostTerm::isOfMap, &MapCost::mapMs);
        std::vector<FitTrial> trials{trial(constantForm())};
        trials.back().isKept = true;
        std::vector<double> kept = regretOf(trials.back().form, judgedBy_);
        for (size_t size = 2; size <= 2 * kMaxTerms; ++size) {
            const HeldOutSum *bestRays = nullptr, *bestMap = nullptr;
            std::vector<double> best;
            double least = std::numeric_limits<double>::infinity();
            for (const HeldOutSum& r : rays)
                for (const HeldOutSum& m : map) {
                    if (r.form.size() + m.form.size() != size)
                        continue;
                    std::vector<double> regrets = regretOf(r, m);
                    const double lost = mean(regrets).mean;
                    if (!(lost < least))
                        continue; // the first of equals: earlier terms are simpler
                    least = lost;
                    best = std::move(regrets);
                    bestRays = &r;
                    bestMap = &m;
                }
            trials.push_back(trial({bestRays->form, bestMap->form}));
            trials.back().gain = mean(differences(kept, best));
            trials.back().isKept = trials.back().gain.mean > trials.back().gain.standardError;
            if (trials.back().isKept)
                kept = std::move(best);
        }
        return trials;
    }

private:
    Regret mean(const std::vector<double>& ofFrames) const {
        return meanOfGroups(groups_, ofFrames);
    }

    std::vector<double> regretOf(const HeldOutSum& rays, const HeldOutSum& map) const {
        std::vector<double> regrets;
        std::vector<Route> routes;
        for (size_t k = 0; k < frames_.size(); ++k) {
            routes.clear();
            for (size_t m = 0; m < frames_[k]->maps.size(); ++m)
                routes.push_back(
                    routeOfRatio(costRatio(rays.predicted[k][m], map.predicted[k][m])));
            regrets.push_back(routingRegret(*frames_[k], routes, rays.counts[k] | map.counts[k]));
        }
        return regrets;
    }

    std::vector<double> regretOf(const CostCalibration& form, HeldOut heldOut) const {
        return heldOutRegret(frames_, heldOut, [&](const ObservedFrames& fitted) {
            return makeCostModelOf(fitForm(fitted, form));
        });
    }

    FitTrial trial(const CostCalibration& form) const {
        FitTrial trial;
        trial.form = form;
        if (canHoldOut(frames_, HeldOut::kScenes))
            trial.byScene =
                meanOfGroups(frames_, HeldOut::kScenes, regretOf(form, HeldOut::kScenes));
        if (canHoldOut(frames_, HeldOut::kFrames))
            trial.byFrame =
                meanOfGroups(frames_, HeldOut::kFrames, regretOf(form, HeldOut::kFrames));
        return trial;
    }

    const ObservedFrames& frames_;
    HeldOut judgedBy_;
    std::vector<std::vector<size_t>> groups_; ///< with the groups of judgedBy_ held out
};

/// Returns the groups that can judge a fit. A scene that one method serves best has no information
/// about the border; if only one other scene is left, holding that one out leaves nothing to learn
/// from.
std::optional<HeldOut> judgeOf(const ObservedFrames& frames) {
    struct Sums {
        double rays = 0, maps = 0, cheaper = 0;
    };
    std::map<std::string, Sums> scenes;
    for (const ObservedFrame* frame : frames)
        for (const MapCost& cost : frame->costs) {
            Sums& sums = scenes[frame->scene];
            sums.rays += cost.raysMs;
            sums.maps += cost.mapMs;
            sums.cheaper += std::min(cost.raysMs, cost.mapMs);
        }
    const auto contestedCount = std::count_if(scenes.begin(), scenes.end(), [](const auto& scene) {
        const Sums& sums = scene.second;
        return std::min(sums.rays, sums.maps) > (1 + kContestedGain) * sums.cheaper;
    });
    if (contestedCount >= 2)
        return HeldOut::kScenes;
    if (canHoldOut(frames, HeldOut::kFrames))
        return HeldOut::kFrames;
    return std::nullopt;
}

} // namespace

double routingRegret(const ObservedFrame& frame, const std::vector<Route>& routes,
                     uint32_t counts) {
    double least = 0, lost = 0;
    for (size_t k = 0; k < kCountNameCount; ++k)
        lost += counts >> k & 1u ? frame.countMs[k] : 0;
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
    // As the threshold passes a map's requirement, the map moves to the rays' side, and its frame's
    // regret changes by the difference.
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
        // All maps up to here are traced: any threshold up to the next requirement does that.
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

bool canHoldOut(const ObservedFrames& frames, HeldOut heldOut) {
    return std::any_of(frames.begin(), frames.end(), [&](const ObservedFrame* frame) {
        return frame->scene != frames.front()->scene ||
               (heldOut == HeldOut::kFrames && frame->frame != frames.front()->frame);
    });
}

std::vector<double>
heldOutRegret(const ObservedFrames& frames, HeldOut heldOut,
              const std::function<std::unique_ptr<CostModel>(const ObservedFrames&)>& fit) {
    SDAG_ASSERT(canHoldOut(frames, heldOut));
    std::vector<double> regrets(frames.size(), 0.0);
    forGroups(frames, heldOut, [&](const std::vector<size_t>& held, const ObservedFrames& fitted) {
        const std::unique_ptr<CostModel> model = fit(fitted);
        for (const size_t k : held)
            regrets[k] = routingRegret(*frames[k], model->route(frames[k]->maps), model->counts());
    });
    return regrets;
}

CostFit fitCosts(const std::vector<ObservedFrame>& frames) {
    const ObservedFrames observed = pointersTo(frames);
    if (observed.empty())
        throw Error(ErrorKind::kInput, "costs cannot be fitted: no measured frame has a map; "
                                       "choose scenes and cameras that see lit surfaces");
    CostFit fit;
    fit.judgedBy = judgeOf(observed);
    if (fit.judgedBy) {
        fit.trials = FormSearch(observed, *fit.judgedBy).search();
    } else {
        FitTrial only;
        only.form = constantForm();
        only.isKept = true;
        fit.trials = {only};
    }
    for (const FitTrial& trial : fit.trials)
        if (trial.isKept) {
            fit.calibration = fitForm(observed, trial.form);
            dropNothing(fit.calibration.rays);
            dropNothing(fit.calibration.map);
            fit.byScene = trial.byScene;
            fit.byFrame = trial.byFrame;
        }
    const auto regretBy = [&](const char* model) {
        return meanOfGroups(observed, fit.judgedBy.value_or(HeldOut::kFrames),
                            regretsOf(observed, *makeCostModel(model)));
    };
    fit.rays = regretBy("texels:inf");
    fit.maps = regretBy("texels:0");
    fit.texels96 = regretBy("texels:96");
    const auto threshold = [&](HeldOut heldOut) -> std::optional<Regret> {
        if (!canHoldOut(observed, heldOut))
            return std::nullopt;
        return meanOfGroups(observed, heldOut,
                            heldOutRegret(observed, heldOut, [](const ObservedFrames& fitted) {
                                return thresholdModel(bestThreshold(fitted));
                            }));
    };
    fit.thresholdByScene = threshold(HeldOut::kScenes);
    fit.thresholdByFrame = threshold(HeldOut::kFrames);
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
