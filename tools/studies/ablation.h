// SPDX-License-Identifier: Apache-2.0
// Studies of kind "ablation": the gain of each mechanism. Every variant, remedy and term of the
// cost model is switched off and on over scenes and over the failures that it is a remedy for.
// Time, error and bytes are measured and judged by one rule.
//
// A side of a mechanism is a choice of settings (cell_setup.h). Errors, counts and bytes are exact
// and come from one run of either side, which is timed as well. For mechanisms that should gain
// time, runs are repeated, off, on, off, on, so that a machine that slows down affects both
// equally.
#pragma once

#include "hybrid/routing/cost_fit.h"
#include "tools/studies/failures.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The quantity that a mechanism should reduce.
enum class GainMetric : uint8_t {
    kTime,        ///< of the whole frame
    kError,       ///< mean |visibility - Embree's|
    kBytes,       ///< of pages, tables, voxels and other data of rays
    kTriangles,   ///< drawn into maps
    kTexels,      ///< of pages with memory
    kFalseShadow, ///< pairs
    kFalseLight,  ///< pairs
    kFlicker,     ///< results that change from frame to frame while Embree's do not
    kFlip,        ///< FLIP of the picture against the truth's
    kWrong        ///< pairs, false shadow and false light together
};
constexpr int kGainMetricCount = 10;
inline constexpr const char* kGainMetricNames[kGainMetricCount] = {"time_ms",
                                                                   "mean_abs_visibility_error",
                                                                   "bytes",
                                                                   "triangle_draw_count",
                                                                   "texel_count",
                                                                   "false_shadow_count",
                                                                   "false_light_count",
                                                                   "flicker_count",
                                                                   "flip",
                                                                   "wrong_pair_count"};

/// A row. All texts except settings and shownBy are for readers of the report.
struct Mechanism {
    std::string name; ///< unique
    std::string what; ///< one sentence: what it does and its intended gain
    MatrixMethod method;
    GainMetric metric;
    std::string always, off, on; ///< settings
    /// Settings of which a default frame has at least one if it has the mechanism by default; empty
    /// if only the method or the threshold decides.
    std::vector<std::string> defaultIf = {};
    std::vector<std::string> shownBy = {}; ///< names of failures that it is a remedy for
    bool isSequence = false;               ///< frames in order, with state kept between them
    std::string keptFor = "";              ///< reason to keep it without a gain; "": none
    std::string source = "";
    /// The measure of its price in error. For a filter it is kFlip: its results at outlines are
    /// fractional by intent, which a mean of |visibility - Embree's| counts as errors.
    GainMetric errorMetric = GainMetric::kError;
    /// Returns whether pictures have to be compared.
    bool asksFlip() const {
        return metric == GainMetric::kFlip || errorMetric == GainMetric::kFlip;
    }
};

/// Returns whether a default frame has the mechanism; null if defaultIf is empty.
Json isDefault(const Mechanism& row);

struct AblationTable {
    std::vector<Mechanism> rows;
    std::vector<Failure> failures; ///< that rows are shown by
    std::vector<std::string> scenes;
    uint32_t width = 320, height = 180;
    uint32_t resolutionLog2 = 11; ///< voxels an axis of the scenes
    int sequenceFrames = 4;       ///< counted; one more leads in
    int repeats = 3; ///< timed runs of either side for rows that should gain time, else 1; 0: no
                     ///< times, and no row that should gain any
    bool hasTerms = true; ///< terms of the cost model are judged as well
    Backend backend = Backend::kCpu;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
AblationTable readAblation(const StudyFile& file);

/// A gain: the natural logarithm of the cost without the mechanism over the cost with it, and its
/// standard error. Above 0 it pays.
struct Gain {
    double log = 0, spread = 0;
};

/// Returns the gain of repeated runs of both sides, run by run: median and standard error of the
/// logarithms; of one run the error is 0. Both have one time a run, at least one, over 0.
Gain gainOfRuns(const std::vector<double>& offMs, const std::vector<double>& onMs);

/// Returns the gain of counts or other exact values, each with `floor` added, so that none is 0.
Gain gainOf(double off, double on, double floor);

/// Returns the mean gain over scenes. Its spread joins the standard error of the mean over scenes
/// with that of the scenes themselves; no scenes: 0, without spread.
Gain meanGain(const std::vector<Gain>& scenes);

/// The verdict about a mechanism.
enum class MechanismVerdict : uint8_t {
    kOn,     ///< default on
    kOption, ///< default off: it pays, but its price is a choice
    kKept,   ///< default off: no gain, but it is needed
    kDelete  ///< no gain, and it is not needed
};
inline constexpr const char* kMechanismVerdictNames[] = {"default on", "default off, an option",
                                                         "default off, kept for the comparison",
                                                         "to be deleted"};

/// The evidence of a verdict, one entry per scene.
struct MechanismEvidence {
    std::vector<Gain> own;                ///< in its own metric, built-in scenes
    std::vector<Gain> ownOnFailures;      ///< the same in the failures that it is a remedy for
    std::vector<Gain> time, error, bytes; ///< built-in scenes; empty if it cannot be measured
};

/// A verdict with its evidence.
struct Judgement {
    MechanismVerdict verdict = MechanismVerdict::kDelete;
    Gain own, time, error, bytes; ///< means over built-in scenes
    double bestOnFailures = 0;    ///< the largest gain in a failure
    std::string reason;           ///< one sentence
};

/// The rule. A mechanism *pays* when its mean gain in its own metric over the built-in scenes
/// exceeds twice its spread and one percent; it *helps* when it gains at least a fifth, and twice
/// its spread, in a failure that it is a remedy for. A metric is *worse* when its mean loss exceeds
/// twice its spread and five percent. A mechanism that pays is on if the error is not worse and
/// neither time nor bytes are worse by more than it gains (if its own metric is an error, that is
/// its price; a filter's error is FLIP); one that only helps is on if none of the three is worse.
/// Otherwise a mechanism that pays or helps is an option. One that does neither is deleted, or kept
/// if it is needed.
Judgement judge(const MechanismEvidence& evidence, bool isKept);

/// The measurements of a mechanism on a scene.
struct SceneGains {
    Gain own, time, error, bytes;
    bool hasTime = false;
};

/// Measures rows on one scene. Returns {"rows": [...], "observed": [...]}: one object per row with
/// the counts of both sides, their ratios, and its gains (gainsJson); and frames for the terms of
/// the cost model, if there are any.
/// @param failure the failure of the scene, or null; then only rows that it shows are measured
Json measureAblation(const AblationTable& table, const std::string& scene, const Failure* failure,
                     const StudyRequest& request, const Console& console);

Json gainsJson(const SceneGains& gains);
SceneGains gainsFromJson(const Json& json);

/// Returns the terms of the cost model as rows, in the form of the study's results: "on" is the
/// form that a fit over the frames keeps, "off" is that form without the term; for a term that it
/// does not keep, "on" is that form with it. Times are the measured times of maps by the method
/// that the form chooses for them, fitted to the other frames.
/// @param observed frames of several scenes, each measured by both methods; at least two
Json judgeCostTerms(const std::vector<ObservedFrame>& observed,
                    const std::vector<std::string>& names);

/// Returns the names of the rows of judgeCostTerms.
std::vector<std::string> costTermNames();

/// Judges a row, which must have "is_default", and writes the verdict into it: mean ratios on/off
/// and their spreads for which there is evidence, "verdict", "reason", "agrees" (the default
/// matches the verdict).
void addJudgement(const MechanismEvidence& evidence, bool isKept, Json& json);

/// Returns one line per mechanism whose default contradicts its verdict, and one per mechanism that
/// is to be deleted.
std::vector<std::string> disagreements(const Json& results);

/// Returns one line per mechanism and scene: names, settings, ratios and verdict.
std::string mechanismsCsv(const Json& results);

std::unique_ptr<Study> makeAblationStudy(const StudyFile& file, const StudyRequest& request,
                                         const Console& console);

/// Returns the settings of both sides of a row. Settings that keep state do not apply to a single
/// frame.
std::string alwaysOf(const Mechanism& row);

} // namespace shadowdag
