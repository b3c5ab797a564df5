// SPDX-License-Identifier: Apache-2.0
// The rule by which mechanisms are judged.
#include "tools/studies/ablation.h"

#include "cuda/macros.h"
#include "cuda/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

const double kLeastGain = std::log(1.01), kLeastHelp = std::log(1.2), kLeastLoss = std::log(1.05);

/// Returns the standard error of the mean of values, 0 of fewer than two.
double standardError(const std::vector<double>& values) {
    const double n = double(values.size());
    if (values.size() < 2)
        return 0;
    double mean = 0, square = 0;
    for (const double value : values)
        mean += value / n;
    for (const double value : values)
        square += (value - mean) * (value - mean);
    return std::sqrt(square / ((n - 1) * n));
}

bool pays(const Gain& gain) {
    return gain.log > std::max(2 * gain.spread, kLeastGain);
}
bool isWorse(const Gain& gain) {
    return -gain.log > std::max(2 * gain.spread, kLeastLoss);
}

std::string percent(const Gain& gain) {
    char text[64];
    std::snprintf(text, sizeof text, "%+.1f %% (spread %.1f)", 100 * (std::exp(-gain.log) - 1),
                  100 * gain.spread);
    return text;
}

/// Returns the metrics that are worse, and by how much; "" if none is.
std::string prices(const Judgement& j) {
    std::string text;
    const auto add = [&](const char* name, const Gain& gain) {
        if (!isWorse(gain))
            return;
        if (!text.empty())
            text += ", ";
        text += name;
        text += " ";
        text += percent(gain);
    };
    add("time", j.time);
    add("error", j.error);
    add("bytes", j.bytes);
    return text;
}

} // namespace

Gain gainOfRuns(const std::vector<double>& offMs, const std::vector<double>& onMs) {
    SDAG_ASSERT(!offMs.empty() && offMs.size() == onMs.size());
    std::vector<double> logs(offMs.size());
    for (size_t i = 0; i < logs.size(); ++i)
        logs[i] = std::log(offMs[i] / onMs[i]);
    return {median(logs), standardError(logs)};
}

Gain gainOf(double off, double on, double floor) {
    return {std::log((off + floor) / (on + floor)), 0};
}

Gain meanGain(const std::vector<Gain>& scenes) {
    if (scenes.empty())
        return {};
    const double n = double(scenes.size());
    std::vector<double> logs;
    double mean = 0, square = 0;
    for (const Gain& scene : scenes) {
        logs.push_back(scene.log);
        mean += scene.log / n;
        square += scene.spread * scene.spread / (n * n);
    }
    const double over = standardError(logs);
    return {mean, std::sqrt(over * over + square)};
}

Judgement judge(const MechanismEvidence& evidence, bool isKept) {
    Judgement j;
    j.own = meanGain(evidence.own);
    j.time = meanGain(evidence.time);
    j.error = meanGain(evidence.error);
    j.bytes = meanGain(evidence.bytes);
    bool helps = false;
    for (const Gain& gain : evidence.ownOnFailures) {
        helps |= gain.log > std::max(2 * gain.spread, kLeastHelp);
        j.bestOnFailures = std::max(j.bestOnFailures, gain.log);
    }
    const std::string price = prices(j);
    const std::string own = percent(j.own);
    char times[32];
    std::snprintf(times, sizeof times, "%.3g", std::exp(j.bestOnFailures));
    if (pays(j.own)) {
        const bool isDear = isWorse(j.error) || (isWorse(j.time) && -j.time.log > j.own.log) ||
                            (isWorse(j.bytes) && -j.bytes.log > j.own.log);
        j.verdict = isDear ? MechanismVerdict::kOption : MechanismVerdict::kOn;
        j.reason = "pays: " + own + " in its own metric" +
                   (price.empty() ? ", no other is worse" : "; price: " + price);
    } else if (helps) {
        j.verdict = price.empty() ? MechanismVerdict::kOn : MechanismVerdict::kOption;
        j.reason = "does not pay in the built-in scenes (" + own + "), but gains " + times +
                   " times in a failure" + (price.empty() ? ", at no price" : "; price: " + price);
    } else {
        j.verdict = isKept ? MechanismVerdict::kKept : MechanismVerdict::kDelete;
        j.reason = "does not pay: " + own + " in its own metric" +
                   (price.empty() ? "" : "; price: " + price);
    }
    return j;
}

} // namespace shadowdag
