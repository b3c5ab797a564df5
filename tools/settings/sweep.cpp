// SPDX-License-Identifier: Apache-2.0
// The configurations of an experiment: the cross product of its settings' values.
#include "cuda/error.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"
#include "tools/settings/setting.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace shadowdag {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Throws Error kUsage where a setting has several values beside variants.
void refuseSeveral(const std::string& key, size_t count) {
    if (count > 1)
        throw Error(ErrorKind::kUsage,
                    key + " names " + std::to_string(count) +
                        " values; beside variants it takes one, since a variant is one "
                        "configuration");
}

/// Calls `take` with every combination of the values of the settings from `next` on, the last
/// varying fastest.
void forCombinations(const Experiment& e, const FrameOptions& frame, size_t next,
                     const std::function<void(const FrameOptions&)>& take) {
    if (next == frameSettings().size()) {
        take(frame);
        return;
    }
    const Setting& setting = *frameSettings()[next];
    for (size_t value = 0; value < setting.texts(e).size(); ++value) {
        FrameOptions varied = frame;
        setting.apply(e, value, varied);
        forCombinations(e, varied, next + 1, take);
    }
}

} // namespace

std::vector<RunParameters>
configurations(const Experiment& e, const std::vector<uint32_t>& dagResolutions, size_t fullCount) {
    std::vector<RunParameters> runs;
    std::set<std::string> seen;
    const auto add = [&](RunParameters run) {
        if (std::count(e.methods.begin(), e.methods.end(), run.method) > 0 &&
            seen.insert(run.label()).second)
            runs.push_back(std::move(run));
    };
    const FrameOptions base = baseOptions(e);
    for (const Method* method : methods())
        if (method->isTruth())
            add({method->name(), "", 0, 0, base, ""});
    if (!e.variants.empty()) {
        for (const Setting* setting : frameSettings())
            refuseSeveral(setting->key, setting->texts(e).size());
        refuseSeveral("resolutions", dagResolutions.size());
        for (const std::string& name : e.variants) {
            RunParameters run = variantRun(parseVariant("variants", name), base);
            run.resolution = run.usesRays() && !dagResolutions.empty() ? dagResolutions[0] : 0;
            runs.push_back(std::move(run));
        }
        return runs;
    }
    const size_t dagCount = dagResolutions.size();
    const auto resolutionOf = [&](size_t dag) { return dag < dagCount ? dagResolutions[dag] : 0; };
    const auto addThreshold = [&](float threshold, size_t dag, const FrameOptions& frame) {
        for (const Method* method : methods())
            if (method->isRunAtThreshold(threshold))
                add({method->name(), "texels:" + numberText(threshold), uint32_t(dag),
                     method->needs().voxels ? resolutionOf(dag) : 0, frame, ""});
    };
    const auto addAlone = [&](const Method& method, size_t dag, const FrameOptions& frame) {
        RunParameters run{method.name(), method.modelText(""),
                          uint32_t(dag), method.needs().voxels ? resolutionOf(dag) : 0,
                          frame,         ""};
        method.configure(run.frame);
        add(std::move(run));
    };
    std::vector<float> thresholds = e.thresholds;
    thresholds.push_back(0); // the two pure methods belong to every comparison that names them
    thresholds.push_back(kInfinity);
    std::sort(thresholds.begin(), thresholds.end());
    thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());

    for (size_t dag = 0; dag < std::max<size_t>(fullCount, 1); ++dag)
        forCombinations(e, base, 0, [&](const FrameOptions& frame) {
            for (const float threshold : thresholds)
                addThreshold(threshold, dag, frame);
        });
    for (size_t dag = fullCount; dag < dagCount; ++dag)
        addThreshold(kInfinity, dag, base);
    for (const Method* method : methods())
        if (method->isRunAlone())
            for (size_t dag = 0; dag < (method->needs().voxels ? dagCount : 1); ++dag)
                forCombinations(e, base, 0,
                                [&](const FrameOptions& frame) { addAlone(*method, dag, frame); });
    for (const Method* method : methods())
        if (method->needs().routing)
            for (const std::string& model : e.models)
                add({method->name(), model, 0, resolutionOf(0), base, ""});
    return runs;
}

} // namespace shadowdag
