// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/fit_space.h"

#include "tools/settings/parse.h"
#include "tools/settings/setting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace shadowdag {

namespace {

enum Axis { kResolution, kLod, kUndersample, kTaps, kMapsPerLight, kPageSize, kRouter, kAxisCount };

/// The simplicity order: one row per criterion; the first that differs decides, and less is
/// simpler.
struct Criterion {
    const char* text;
    int (*rank)(const RunParameters& run, const std::vector<int>& at);
};

int mechanismCount(const RunParameters& run, const std::vector<int>&) {
    const MethodNeeds& needs = run.kind().needs();
    int count = run.usesVoxels() + run.usesTriangles() + needs.maps + needs.routing;
    count += needs.routing && !run.model.starts_with("texels:") ? 1 : 0; // a router's costs
    count += run.usesVoxels() && LodChoice(run.frame.rays) != LodChoice(0) ? 1 : 0;
    count += run.usesMaps() && run.frame.bias.taps > 1 ? 1 : 0;    // a filter
    count += run.usesMaps() && run.frame.mapsPerLight > 1 ? 1 : 0; // maps by distance
    return count;
}

template <Axis axis> int rankOn(const RunParameters&, const std::vector<int>& at) {
    return at[axis];
}

constexpr std::array<Criterion, 10> kSimplicity{{
    {"fewer mechanisms (rays through voxels, rays against triangles, maps, a router, its costs, "
     "level "
     "of detail, a filter, several maps a light)",
     mechanismCount},
    {"dag before maps before hybrid",
     [](const RunParameters& run, const std::vector<int>&) { return run.kind().complexity(); }},
    {"rays without voxels",
     [](const RunParameters& run, const std::vector<int>&) { return int(run.usesVoxels()); }},
    {"coarser voxels", rankOn<kResolution>},
    {"fewer taps", rankOn<kTaps>},
    {"sparser texels", rankOn<kUndersample>},
    {"fewer maps a light", rankOn<kMapsPerLight>},
    {"larger pages", rankOn<kPageSize>},
    {"level of detail as listed", rankOn<kLod>},
    {"the router that traces more", rankOn<kRouter>},
}};

/// Returns the laws assumed of a method's models, by axis.
std::vector<FitLaw> lawsOf(const Method& method, float believe, bool routesByTexels,
                           FitObjective objective) {
    const bool isBytes = objective == FitObjective::kBytes;
    std::vector<FitLaw> laws(kAxisCount);
    // Of coarser voxels fewer are believed, and the rest is left to the triangles: time may grow or
    // fall.
    laws[kResolution] = {isBytes || std::isinf(believe), true};
    // A router uses requirements after undersampling: sparser texels move maps to rays, which may
    // have a smaller error and any time; the number of pages only falls.
    const bool isRouted = method.needs().routing;
    laws[kUndersample] = {isBytes || !isRouted, !isRouted};
    // More taps blur: nearer to the truth at some edges, farther at others.
    laws[kTaps] = {true, false};
    // Drawing more maps needs more pages; its effect on time is what routers decide about.
    laws[kRouter] = {isBytes && routesByTexels, false};
    return laws;
}

template <class T> std::vector<T> sorted(std::vector<T> values, bool isDescending) {
    std::sort(values.begin(), values.end());
    if (isDescending)
        std::reverse(values.begin(), values.end());
    return values;
}

class ModelList {
public:
    ModelList(const Experiment& sweep, FitObjective objective)
        : sweep_(sweep), objective_(objective) {
        undersample_ = sorted(sweep.undersample, true);
        taps_ = sorted(sweep.taps, false);
        mapsPerLight_ = sorted(sweep.mapsPerLight, false);
        pageTexels_ = sorted(sweep.pageTexels, true);
    }

    /// Adds the models of a method as a group.
    /// @param routers for hybrid; one "" for the others
    void addGroups(const std::string& name, const Method& method,
                   const std::vector<std::string>& routers) {
        if (!method.needs().rays)
            return addGroup(name, method, sweep_.believe.front(), routers);
        const Setting& setting = settingOf("--believe");
        const std::vector<std::string> texts = setting.texts(sweep_);
        for (size_t i = 0; i < texts.size(); ++i)
            addGroup(name + " believe " + texts[i], method, sweep_.believe[i], routers);
    }

    FitModels out;

private:
    void addGroup(const std::string& name, const Method& method, float believe,
                  const std::vector<std::string>& routers) {
        believe_ = believe;
        const bool usesVoxels = method.needs().rays && believe > 0.0f;
        const bool usesMaps = method.needs().maps;
        const std::array<size_t, kAxisCount> counts{usesVoxels ? sweep_.resolutionLog2.size() : 0,
                                                    usesVoxels ? sweep_.lod.size() : 0,
                                                    usesMaps ? undersample_.size() : 0,
                                                    usesMaps ? taps_.size() : 0,
                                                    usesMaps ? mapsPerLight_.size() : 0,
                                                    usesMaps ? pageTexels_.size() : 0,
                                                    method.needs().routing ? routers.size() : 0};
        group_ = out.groups.size();
        out.groups.push_back(name);
        out.space.laws.push_back(lawsOf(
            method, believe, !routers.empty() && routers[0].starts_with("texels:"), objective_));
        std::vector<int> at(kAxisCount, -1);
        const std::function<void(size_t)> vary = [&](size_t axis) {
            if (axis == kAxisCount) {
                add(method, routers, at);
                return;
            }
            for (size_t k = 0; k < counts[axis]; ++k) {
                at[axis] = int(k);
                vary(axis + 1);
            }
            if (counts[axis] == 0)
                vary(axis + 1);
            at[axis] = -1;
        };
        vary(0);
    }

    void add(const Method& method, const std::vector<std::string>& routers,
             const std::vector<int>& at) {
        // A parameter that the method does not read has its first value and no effect.
        const auto value = [&](const auto& values, Axis axis) {
            return values[size_t(std::max(at[axis], 0))];
        };
        Experiment e = sweep_;
        e.methods = {method.name()};
        e.resolutionLog2 = {value(sweep_.resolutionLog2, kResolution)};
        e.dagResolutionLog2.clear();
        e.lod = {value(sweep_.lod, kLod)};
        e.undersample = {value(undersample_, kUndersample)};
        e.taps = {value(taps_, kTaps)};
        e.mapsPerLight = {value(mapsPerLight_, kMapsPerLight)};
        e.pageTexels = {value(pageTexels_, kPageSize)};
        e.believe = {believe_};
        e.bias.resize(1);
        e.offset.resize(1);
        e.thresholds.clear();
        e.models.clear();
        e.variants.clear();
        if (method.needs().routing) {
            const std::string& router = routers[size_t(at[kRouter])];
            if (router.starts_with("texels:"))
                e.thresholds = parseThresholds("--thresholds", router.substr(7));
            else
                e.models = {router};
        }
        std::vector<RunParameters> runs =
            configurations(e, {uint32_t(1) << e.resolutionLog2[0]}, 1);
        if (runs.size() != 1)
            throw std::logic_error("a model of fit is " + std::to_string(runs.size()) +
                                   " configurations");
        // So that compare accepts the experiment. Routers are those of the model.
        for (const Setting& setting : settings())
            if (setting.readBy != ReadBy::kAll && !reads(runs[0], setting.readBy) &&
                setting.key != "thresholds" && setting.key != "models")
                setting.set(e, setting.option, setting.texts(Experiment()));
        runs[0].dag = uint32_t(std::max(at[kResolution], 0));
        FitModel model{group_, at, {}, 0};
        for (const Criterion& criterion : kSimplicity)
            model.simplicity.push_back(criterion.rank(runs[0], at));
        model.simplicity.push_back(int(group_)); // two cost models at their only value
        out.space.models.push_back(std::move(model));
        out.experiments.push_back(std::move(e));
        out.runs.push_back(std::move(runs[0]));
    }

    const Experiment& sweep_;
    FitObjective objective_;
    std::vector<float> undersample_;
    std::vector<uint32_t> taps_, mapsPerLight_, pageTexels_;
    size_t group_ = 0;
    float believe_ = 0;
};

} // namespace

FitModels makeFitModels(const Experiment& sweep, FitObjective objective) {
    ModelList list(sweep, objective);
    std::vector<const Method*> chosen;
    for (const Method* method : methods())
        if (method->complexity() >= 0 &&
            std::count(sweep.methods.begin(), sweep.methods.end(), method->name()) > 0)
            chosen.push_back(method);
    std::sort(chosen.begin(), chosen.end(),
              [](const Method* a, const Method* b) { return a->complexity() < b->complexity(); });
    for (const Method* method : chosen) {
        if (!method->needs().routing) {
            list.addGroups(method->name(), *method, {""});
            continue;
        }
        std::vector<std::string> routers;
        for (const float threshold : sorted(sweep.thresholds, true))
            if (threshold > 0 && !std::isinf(threshold))
                routers.push_back("texels:" + numberText(threshold));
        if (!routers.empty())
            list.addGroups(method->name(), *method, routers);
        for (const std::string& model : sweep.models)
            list.addGroups(method->name() + " " + model, *method, {model});
    }
    return std::move(list.out);
}

void setKnownBytes(FitModels& models, const std::vector<uint64_t>& dagBytes) {
    for (size_t m = 0; m < models.runs.size(); ++m)
        if (models.runs[m].usesVoxels())
            models.space.models[m].knownCost = double(dagBytes[models.runs[m].dag]);
}

const std::vector<std::string>& fitAxes() {
    static const std::vector<std::string> kNames{
        "resolution", "lod", "undersample", "taps", "maps_per_light", "page_size", "router"};
    return kNames;
}

std::vector<std::string> simplicityOrder() {
    std::vector<std::string> texts;
    for (const Criterion& criterion : kSimplicity)
        texts.push_back(criterion.text);
    texts.push_back("the router that was listed first");
    return texts;
}

} // namespace shadowdag
