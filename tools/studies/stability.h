// SPDX-License-Identifier: Apache-2.0
// How stable errors are: in time, under perturbation, numerically, and over resolution; and the
// band that each number must stay in, with the reason for it.
//
// A group is one scene in one part. Everything but the numeric part is held against Embree by the
// metrics of validate (hybrid/judge/error.h, hybrid/judge/flicker.h): perturbations, and failure
// scenes over resolution, in frames of 512 x 288, frames in time and built-in scenes in 256 x 144
// (StabilityRequest::width). The numeric part is held against integers without rounding.
//
// A share of nothing is 0 and would lie in every band that begins there. So who has nothing to
// judge, or no shadow to judge it by, is refused (requireEvidence), not held.
#pragma once

#include "tools/studies/failures.h"

#include <functional>
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
    std::string scene; ///< of failScenes() or built in; "": none
    std::string what;  ///< one sentence for readers of the report
    /// Outlines whose place in their voxel or texel is their own, about: four a box. Of an outline
    /// the error is anywhere between none and a whole voxel.
    int outlineCount = 0;
    std::string kind =
        {}; ///< of its rows, which bands go by; of a perturbation what follows the case's
    double resolvedAt = 1e30; ///< voxels up to this size, scene units, tell its parts apart
    /// Of all its rows, as those of the matrix of failures; a threshold as kStabilityWidth wants
    /// it.
    std::string settings = {};
};

/// Returns all groups in the order of the report.
const std::vector<StabilityGroup>& stabilityGroups();

/// Returns the groups of these names and of parts of these names, in order; all of none. Throws
/// Error kUsage for a name that adds none.
std::vector<const StabilityGroup*> stabilityGroupsNamed(const std::vector<std::string>& names);

/// What a band is derived from. Shares are of the pairs, or of the answers followed.
struct BandInputs {
    double base = 0;  ///< the same measure unperturbed, or where less is held
    double count = 1; ///< pairs or answers that the share is of
    double voxelSpacing = 0, texelSpacing = 0; ///< of floats at the largest coordinate, in these
    double voxelRatio = 1, texelRatio = 1;     ///< voxel and texel over the unperturbed ones
    double outlineCount = 1;                   ///< StabilityGroup::outlineCount
    double truthChange = 0;                    ///< answers that Embree changes itself, a share
    double reachTexels =
        1; ///< how far shifts that explain errors of maps go (hybrid/judge/explain.h)
    double wrongShare = 0;                       ///< unperturbed
    MatrixMethod method = MatrixMethod::kHybrid; ///< of the row; addChecks sets it
};

/// One band: where a measure of some cases must lie.
struct StabilityBand {
    std::string id; ///< unique
    StabilityPart part;
    std::vector<std::string> kinds; ///< of cases, as rows give them under "kind"
    std::vector<MatrixMethod> methods;
    std::string measure;
    std::string formula; ///< what `limits` computes, for readers
    std::string reason;
    std::pair<double, double> (*limits)(const BandInputs& inputs);
};

/// Returns the one table of bands.
const std::vector<StabilityBand>& stabilityBands();

/// A check that no band is derived for, or that is known to leave it: what was measured, give or
/// take a little, and the cause.
struct KnownBreak {
    std::string group, kind, method, measure;
    double low, high;
    std::string reason;
};

/// Returns the one table of these; each is in force in place of a band.
const std::vector<KnownBreak>& knownBreaks();

/// Adds to `checks` what the table that applies says of a row's measure, or nothing where none
/// does.
/// @param row with group, case, kind, method and the measures
void addChecks(Json& checks, StabilityPart part, const Json& row, const std::string& measure,
               double value, const BandInputs& inputs);

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

constexpr uint32_t kStabilityWidth = 512;

/// What to measure.
struct StabilityRequest {
    Backend backend = Backend::kCpu;
    std::vector<std::string> names; ///< of groups or parts; empty: all
    /// Pixels a row: of a perturbation and of failure scenes over resolution; built-in scenes and
    /// frames in time have half as many. Rows of pixels are 9/16 as many.
    uint32_t width = kStabilityWidth;
    /// Over resolution, the finest voxels: from 64 to 2 to the power of this an axis, 8 at least.
    uint32_t finestVoxelsLog2 = 12;
    std::function<void(double)> progress; ///< told the share that is done; may be empty
};

/// Measures groups. Returns {"time": rows, "perturbation": rows, "numeric": rows, "resolution":
/// rows, "rates": [...], "checks": [...]}: a check has its value, "low", "high", "holds", "band"
/// (the id, or "known") and reason. Numbers depend on nothing but the groups and the request's
/// sizes. Throws Error kUsage for an unknown name and kInput where a group has nothing to judge.
Json measureStability(const StabilityRequest& request);

/// Returns one line a check that does not hold.
std::vector<std::string> unstableLines(const Json& results);

/// Returns the texts of groups, bands and known breaks: what "study" of stability.json holds and
/// the page quotes.
Json stabilityStudy();

/// What `compare stability` was asked for.
struct StabilityCommand {
    std::string output;
    std::string names; ///< comma-separated; "": all
    bool noCharts = false;
    Backend backend = Backend::kCpu;
};

/// Measures, writes the report and says what does not hold. Throws NotHeld when anything does not,
/// the report standing.
void runStability(const StabilityCommand& command, const Console& console);

// Of the parts, for measureStability: each adds rows and checks of one group to the results.
void measureTime(const StabilityGroup& group, const StabilityRequest& request, Json& results);
void measurePerturbation(const StabilityGroup& group, const StabilityRequest& request,
                         Json& results);
void measureNumeric(const StabilityGroup& group, const StabilityRequest& request, Json& results);
void measureResolution(const StabilityGroup& group, const StabilityRequest& request, Json& results);

/// Returns the settings of a group's rows for a request: with its threshold as much lower as the
/// request's width, which requests of texels go with, is less than kStabilityWidth.
std::vector<std::string> stabilitySettings(const StabilityGroup& group,
                                           const StabilityRequest& request);

/// Returns the scene of a group as a failure scene. Throws Error kUsage where it is none.
Scene stabilityScene(const StabilityGroup& group);

} // namespace shadowdag
