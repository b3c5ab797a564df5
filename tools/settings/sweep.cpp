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

/// Throws Error kUsage if a setting has several values beside variants.
void refuseSeveral(const std::string& key, size_t count) {
    if (count > 1)
        throw Error(ErrorKind::kUsage,
                    key + " names " + std::to_string(count) +
                        " values; beside variants it takes one, because a variant is one "
                        "configuration");
}

/// Throws Error kUsage if the settings' values have more combinations than a sweep may run.
/// @param resolutionCount,thresholdCount of the DAGs and thresholds that are combined with them
void refuseManyCombinations(const Experiment& e, size_t resolutionCount, size_t thresholdCount) {
    double count = double(std::max<size_t>(resolutionCount, 1)) * double(thresholdCount);
    for (const Setting* setting : frameSettings())
        count *= double(setting->texts(e).size());
    if (count > double(kMaxCombinationCount))
        throw Error(ErrorKind::kUsage, "the lists of values have " + numberText(count) +
                                           " combinations; a sweep runs " +
                                           std::to_string(kMaxCombinationCount) +
                                           " at most: shorten them, or divide the sweep");
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
    const size_t count = setting.texts(e).size();
    for (size_t value = 0; value < count; ++value) {
        FrameOptions varied = frame;
        setting.apply(e, value, varied);
        forCombinations(e, varied, next + 1, take);
    }
}

} // namespace

std::vector<float> automaticThresholds(std::vector<float> requests) {
    constexpr size_t kQuantileCount = 6;
    std::sort(requests.begin(), requests.end());
    std::vector<float> distinct = requests;
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    if (distinct.size() < 2)
        return {};
    // A threshold routes by how many of the distinct requests are less.
    const auto countBelow = [&](float texels) {
        return size_t(std::lower_bound(distinct.begin(), distinct.end(), texels) -
                      distinct.begin());
    };
    std::set<size_t> counts;
    for (size_t k = 1; k <= kQuantileCount; ++k)
        counts.insert(
            std::clamp<size_t>(countBelow(requests[k * requests.size() / (kQuantileCount + 1)]), 1,
                               distinct.size() - 1));
    const size_t ofPaper = countBelow(kPaperTexels);
    if (ofPaper > 0 && ofPaper < distinct.size())
        counts.insert(ofPaper);
    std::vector<float> thresholds;
    for (const size_t count : counts) {
        const float above = distinct[count - 1], most = distinct[count];
        float chosen = count == ofPaper ? kPaperTexels : most;
        for (double step = 10000; count != ofPaper && step > 1e-6; step /= 10) {
            const auto rounded = float((std::floor(double(above) / step) + 1) * step);
            if (rounded > above && rounded <= most) {
                chosen = rounded;
                break;
            }
        }
        thresholds.push_back(chosen);
    }
    return thresholds;
}

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
        if (method->needs().embree) {
            RunParameters run{method->name(), method->modelText(""), 0, 0, base, ""};
            method->takeOver(run.frame.rays);
            add(std::move(run));
        }
    if (!e.variants.empty()) {
        for (const Setting* setting : frameSettings())
            refuseSeveral(setting->key, setting->texts(e).size());
        refuseSeveral("resolutions", dagResolutions.size());
        for (const std::string& name : e.variants) {
            RunParameters run = variantRun(parseVariant("variants", name), base);
            run.resolution = run.usesVoxels() && !dagResolutions.empty() ? dagResolutions[0] : 0;
            runs.push_back(std::move(run));
        }
        return runs;
    }
    const size_t dagCount = dagResolutions.size();
    const auto resolutionOf = [&](size_t dag) { return dag < dagCount ? dagResolutions[dag] : 0; };
    const auto addRun = [&](const Method& method, const std::string& model, size_t dag,
                            const FrameOptions& frame) {
        RunParameters run{method.name(), model, 0, 0, frame, ""};
        if (run.usesVoxels()) {
            run.dag = uint32_t(dag);
            run.resolution = resolutionOf(dag);
        }
        add(std::move(run));
    };
    const auto addThreshold = [&](float threshold, size_t dag, const FrameOptions& frame) {
        for (const Method* method : methods())
            if (method->isRunAtThreshold(threshold))
                addRun(*method, "texels:" + numberText(threshold), dag, frame);
    };
    std::vector<float> thresholds =
        e.areThresholdsAutomatic() ? std::vector<float>{kPaperTexels} : e.thresholds;
    thresholds.push_back(0); // the two pure methods are part of every comparison that has them
    thresholds.push_back(kInfinity);
    std::sort(thresholds.begin(), thresholds.end());
    thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());

    refuseManyCombinations(e, fullCount, thresholds.size());
    for (size_t dag = 0; dag < std::max<size_t>(fullCount, 1); ++dag)
        forCombinations(e, base, 0, [&](const FrameOptions& frame) {
            for (const float threshold : thresholds)
                addThreshold(threshold, dag, frame);
        });
    for (size_t dag = fullCount; dag < dagCount; ++dag)
        for (const float believe : e.believe) {
            FrameOptions frame = base;
            frame.rays.believe = believe;
            addThreshold(kInfinity, dag, frame);
        }
    for (const Method* method : methods())
        if (method->needs().routing)
            for (const std::string& model : e.models)
                for (const FrameStart start : e.start) { // each has costs of its own
                    FrameOptions frame = base;
                    frame.start = start;
                    addRun(*method, model, 0, frame);
                }
    return runs;
}

} // namespace shadowdag
