// SPDX-License-Identifier: Apache-2.0
// Studies of kind "stability": how stable errors are in time, under perturbation, numerically, and
// over resolution; and the band that each number must stay in, with the reason for it.
//
// A group, a row of the study, is one scene in one part. Everything but the numeric part is held
// against Embree by the metrics of validate (hybrid/judge/error.h, hybrid/judge/flicker.h). The
// numeric part is held against integers without rounding.
//
// A share of nothing is 0 and would lie in every band that begins there. So who has nothing to
// judge, or no shadow to judge it by, is refused (requireEvidence), not held.
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
    /// Outlines whose place in their voxel or texel is their own, about: four a box. Of an outline
    /// the error is anywhere between none and a whole voxel.
    int outlineCount = 0;
    std::string kind = {}; ///< of its rows, which bands go by; of a perturbation what follows the
                           ///< case's
    double resolvedAt = 1e30;  ///< voxels up to this size, scene units, tell its parts apart
    std::string settings = {}; ///< of all its rows; a threshold as the study's width wants it
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

/// What a band is derived from, under these names in its formulas. Shares are of the pairs, or of
/// the answers followed.
struct BandInputs {
    double base = 0;  ///< base: the same measure unperturbed, or where less is held
    double count = 1; ///< n: pairs, answers or points that the share or rate is of, 1 at least
    double voxelSpacing = 0, texelSpacing = 0; ///< voxel_spacing, texel_spacing: of floats at the
                                               ///< largest coordinate, in these
    double voxelRatio = 1, texelRatio = 1; ///< voxel_ratio, texel_ratio: over the unperturbed ones
    double outlineCount = 1;               ///< StabilityGroup::outlineCount
    double truthChange = 0;                ///< truth_change: answers that Embree changes itself
    double reachTexels = 1; ///< reach_texels: how far shifts go that explain errors of maps
    double wrongShare = 0;  ///< wrong_share: unperturbed
};

/// One band: where a measure of some cases must lie.
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

/// Returns the ends of a band for a row's method. Beside the names of BandInputs formulas know a =
/// 1.73 / sqrt(outlines), what the error may move by when only the places of outlines change, and
/// s, the spacing of floats in the unit that the method answers in. Throws Error kUsage for a
/// formula that is none.
std::pair<double, double> limitsOf(const StabilityBand& band, MatrixMethod method,
                                   const BandInputs& inputs);

/// A check that no band is derived for, or that is known to leave it: what was measured, give or
/// take a little, and the cause.
struct KnownBreak {
    std::string group, kind, method, measure;
    double low, high;
    std::string reason;
};

struct StabilityTable {
    std::vector<StabilityGroup> groups;
    std::vector<StabilityBand> bands;
    std::vector<KnownBreak> known; ///< each is in force in place of a band
    std::vector<TimeCase> cases;
    std::vector<Perturbation> perturbations;
    std::vector<double> undersamples; ///< of maps over resolution
    int frameCount = 16;
    double stepSeconds = 0.1;
    /// Pixels a row that thresholds of settings are meant for.
    uint32_t settingsWidth = 512;
    /// Pixels a row: of a perturbation and of failure scenes over resolution; other built-in scenes
    /// and frames in time have half as many. Rows of pixels are 9/16 as many.
    uint32_t width = 512;
    /// Over resolution, the finest voxels: from 64 to 2 to the power of this an axis, 8 at least.
    uint32_t finestVoxelsLog2 = 12;
    Backend backend = Backend::kCpu;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
StabilityTable readStability(const StudyFile& file);

/// Returns the groups of these names and of parts of these names, in order; all of none. Throws
/// Error kUsage for a name that adds none.
std::vector<StabilityGroup> stabilityGroupsNamed(const StabilityTable& table,
                                                 const std::vector<std::string>& names);

/// Adds to `checks` what the table that applies says of a row's measure, or nothing where none
/// does.
/// @param row with group, case, kind, method and the measures
void addChecks(const StabilityTable& table, Json& checks, StabilityPart part, const Json& row,
               const std::string& measure, double value, const BandInputs& inputs);

/// Throws Error kInput unless a group's row has pairs, some of them dark and some lit by the truth.
void requireEvidence(const Json& row, uint64_t pairCount, uint64_t occludedCount);

/// Returns part / whole. Throws Error kInput, naming the group's row and what `whole` counts, where
/// there is none.
double shareOf(const Json& row, const char* what, uint64_t part, uint64_t whole);

/// Slope of log2 y over log2 x by least squares.
struct FittedRate {
    double slope = 0, standardError = 0;
    double leastLocal = 0, greatestLocal = 0; ///< slopes between neighbouring points
    size_t pointCount = 0;
};

/// Returns the slope through points of positive x and y, ascending or descending in x; others are
/// left out. Throws Error kUsage when fewer than three are left.
FittedRate fitRate(const std::vector<std::pair<double, double>>& points);

/// Measures a group. Returns {"time": rows, "perturbation": rows, "numeric": rows, "resolution":
/// rows, "rates": [...], "checks": [...]}: a check has its value, "low", "high", "holds", "band"
/// (the id, or "known") and reason. Throws Error kInput where a group has nothing to judge.
Json measureStability(const StabilityTable& table, const StabilityGroup& group);

/// Returns one line a check that does not hold.
std::vector<std::string> unstableLines(const Json& results);

std::unique_ptr<Study> makeStabilityStudy(const StudyFile& file, const StudyRequest& request,
                                          const Console& console);

// Of the parts, for measureStability: each adds rows and checks of one group to the results.
void measureTime(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measurePerturbation(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measureNumeric(const StabilityTable& table, const StabilityGroup& group, Json& results);
void measureResolution(const StabilityTable& table, const StabilityGroup& group, Json& results);

/// Returns the settings of a group's rows: with its threshold as much lower as the width, which
/// requests of texels go with, is less than what settings are meant for.
std::vector<std::string> stabilitySettings(const StabilityTable& table,
                                           const StabilityGroup& group);

/// Returns the scene of a group. Throws Error kUsage where its lights are to move and it is no
/// failure scene.
Scene stabilityScene(const StabilityGroup& group);

} // namespace shadowdag
