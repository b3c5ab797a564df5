// SPDX-License-Identifier: Apache-2.0
// Studies of kind "stability": the stability of errors in time, under perturbation, numerically,
// and over resolution; and the band that each number must stay in, with its reason.
//
// A group, a row of the study, is one scene in one part. All parts except the numeric one are
// compared with Embree by the metrics of validate (hybrid/judge/error.h, hybrid/judge/flicker.h).
// The numeric part is compared with exact integers.
//
// A share of nothing is 0 and would lie in every band that begins at 0. Therefore a group without
// pairs, or without a shadow edge, is refused (requireEvidence).
#pragma once

#include "scenes/scene.h"
#include "tools/studies/cell_setup.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

enum class StabilityPart : uint8_t { kTime, kPerturbation, kNumeric, kResolution };
constexpr int kStabilityPartCount = 4;
inline constexpr const char* kStabilityPartNames[kStabilityPartCount] = {"time", "perturbation",
                                                                         "numeric", "resolution"};

/// One scene in one part.
struct StabilityGroup {
    std::string name; ///< part, '-', rest; unique
    StabilityPart part;
    std::string scene; ///< SCENE; "": none
    std::string what;  ///< one sentence for readers of the report
    /// Number of independently placed outlines in voxels or texels, about four per box. The error
    /// of an outline is between none and a whole voxel.
    int outlineCount = 0;
    std::string kind = {}; ///< of its rows, which selects bands; of a perturbation the text after
                           ///< the case's
    double resolvedAt = 1e30;         ///< voxels up to this size, scene units, resolve its parts
    std::string settings = {};        ///< of all its rows; a threshold for the study's width
    bool isOnOtherScene = false;      ///< of the user's: what the row says of its own does not hold
    std::vector<uint32_t> sizes = {}; ///< numeric: voxels an axis of "rays", texels of "faces"
};

/// One way to run a method through the frames of the part "time".
struct TimeCase {
    MatrixMethod method;
    std::string name, settings;
};

/// One motion of the part "perturbation".
struct Perturbation {
    std::string name, kind;
    int part = 0;         ///< of kPerturbedParts; shifted by `by` voxels or texels
    bool isTexel = false; ///< the unit of `by`
    double by = 0, shift = 0, scale = 1, degrees = 0;
    bool isAboutX = true;
};
inline constexpr const char* const kPerturbedParts[] = {"light", "camera", "scene"};

/// The inputs of a band, under these names in its formulas. Shares are of the pairs, or of the
/// followed results.
struct BandInputs {
    double base = 0;  ///< base: the same measure unperturbed, or with less kept
    double count = 1; ///< n: pairs, results or points of the share or rate, 1 at least
    double voxelSpacing = 0, texelSpacing = 0; ///< voxel_spacing, texel_spacing: of floats at the
                                               ///< largest coordinate, in these
    double voxelRatio = 1, texelRatio = 1; ///< voxel_ratio, texel_ratio: over the unperturbed ones
    double outlineCount = 1;               ///< StabilityGroup::outlineCount
    double truthChange = 0; ///< truth_change: results that change in Embree, over those that do not
    double reachTexels = 1; ///< reach_texels: length of the shifts that explain errors of maps
    double wrongShare = 0;  ///< wrong_share: unperturbed
};

/// One band: the range of a measure of some cases.
struct StabilityBand {
    std::string id; ///< unique
    StabilityPart part;
    std::vector<std::string> kinds; ///< of cases, as rows give them under "kind"
    std::vector<MatrixMethod> methods;
    std::string measure;
    std::string low, high; ///< formulas over BandInputs
    std::string formula;   ///< both, for readers
    std::string reason;
};

/// Returns the ends of a band for a row's method. Besides the names of BandInputs formulas know a =
/// 1.73 / sqrt(outlines), the change of the error when only the places of outlines change, and s,
/// the spacing of floats in the method's unit. Throws Error kUsage for an invalid formula.
std::pair<double, double> limitsOf(const StabilityBand& band, MatrixMethod method,
                                   const BandInputs& inputs);

/// A check without a derived band, or with a known exception: the recorded value with a small
/// slack, and the cause.
struct KnownBreak {
    std::string group, kind, method, measure;
    double low, high;
    std::string reason;
};

struct StabilityTable {
    std::vector<StabilityGroup> groups;
    std::vector<StabilityBand> bands;
    std::vector<KnownBreak> known; ///< each replaces a band
    std::vector<TimeCase> cases;
    std::vector<Perturbation> perturbations;
    std::vector<double> undersamples; ///< of maps over resolution
    int frameCount = 16;
    double stepSeconds = 0.1;
    /// Pixels per row for which thresholds of settings are meant.
    uint32_t settingsWidth = 512;
    /// Pixels per row: of a perturbation and of failure scenes over resolution; other built-in
    /// scenes and frames in time have half as many. The number of rows is 9/16 of it.
    uint32_t width = 512;
    /// Over resolution, the finest voxels: from 64 to 2 to the power of this per axis, 8 at least.
    uint32_t finestVoxelsLog2 = 12;
    Backend backend = Backend::kCpu;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
StabilityTable readStability(const StudyFile& file);

/// Returns the groups of these names and of parts of these names, in order; all if there are none.
/// Throws Error kUsage for a name that adds none.
std::vector<StabilityGroup> stabilityGroupsNamed(const StabilityTable& table,
                                                 const std::vector<std::string>& names);

/// Returns one line per band and known entry of the table that matches none of the checks.
/// @param checks of all rows
std::vector<std::string> unmatchedLines(const StabilityTable& table, const Json& checks);

/// Adds the checks of a row's measure to `checks`, from the table that applies, if any.
/// @param row with group, case, kind, method and the measures
void addChecks(const StabilityTable& table, Json& checks, StabilityPart part, const Json& row,
               const std::string& measure, double value, const BandInputs& inputs);

/// Throws Error kInput unless a group's row has pairs, some of them dark and some lit in the truth.
void requireEvidence(const Json& row, uint64_t pairCount, uint64_t occludedCount);

/// Returns part / whole. Throws Error kInput, naming the group's row and what `whole` counts, if it
/// is 0.
double shareOf(const Json& row, const char* what, uint64_t part, uint64_t whole);

/// Slope of log2 y over log2 x by least squares.
struct FittedRate {
    double slope = 0, standardError = 0;
    double leastLocal = 0, greatestLocal = 0; ///< slopes between neighbouring points
    size_t pointCount = 0;
};

/// A rate needs this many points, so that it has a standard error.
constexpr int kRatePoints = 3;

/// Returns the slope through points of positive x and y, ascending or descending in x; other points
/// are ignored. Throws Error kUsage when fewer than kRatePoints remain.
FittedRate fitRate(const std::vector<std::pair<double, double>>& points);

/// Measures a group. Returns {"time": rows, "perturbation": rows, "numeric": rows, "resolution":
/// rows, "rates": [...], "checks": [...]}: a check has its value, "low", "high", "holds", "band"
/// (the id, or "known") and reason. Throws Error kInput if a group has nothing to judge.
Json measureStability(const StabilityTable& table, const StabilityGroup& group);

/// Returns one line per failed check.
std::vector<std::string> unstableLines(const Json& results);

std::unique_ptr<Study> makeStabilityStudy(const StudyFile& file, const StudyRequest& request,
                                          const Console& console);

// Of the parts, for measureStability: each adds rows and checks of one group to the results.
void measureTime(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measurePerturbation(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measureNumeric(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measureResolution(const StabilityTable& table, const StabilityGroup& group, Json& results);

/// Returns the settings of a group's rows, with the threshold reduced in proportion to the width,
/// because requested texels are proportional to it.
std::vector<std::string> stabilitySettings(const StabilityTable& table,
                                           const StabilityGroup& group);

/// Returns the scene of a group. Throws Error kUsage if its lights are to move and it is not a
/// failure scene.
Scene stabilityScene(const StabilityGroup& group);

} // namespace shadowdag
