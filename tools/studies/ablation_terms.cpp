// SPDX-License-Identifier: Apache-2.0
// The terms of the cost model as mechanisms: the time that each saves by the routes that it
// changes.
#include "tools/studies/ablation.h"

#include "hybrid/routing/cost_terms.h"

#include <algorithm>
#include <map>

namespace shadowdag {

namespace {

const std::string kPrefix = "term-";
constexpr const char* kConstant = "maps"; // part of every form

bool holds(const std::vector<CostSummand>& sum, const CostTerm& term) {
    return std::any_of(sum.begin(), sum.end(),
                       [&](const CostSummand& summand) { return summand.term == &term; });
}

CostCalibration without(CostCalibration form, const CostTerm& term) {
    for (std::vector<CostSummand>* sum : {&form.rays, &form.map}) {
        std::erase_if(*sum, [&](const CostSummand& summand) { return summand.term == &term; });
        if (sum->empty())
            sum->push_back({findCostTerm(kConstant), 0});
    }
    return form;
}

CostCalibration with(CostCalibration form, const CostTerm& term) {
    if (term.isOfRays)
        form.rays.push_back({&term, 0});
    if (term.isOfMap)
        form.map.push_back({&term, 0});
    return form;
}

/// Returns by scene the time of serving its frames by the routes of a form that is fitted to all
/// frames except the routed one, counting included.
std::map<std::string, double> servedMs(const ObservedFrames& frames, const CostCalibration& form) {
    const std::vector<double> regrets =
        heldOutRegret(frames, HeldOut::kFrames, [&](const ObservedFrames& fitted) {
            return makeCostModelOf(fitForm(fitted, form));
        });
    std::map<std::string, double> ms;
    for (size_t f = 0; f < frames.size(); ++f) {
        double cheaper = 0;
        for (const MapCost& cost : frames[f]->costs)
            cheaper += std::min(cost.raysMs, cost.mapMs);
        ms[frames[f]->scene] += cheaper * (1 + regrets[f]);
    }
    return ms;
}

} // namespace

std::vector<std::string> costTermNames() {
    std::vector<std::string> names;
    for (const CostTerm& term : costTerms())
        if (term.name != std::string(kConstant))
            names.push_back(kPrefix + term.name);
    return names;
}

Json judgeCostTerms(const std::vector<ObservedFrame>& observed,
                    const std::vector<std::string>& names) {
    ObservedFrames frames;
    for (const ObservedFrame& frame : observed)
        frames.push_back(&frame);
    const CostCalibration kept = fitCosts(observed).calibration;
    const std::string form = "rays: " + formText(kept.rays) + "; map: " + formText(kept.map);
    Json rows = Json::array();
    for (const CostTerm& term : costTerms()) {
        const std::string name = kPrefix + term.name;
        if (term.name == std::string(kConstant) ||
            (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()))
            continue;
        const bool isInForm = holds(kept.rays, term) || holds(kept.map, term);
        const CostCalibration off = isInForm ? without(kept, term) : kept,
                              on = isInForm ? kept : with(kept, term);
        const std::map<std::string, double> offMs = servedMs(frames, off),
                                            onMs = servedMs(frames, on);
        MechanismEvidence evidence;
        Json row = {{"name", name},
                    {"kind", "cost term"},
                    {"what", std::string("Lets the cost model `cost` read ") + term.meaning +
                                 ", to route more maps to the cheaper method."},
                    {"method", "hybrid"},
                    {"metric", "time_ms"},
                    {"always", "model cost"},
                    {"off_settings", "rays: " + formText(off.rays) + "; map: " + formText(off.map)},
                    {"on_settings", "rays: " + formText(on.rays) + "; map: " + formText(on.map)},
                    {"is_default", isInForm},
                    {"kept_for", "calibrate, which tries every term again on each machine"},
                    {"source", "ours"},
                    {"is_sequence", false},
                    {"scenes", Json::array()}};
        for (const auto& [scene, ms] : offMs) {
            const Gain gain = gainOf(ms, onMs.at(scene), 0);
            evidence.own.push_back(gain);
            evidence.time.push_back(gain);
            row["scenes"].push_back({{"scene", scene},
                                     {"is_failure", false},
                                     {"off", {{"time_ms", Json::array({ms})}}},
                                     {"on", {{"time_ms", Json::array({onMs.at(scene)})}}},
                                     {"time_ratio", onMs.at(scene) / ms},
                                     {"own_ratio", onMs.at(scene) / ms}});
        }
        addJudgement(evidence, true, row);
        rows.push_back(std::move(row));
    }
    return rows;
}

} // namespace shadowdag
