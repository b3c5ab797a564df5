// SPDX-License-Identifier: Apache-2.0
// Studies of kind "ablation": what each mechanism buys. Every variant, remedy and term that the
// program has is switched off and on over scenes and over the failures that it is a remedy for, in
// time, error and bytes, and judged by one stated rule.
//
// A side of a mechanism is a choice of settings (cell_setup.h). Errors, counts and bytes are exact
// and come from one run of either side, which is timed as well. What should pay in time is run
// again, off, on, off, on, so that a machine that slows down slows both.
#pragma once

#include "hybrid/routing/cost_fit.h"
#include "tools/studies/failures.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// In what a mechanism should pay.
enum class GainMetric : uint8_t {
    kTime,        ///< of the whole frame
    kError,       ///< mean |visibility - Embree's|
    kBytes,       ///< of pages, tables, voxels and what else rays read
    kTriangles,   ///< drawn into maps
    kTexels,      ///< of pages with memory
    kFalseShadow, ///< pairs
    kFalseLight,  ///< pairs
    kFlicker,     ///< answers that change from frame to frame where Embree's do not
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

/// A row. All texts are for readers of the report but settings and shownBy.
struct Mechanism {
    std::string name; ///< unique
    std::string what; ///< one sentence: what it does and what it is meant to buy
    MatrixMethod method;
    GainMetric metric;
    std::string always, off, on; ///< settings
    /// Settings any of which a frame has by default where it has the mechanism by default; empty
    /// where a frame has it only by the method or the threshold that is asked for.
    std::vector<std::string> defaultIf = {};
    std::vector<std::string> shownBy = {}; ///< names of failures that it is a remedy for
    bool isSequence = false;               ///< frames in order, what is kept is kept
    std::string keptFor = "";              ///< what needs it where it buys nothing; "": nothing
    std::string source = "";
    /// What its price in error is taken by. A filter's is kFlip: its answers at outlines are
    /// fractional by intent, which any mean of |visibility - Embree's| counts against it.
    GainMetric errorMetric = GainMetric::kError;
    /// Returns whether pictures have to be compared.
    bool asksFlip() const {
        return metric == GainMetric::kFlip || errorMetric == GainMetric::kFlip;
    }
};

/// Returns whether a frame has the mechanism where nobody says anything; null where defaultIf is
/// empty.
Json isDefault(const Mechanism& row);

struct AblationTable {
    std::vector<Mechanism> rows;
    std::vector<Failure> failures; ///< that rows are shown by
    std::vector<std::string> scenes;
    uint32_t width = 320, height = 180;
    uint32_t resolutionLog2 = 11; ///< voxels an axis of the scenes
    int sequenceFrames = 4;       ///< counted; one more leads in
    int repeats = 3;      ///< timed runs of either side where time should be gained, else 1; 0: no
                          ///< times, and no row that should gain any
    bool hasTerms = true; ///< terms of the cost model are judged as well
    Backend backend = Backend::kCpu;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
AblationTable readAblation(const StudyFile& file);

/// A gain: the natural logarithm of what is spent without over what is spent with the mechanism,
/// and its standard error. Over 0: it pays.
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

/// What became of a mechanism.
enum class MechanismVerdict : uint8_t {
    kOn,     ///< default on
    kOption, ///< default off: it pays, but its price is a choice
    kKept,   ///< default off: it buys nothing here, and is kept for what needs it
    kDelete  ///< it buys nothing and nothing needs it
};
inline constexpr const char* kMechanismVerdictNames[] = {"default on", "default off, an option",
                                                         "default off, kept for the comparison",
                                                         "to be deleted"};

/// What a verdict follows from, one entry a scene.
struct MechanismEvidence {
    std::vector<Gain> own;                ///< in its own metric, built-in scenes
    std::vector<Gain> ownOnFailures;      ///< the same in the failures that it is a remedy for
    std::vector<Gain> time, error, bytes; ///< built-in scenes; empty where it cannot be measured
};

/// A verdict with the numbers that it follows from.
struct Judgement {
    MechanismVerdict verdict = MechanismVerdict::kDelete;
    Gain own, time, error, bytes; ///< means over built-in scenes
    double bestOnFailures = 0;    ///< the largest gain in a failure
    std::string reason;           ///< one sentence
};

/// The rule. A mechanism *pays* when its mean gain in its own metric over the built-in scenes
/// exceeds twice its spread and one percent; it *helps* when it gains a fifth at least, and twice
/// its spread, in a failure that it is a remedy for. A metric is *worse* when its mean loss exceeds
/// twice its spread and five percent. What pays is on when the error is not worse and neither time
/// nor bytes are worse by more than it gains (where its own metric is an error, that is its price;
/// a filter's error is FLIP); what only helps is on when none of the three is worse. What pays or
/// helps otherwise is an option. What does neither is deleted, or kept for what needs it.
Judgement judge(const MechanismEvidence& evidence, bool isKept);

/// What a mechanism gave on a scene.
struct SceneGains {
    Gain own, time, error, bytes;
    bool hasTime = false;
};

/// Measures rows on one scene. Returns {"rows": [...], "observed": [...]}: one object a row with
/// what either side counted and its ratios, and its gains (gainsJson); and frames for the terms of
/// the cost model, where it has any.
/// @param failure the failure whose scene it is, or null; then only rows that it shows are measured
Json measureAblation(const AblationTable& table, const std::string& scene, const Failure* failure,
                     const StudyRequest& request, const Console& console);

Json gainsJson(const SceneGains& gains);
SceneGains gainsFromJson(const Json& json);

/// Returns the terms of the cost model as rows, in the form of the study's results: on is
/// the form that a fit over the frames keeps, off is that form without the term; for a term that it
/// does not keep, on is that form with it. Times are those that maps were measured to take by the
/// method that the form chooses for them, fitted to the other frames.
/// @param observed frames of several scenes, each measured by both methods; at least two
Json judgeCostTerms(const std::vector<ObservedFrame>& observed,
                    const std::vector<std::string>& names);

/// Returns the names of the rows of judgeCostTerms.
std::vector<std::string> costTermNames();

/// Judges and writes that into the row, which must have "is_default": mean ratios on/off and their
/// spreads, of what there is evidence of, "verdict", "reason", "agrees" (the default is as the
/// verdict says).
void addJudgement(const MechanismEvidence& evidence, bool isKept, Json& json);

/// Returns one line a mechanism whose default is not as its verdict says, and one a mechanism that
/// is to be deleted.
std::vector<std::string> disagreements(const Json& results);

/// Returns a line a mechanism and scene: names, settings, ratios and verdict.
std::string mechanismsCsv(const Json& results);

std::unique_ptr<Study> makeAblationStudy(const StudyFile& file, const StudyRequest& request,
                                         const Console& console);

/// Returns the settings of both sides of a row. What a single frame would keep is of no use to it.
std::string alwaysOf(const Mechanism& row);

} // namespace shadowdag
