// SPDX-License-Identifier: Apache-2.0
#include "tools/report/verdict.h"

#include "cuda/quantile_interval.h"
#include "hybrid/routing/cost_model.h"
#include "tools/settings/json_file.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/timing.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

/// A variant over all frames of a scene. Times are sums until finish().
struct MeasuredVariant {
    std::string label;
    std::string shown = label; ///< nameMeasuredRoutes
    double timeMs = 0, minMs = 0, maxMs = 0;
    double lowMs = 0, highMs = 0;             ///< the interval of the time
    std::optional<double> otherCpuShare = {}; ///< CpuUse
    std::vector<double> roundMs =
        {}; ///< of each round in which all variants were timed; may be empty
    uint64_t frameCount = 0, pairCount = 0, wrongCount = 0, repeatCount = UINT64_MAX;
    bool hasFullPool = false, needsCosts = false, isWarm = false;

    double wrongShare() const {
        return double(wrongCount) / double(std::max<uint64_t>(1, pairCount));
    }
    /// Returns the width of the interval of the time, which does not grow with the repeats as the
    /// range does.
    double spreadMs() const { return highMs - lowMs; }

    void add(const Json& run) {
        timeMs += run.at("time_ms").get<double>();
        minMs += run.at("time_ms_min").get<double>();
        maxMs += run.at("time_ms_max").get<double>();
        lowMs += run.value("time_ms_low", run.at("time_ms_min").get<double>());
        highMs += run.value("time_ms_high", run.at("time_ms_max").get<double>());
        const auto rounds = run.value("round_times_ms", std::vector<double>());
        if (frameCount == 0)
            roundMs.assign(rounds.size(), 0.0);
        if (rounds.size() != roundMs.size())
            roundMs.clear();
        for (size_t i = 0; i < roundMs.size(); ++i)
            roundMs[i] += rounds[i];
        otherCpuShare = largerOtherShare(otherCpuShare, run);
        repeatCount = std::min(repeatCount, run.value("repeat_count", uint64_t(1)));
        pairCount += run.at("pair_count").get<uint64_t>();
        wrongCount += run.at("false_shadow_count").get<uint64_t>() +
                      run.at("false_light_count").get<uint64_t>();
        hasFullPool = hasFullPool || isPoolFull(run);
        const std::string model = run.at("model");
        needsCosts = needsCosts || (!model.empty() && makeCostModel(model)->needsCosts());
        isWarm = run.contains("parameters") && run["parameters"].value("start", "") == "warm";
        ++frameCount;
    }
    void finish() {
        for (double* ms : {&timeMs, &minMs, &maxMs, &lowMs, &highMs})
            *ms /= double(frameCount);
    }
};

/// Returns whether a is faster than b: in the rounds in which both were timed, by kVerdictTie at
/// least and with the whole interval of the ratio; without enough rounds, by more than half of the
/// larger spread of both.
bool isFaster(const MeasuredVariant& a, const MeasuredVariant& b) {
    if (!a.roundMs.empty() && a.roundMs.size() == b.roundMs.size()) {
        std::vector<double> ratios(a.roundMs.size());
        for (size_t i = 0; i < ratios.size(); ++i)
            ratios[i] = a.roundMs[i] / b.roundMs[i];
        const QuantileInterval ratio = medianInterval(std::move(ratios));
        if (ratio.isWide())
            return ratio.value <= 1.0 - kVerdictTie && ratio.high < 1.0;
    }
    return a.timeMs + 0.5 * std::max(a.spreadMs(), b.spreadMs()) < b.timeMs;
}

/// Returns the first of the variants that is faster than one with measured routes and has no more
/// wrong pairs, or null. A warm one counts against warm ones alone.
const MeasuredVariant* fasterThanRoutes(const MeasuredVariant& v,
                                        const std::vector<MeasuredVariant>& variants) {
    for (const MeasuredVariant& other : variants)
        if ((!other.isWarm || v.isWarm) && isFaster(other, v) &&
            other.wrongShare() <= v.wrongShare())
            return &other;
    return nullptr;
}

constexpr const char* kMeasuredRoutes = "measured routes";
constexpr const char* kWhyMeasuredRoutes =
    "measured routes: each map by the method that was measured to be cheaper, as model oracle has "
    "it; not called oracle here, because another row with no more wrong pairs is faster";

/// Returns a label with kMeasuredRoutes in place of model oracle.
std::string measuredRoutesLabel(std::string label) {
    constexpr std::string_view kModel = "oracle";
    const size_t at = label.find(kModel);
    return at == std::string::npos ? label + " (" + kMeasuredRoutes + ")"
                                   : label.replace(at, kModel.size(), kMeasuredRoutes);
}

template <class... T> std::string formatted(const char* format, const T&... values) {
    char text[160];
    std::snprintf(text, sizeof text, format, values...);
    return text;
}

std::string percent(double share) {
    return formatted(share > 0 && share < 0.0001 ? "%.4f %%" : "%.2f %%", 100 * share);
}

std::string describe(const MeasuredVariant& v) {
    const int decimals = v.timeMs < 10 ? 2 : 1;
    std::string how; // one measurement has no spread
    if (v.repeatCount > 1)
        how = formatted("%.*f to %.*f", decimals, v.lowMs, decimals, v.highMs);
    if (v.frameCount > 1)
        how += (how.empty() ? "" : ", ") + formatted("mean of %d frames", int(v.frameCount));
    return v.shown + formatted(", %.*f ms", decimals, v.timeMs) +
           (how.empty() ? "" : " (" + how + ")") + ", " +
           (v.wrongCount == 0 ? "no pair" : percent(v.wrongShare()) + " of the pairs") + " wrong";
}

/// The verdict on one scene.
class SceneVerdict {
public:
    SceneVerdict(std::string scene, std::vector<MeasuredVariant> variants)
        : scene_(std::move(scene)), variants_(std::move(variants)) {
        for (const MeasuredVariant& v : variants_)
            sort(v);
        findCautions();
        trustClearlyFaster();
        const bool areAllSpread = open_.empty();
        if (areAllSpread) // their errors are still known
            open_ = std::exchange(spread_, {});
        if (areAllSpread && !open_.empty())
            cautions_.push_back("every time varies by more than " + percent(kVerdictSpread) +
                                " of its median");
        for (const MeasuredVariant& v : spread_)
            distrust(v,
                     "the time varies by more than " + percent(kVerdictSpread) + " of its median",
                     percent(v.spreadMs() / v.timeMs));
        use_ = take();
        second_ = take();
    }

    Json json() const {
        const auto name = [](const MeasuredVariant& v) {
            return v.label.empty() ? Json() : Json(v.label);
        };
        return {{"scene", scene_},
                {"use", name(use_)},
                {"second", name(second_)},
                {"not_trusted", notTrusted_},
                {"cautions", cautions_}};
    }

    /// @param where the size and the machine
    std::string text(const std::string& where) const {
        std::string text = scene_ + " " + where + ": ";
        if (use_.label.empty()) {
            text += "no variant can be recommended.";
            if (!least_.label.empty())
                text += " The least wrong is " + describe(least_) + ".";
        } else {
            text += "use " + describe(use_) + firstFrame(use_) + ".";
            text += second_.label.empty()
                        ? " No other variant can be recommended."
                        : " Second: " + describe(second_) + firstFrame(second_) + ".";
        }
        text += distrustText();
        std::string cautions;
        for (const std::string& caution : cautions_)
            cautions += (cautions.empty() ? "" : "; ") + caution;
        return cautions.empty() ? text : text + " Caution: " + cautions + ".";
    }

private:
    /// Returns the time of the frame that drew the maps which a warm one finds; "" for a cold one.
    std::string firstFrame(const MeasuredVariant& v) const {
        const size_t at = v.label.find(" warm");
        if (at == std::string::npos)
            return "";
        std::string cold = v.label;
        cold.erase(at, 5);
        for (const MeasuredVariant& other : variants_)
            if (other.label == cold)
                return formatted(" (a later frame of the same view; the first takes %.1f ms)",
                                 other.timeMs);
        return " (a later frame of the same view, whose maps are drawn)";
    }

    /// Returns what the text calls a variant.
    std::string shownOf(const std::string& label) const {
        for (const MeasuredVariant& v : variants_)
            if (v.label == label)
                return v.shown;
        return label;
    }

    /// @param detail of this variant, in brackets; may be ""
    void distrust(const MeasuredVariant& v, const std::string& reason, const std::string& detail) {
        notTrusted_.push_back({{"label", v.label}, {"reason", reason}, {"detail", detail}});
    }

    /// Returns the variants that are not trusted, by reason.
    std::string distrustText() const {
        constexpr size_t kMostNames = 5;
        std::vector<std::pair<std::string, std::vector<std::string>>> reasons;
        for (const Json& one : notTrusted_) {
            const std::string reason = one["reason"], detail = one["detail"];
            auto found = std::find_if(reasons.begin(), reasons.end(),
                                      [&](const auto& of) { return of.first == reason; });
            if (found == reasons.end())
                found = reasons.insert(reasons.end(), {reason, {}});
            found->second.push_back(shownOf(one["label"]) +
                                    (detail.empty() ? "" : " (" + detail + ")"));
        }
        std::string text;
        for (const auto& [reason, names] : reasons) {
            text += (text.empty() ? " Not trusted: " : "; ") + reason + ": ";
            for (size_t i = 0; i < std::min(kMostNames, names.size()); ++i)
                text += (i == 0 ? "" : ", ") + names[i];
            if (names.size() > kMostNames)
                text += " and " + std::to_string(names.size() - kMostNames) + " more";
        }
        return text.empty() ? text : text + ".";
    }

    void sort(const MeasuredVariant& v) {
        if (least_.label.empty() || v.wrongShare() < least_.wrongShare())
            least_ = v;
        if (v.wrongShare() > kVerdictWrongShare)
            distrust(v, "more than " + percent(kVerdictWrongShare) + " of the pairs are wrong",
                     percent(v.wrongShare()));
        else if (v.hasFullPool)
            distrust(v, "the page pool was full, so that maps are coarser than requested", "");
        else if (v.needsCosts)
            distrust(v, "routes by costs that were measured in the same frame", fasterThan(v));
        else
            (v.spreadMs() > kVerdictSpread * v.timeMs ? spread_ : open_).push_back(v);
    }

    /// Trusts the times that vary of variants whose slowest run was faster than every run of those
    /// that do not vary: they are faster, however uncertain by how much.
    void trustClearlyFaster() {
        double fastestMs = std::numeric_limits<double>::infinity();
        for (const MeasuredVariant& v : open_)
            fastestMs = std::min(fastestMs, v.minMs);
        if (open_.empty())
            return; // nothing to be faster than
        const auto rest =
            std::stable_partition(spread_.begin(), spread_.end(),
                                  [&](const MeasuredVariant& v) { return v.maxMs >= fastestMs; });
        for (auto v = rest; v != spread_.end(); ++v) {
            cautions_.push_back("the time of " + v->label + " varies by " +
                                percent(v->spreadMs() / v->timeMs) +
                                " of its median, but its slowest run is faster than all runs of "
                                "variants whose times do not");
            open_.push_back(*v);
        }
        spread_.erase(rest, spread_.end());
    }

    /// Returns which variant with no more errors is faster than one with measured routes; "" if
    /// none is.
    std::string fasterThan(const MeasuredVariant& v) const {
        const MeasuredVariant* other = fasterThanRoutes(v, variants_);
        return other == nullptr
                   ? ""
                   : "slower than " + other->shown + ", so its costs do not predict this frame";
    }

    void findCautions() {
        uint64_t pairs = UINT64_MAX, repeats = UINT64_MAX;
        std::optional<double> otherCpuShare;
        for (const MeasuredVariant& v : variants_) {
            pairs = std::min(pairs, v.pairCount);
            repeats = std::min(repeats, v.repeatCount);
            otherCpuShare = std::max(otherCpuShare, v.otherCpuShare);
        }
        if (pairs > 0 && pairs < kFewPairCount)
            cautions_.push_back(fewPairsWarning(scene_, pairs));
        if (repeats < 2)
            cautions_.push_back("times were measured once, so their spread is unknown; "
                                "use --repeats 5");
        if (const std::string busy = busyRemark(otherCpuShare); !busy.empty())
            cautions_.push_back(busy);
    }

    /// Takes the best of the open variants out; one without a label if there is none.
    MeasuredVariant take() {
        const auto fastest = std::min_element(
            open_.begin(), open_.end(),
            [](const MeasuredVariant& a, const MeasuredVariant& b) { return a.timeMs < b.timeMs; });
        if (fastest == open_.end())
            return {};
        auto best = fastest;
        for (auto v = open_.begin(); v != open_.end(); ++v)
            if (!isFaster(*fastest, *v) && v->wrongShare() < best->wrongShare())
                best = v;
        MeasuredVariant taken = *best;
        open_.erase(best);
        return taken;
    }

    std::string scene_;
    std::vector<MeasuredVariant> variants_, open_, spread_;
    MeasuredVariant use_, second_, least_;
    Json notTrusted_ = Json::array();
    std::vector<std::string> cautions_;
};

/// Returns the variants of a scene in the order of the runs.
std::vector<MeasuredVariant> variantsOf(const Json& runs, const std::string& scene) {
    std::vector<MeasuredVariant> variants;
    for (const Json& run : runs) {
        if (run.at("scene") != scene || !run.contains("time_ms"))
            continue;
        const std::string label = run.at("label");
        auto found = std::find_if(variants.begin(), variants.end(),
                                  [&](const MeasuredVariant& v) { return v.label == label; });
        if (found == variants.end())
            found = variants.insert(variants.end(), MeasuredVariant{.label = label});
        found->add(run);
    }
    for (MeasuredVariant& v : variants)
        v.finish();
    for (MeasuredVariant& v : variants)
        if (v.needsCosts && fasterThanRoutes(v, variants) != nullptr)
            v.shown = measuredRoutesLabel(v.label);
    return variants;
}

/// Returns the scenes of runs in their order.
std::vector<std::string> scenesOf(const Json& runs) {
    std::vector<std::string> scenes;
    for (const Json& run : runs)
        if (const std::string scene = run.at("scene");
            std::find(scenes.begin(), scenes.end(), scene) == scenes.end())
            scenes.push_back(scene);
    return scenes;
}

} // namespace

void nameMeasuredRoutes(Json& results) {
    Json& runs = results.at("runs");
    for (const std::string& scene : scenesOf(runs))
        for (const MeasuredVariant& v : variantsOf(runs, scene))
            for (Json& run : runs)
                if (v.shown != v.label && run.at("scene") == scene && run.at("label") == v.label)
                    run["shown_as"] = {{"label", v.shown},
                                       {"model", kMeasuredRoutes},
                                       {"why", kWhyMeasuredRoutes}};
}

Json verdictOf(const Json& results) {
    const Json& provenance = results.at("provenance");
    const auto said = [&](const char* key) {
        const Json value = provenance.value(key, Json());
        return value.is_string() ? value.get<std::string>() : jsonLine(value);
    };
    const std::string where = "at " + results.at("experiment").at("size").get<std::string>() +
                              ", backend " + said("backend") + ", " + said("thread_count") +
                              (said("thread_count") == "1" ? " thread of " : " threads of ") +
                              said("cpu");
    Json verdict = {
        {"text", ""}, {"wrong_share_bound", kVerdictWrongShare}, {"scenes", Json::array()}};
    std::string text;
    for (const char* list : {"runs", "sequence_runs"}) {
        const Json runs = results.value(list, Json::array());
        for (const std::string& scene : scenesOf(runs)) {
            const SceneVerdict of(scene, variantsOf(runs, scene));
            verdict["scenes"].push_back(of.json());
            text += (text.empty() ? "" : "\n") + of.text(where);
        }
    }
    verdict["text"] = text;
    return verdict;
}

} // namespace shadowdag
