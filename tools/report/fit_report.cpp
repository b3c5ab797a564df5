// SPDX-License-Identifier: Apache-2.0
#include "tools/report/fit_report.h"

#include "tools/settings/parse.h"

#include <algorithm>
#include <cstdio>
#include <map>

namespace shadowdag {

namespace {

using Kind = FitVerdict::Kind;

/// The names of verdicts in results, and the rule of each as text.
struct Rule {
    Kind kind;
    const char* name;
    const char* text;
};

constexpr Rule kRules[] = {
    {Kind::kKnownCost, "known cost", "its voxels alone are at least as large as the choice"},
    {Kind::kCostlier, "costlier", "it, or a coarser model, was measured to cost more"},
    {Kind::kErrorOfFiner, "error of finer", "a finer model breaks the bound"},
    {Kind::kDominated, "dominated", "a coarser model keeps the bound"},
};

const Rule* ruleOf(Kind kind) {
    for (const Rule& rule : kRules)
        if (rule.kind == kind)
            return &rule;
    return nullptr;
}

std::string formatted(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

/// Returns what was minimised, then the other of time and bytes as far as it was measured.
std::string costText(const Json& model, const std::string& objective) {
    const std::string bytes = bytesText(model.at("bytes").get<double>());
    const char* key = model.contains("time_ms") ? "time_ms" : "first_frame_time_ms";
    if (!model.contains(key))
        return bytes;
    const std::string time = formatted("%.2f ms", model.at(key).get<double>());
    return objective == "bytes" ? bytes + ", " + time : time + ", " + bytes;
}

/// Writes one model's results.
class ModelWriter {
public:
    explicit ModelWriter(const FitFindings& found)
        : found_(found), verdicts_(found.search.verdicts()) {}

    Json write(size_t model) const {
        const RunParameters& run = found_.models.runs[model];
        Json json = {{"label", run.label()},
                     {"method", run.method},
                     {"model", run.model},
                     {"parameters", run.toJson()}};
        addVerdict(model, json);
        if (found_.search.observation(model) != nullptr)
            addMeasured(model, json);
        else if (found_.models.space.models[model].knownCost > 0)
            json["least_bytes"] = uint64_t(found_.models.space.models[model].knownCost);
        return json;
    }

    Json neighbours(size_t model) const {
        Json list = Json::array();
        const FitModel& center = found_.models.space.models[model];
        for (const size_t other : found_.search.neighbours(model)) {
            const FitModel& m = found_.models.space.models[other];
            Json json = write(other);
            for (size_t axis = 0; axis < m.at.size(); ++axis)
                if (m.at[axis] != center.at[axis])
                    json["differs_in"] = fitAxes()[axis];
            if (const FitObservation* seen = found_.search.observation(other)) {
                json["error_over_bound"] =
                    found_.bound > 0 ? Json(seen->error / found_.bound) : Json();
                const double chosenCost = found_.search.observation(model)->cost;
                json["cost_over_choice"] = chosenCost > 0 ? Json(seen->cost / chosenCost) : Json();
                json["is_cheaper"] = seen->cost < chosenCost;
            }
            list.push_back(std::move(json));
        }
        return list;
    }

private:
    void addVerdict(size_t model, Json& json) const {
        const FitVerdict& verdict = verdicts_[model];
        const auto by = [&](size_t other) { return found_.models.runs[other].label(); };
        if (model == found_.choice) {
            json["status"] = "chosen";
        } else if (verdict.kind == Kind::kHolds) {
            json["status"] = "dominated";
            json["by"] = by(found_.choice);
            const bool isRays = found_.measurer.raysAlone(model) != SIZE_MAX;
            json["reason"] = isRays         ? "drew no map, so it is the model of rays alone"
                             : isTie(model) ? "keeps the bound, costs the same within one standard "
                                              "error, is less simple"
                                            : "keeps the bound, costs more";
        } else if (verdict.kind == Kind::kBreaks) {
            json["status"] = "refuted";
            json["reason"] = "breaks the bound";
        } else if (const Rule* rule = ruleOf(verdict.kind)) {
            json["status"] = "ruled out";
            json["rule"] = rule->name;
            json["by"] = by(verdict.by);
            json["reason"] = rule->text;
        }
    }

    /// Returns whether a model that keeps the bound costs the same as the choice, as far as is
    /// known.
    bool isTie(size_t model) const {
        if (found_.objective == FitObjective::kBytes)
            return found_.search.observation(model)->cost ==
                   found_.search.observation(found_.choice)->cost;
        const auto a = found_.measurer.finalTime(model),
                   b = found_.measurer.finalTime(found_.choice);
        return a && b &&
               std::abs(a->medianMs - b->medianMs) <=
                   std::hypot(a->standardErrorMs, b->standardErrorMs);
    }

    void addMeasured(size_t model, Json& json) const {
        const std::vector<FitCell>& cells = found_.measurer.cells(model);
        uint64_t pairs = 0, falseShadow = 0, falseLight = 0, dagBytes = 0, mapBytes = 0, bytes = 0;
        Json list = Json::array();
        double flip = 0, visibility = 0, worst = 0;
        for (size_t c = 0; c < cells.size(); ++c) {
            const FitCell& cell = cells[c];
            if (!cell.isMeasured)
                continue;
            Json entry = found_.measurer.cellNames()[c];
            entry.update({{"error", cell.error},
                          {"pair_count", cell.pairCount},
                          {"false_shadow_count", cell.falseShadowCount},
                          {"false_light_count", cell.falseLightCount},
                          {"mean_abs_visibility_error", cell.meanAbsVisibilityError},
                          {"flip", cell.flip},
                          {"dag_bytes", cell.dagBytes},
                          {"map_bytes", cell.mapBytes}});
            if (!cell.poolNote.empty())
                json["pool_note"] = entry["pool_note"] = cell.poolNote;
            list.push_back(std::move(entry));
            pairs += cell.pairCount;
            falseShadow += cell.falseShadowCount;
            falseLight += cell.falseLightCount;
            visibility += cell.meanAbsVisibilityError * double(cell.pairCount);
            flip += cell.flip;
            worst = std::max(worst, cell.error);
            dagBytes = std::max(dagBytes, cell.dagBytes);
            mapBytes = std::max(mapBytes, cell.mapBytes);
            bytes = std::max(bytes, cell.bytes());
        }
        json["error"] = worst;
        json["is_complete"] = list.size() == cells.size();
        json["bytes"] = bytes;
        json["dag_bytes"] = dagBytes;
        json["map_bytes"] = mapBytes;
        json["pair_count"] = pairs;
        json["false_shadow_count"] = falseShadow;
        json["false_light_count"] = falseLight;
        json["mean_abs_visibility_error"] = visibility / double(pairs);
        json["flip"] = flip / double(list.size());
        json["frames"] = std::move(list);
        if (const auto time = found_.measurer.screenTime(model)) {
            json["first_frame_time_ms"] = time->medianMs;
            json["first_frame_time_ms_min"] = time->minMs;
        }
        if (const auto time = found_.measurer.finalTime(model)) {
            json["time_ms"] = time->medianMs;
            json["time_ms_standard_error"] = time->standardErrorMs;
        }
    }

    const FitFindings& found_;
    std::vector<FitVerdict> verdicts_;
};

Json lawsJson(const FitFindings& found) {
    Json list = Json::array();
    for (size_t group = 0; group < found.models.groups.size(); ++group) {
        Json cost = Json::array(), error = Json::array();
        for (size_t axis = 0; axis < fitAxes().size(); ++axis) {
            const FitLaw& law = found.models.space.laws[group][axis];
            bool isRead = false;
            for (const FitModel& model : found.models.space.models)
                isRead = isRead || (model.group == group && model.at[axis] > 0);
            if (law.costGrows && isRead)
                cost.push_back(fitAxes()[axis]);
            if (law.errorFalls && isRead)
                error.push_back(fitAxes()[axis]);
        }
        const auto add = [&](const char* law, const Json& axes, const FitLawReport& report,
                             double slack) {
            if (axes.empty())
                return;
            list.push_back({{"models", found.models.groups[group]},
                            {"law", law},
                            {"axes", axes},
                            {"slack", slack},
                            {"checked_pair_count", report.pairCount},
                            {"violation_count", report.violationCount},
                            {"worst_violation", report.worst},
                            {"is_given_up", report.isGivenUp}});
        };
        add("finer costs no less", cost, found.search.costLaw(group), found.settings.costSlack);
        add("finer has no larger error", error, found.search.errorLaw(group),
            found.settings.errorSlack);
    }
    return list;
}

} // namespace

std::string metricName(FitMetric metric) {
    return metric == FitMetric::kFalse        ? "false"
           : metric == FitMetric::kVisibility ? "visibility"
                                              : "flip";
}

std::string objectiveName(FitObjective objective) {
    return objective == FitObjective::kTime ? "time" : "bytes";
}

Json fitJson(const FitFindings& found) {
    const ModelWriter writer(found);
    Json models = Json::array();
    std::map<std::string, uint64_t> statusCounts;
    uint64_t measuredCount = 0, completeCount = 0;
    for (size_t model = 0; model < found.models.runs.size(); ++model) {
        Json json = writer.write(model);
        ++statusCounts[json.contains("rule") ? json["rule"].get<std::string>()
                                             : json["status"].get<std::string>()];
        measuredCount += json.contains("error") ? 1 : 0;
        completeCount += json.value("is_complete", false) ? 1 : 0;
        models.push_back(std::move(json));
    }
    Json json = {{"metric", metricName(found.metric)},
                 {"bound", found.bound},
                 {"minimise", objectiveName(found.objective)},
                 {"scenes", found.measurer.scenes()},
                 {"frame_count", found.measurer.cellCount()},
                 {"model_count", found.models.runs.size()},
                 {"measured_count", measuredCount},
                 {"measured_in_all_frames_count", completeCount},
                 {"status_counts", statusCounts},
                 {"simplicity_order", simplicityOrder()},
                 {"laws", lawsJson(found)},
                 {"chosen", Json()},
                 {"neighbours", Json::array()},
                 {"least_error", writer.write(found.search.leastError())}};
    // Bytes are the maximum over all frames in which a model was measured; times are screened in
    // one.
    json["times_screened_in"] =
        found.objective == FitObjective::kTime ? found.measurer.cellNames()[0] : Json();
    if (found.choice != SIZE_MAX) {
        json["chosen"] = writer.write(found.choice);
        json["neighbours"] = writer.neighbours(found.choice);
    }
    json["models"] = std::move(models);
    return json;
}

void printFit(std::ostream& out, const Json& result) {
    const std::string objective = result.at("minimise");
    char line[256];
    const auto printModel = [&](const char* head, const Json& model, const std::string& tail) {
        std::snprintf(line, sizeof line, "%-10s %-44s %24s  error %.5f%s\n", head,
                      model.at("label").get<std::string>().c_str(),
                      costText(model, objective).c_str(), model.at("error").get<double>(),
                      tail.c_str());
        out << line;
    };
    std::snprintf(line, sizeof line,
                  "%llu models, %llu measured in the first of %llu frames, %llu of them in all; "
                  "bound: %s error at most %g in every frame\n",
                  result.at("model_count").get<unsigned long long>(),
                  result.at("measured_count").get<unsigned long long>(),
                  result.at("frame_count").get<unsigned long long>(),
                  result.at("measured_in_all_frames_count").get<unsigned long long>(),
                  result.at("metric").get<std::string>().c_str(), result.at("bound").get<double>());
    out << line;
    for (const Rule& rule : kRules)
        if (const auto count = result.at("status_counts").value(rule.name, uint64_t(0)))
            out << "  ruled out by " << rule.name << ": " << count << " (" << rule.text << ")\n";
    for (const Json& law : result.at("laws")) {
        const auto checked = law.at("checked_pair_count").get<uint64_t>(),
                   broken = law.at("violation_count").get<uint64_t>();
        out << "  assumed of " << law.at("models").get<std::string>() << ": "
            << law.at("law").get<std::string>() << "; "
            << (checked == 0 ? "no two measured models check this"
                : broken == 0
                    ? "every one of " + std::to_string(checked) + " measured pairs of models agrees"
                    : std::to_string(broken) + " of " + std::to_string(checked) +
                          " measured pairs of models contradict it by more than the "
                          "slack")
            << (law.at("is_given_up") ? "; it was not used" : "") << "\n";
    }
    if (const Json& cell = result.at("times_screened_in");
        !cell.is_null() && result.at("frame_count").get<size_t>() > 1)
        out << "  models that cost more were excluded by the time of "
            << cell.at("scene").get<std::string>() << " frame " << cell.at("frame")
            << " alone; the others were timed in all "
            << "frames\n";
    if (result.at("chosen").is_null()) {
        printModel("least error", result.at("least_error"), "");
        return;
    }
    printModel("chosen", result.at("chosen"), "");
    if (result.at("chosen").contains("pool_note"))
        out << "  " << result["chosen"]["pool_note"].get<std::string>()
            << "; enlarge it with --pool\n";
    for (const Json& neighbour : result.at("neighbours"))
        if (neighbour.value("is_cheaper", false) && neighbour.at("status") == "refuted")
            printModel("refuted", neighbour,
                       ": " +
                           (neighbour.at("error_over_bound").is_null()
                                ? "more than the bound of 0"
                                : formatted("%.2f", neighbour["error_over_bound"].get<double>()) +
                                      " times the bound") +
                           " at " +
                           formatted("%.2f", neighbour.at("cost_over_choice").get<double>()) +
                           " times the cost");
}

} // namespace shadowdag
