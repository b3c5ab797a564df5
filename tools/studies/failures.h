// SPDX-License-Identifier: Apache-2.0
// The matrix of failures: every known failure of shadow maps and voxel rays, as a scene, by every
// method, with the remedy against it switched on and off; what is known of each cell, and what a
// cell may be at most.
//
// A cell is a scene rendered at 256 x 144 by one method with one choice of settings, each pair held
// against Embree. Settings are texts, "bias=8 taps=1"; failureSettings() lists their keys. Most are
// options of render and compare under the same name. Three remedies have no option, since nobody
// wants to be without them: receiver_plane, movers and redraw. They are taken out by asking the
// pairs of the frame once more without them; nothing else of the frame changes.
#pragma once

#include "hybrid/judge/error.h"
#include "hybrid/routing/cost_model.h"
#include "tools/settings/json.h"

#include <array>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace shadowdag {

enum class MatrixMethod : uint8_t { kMaps, kDag, kDagExact, kHybrid };
constexpr int kMatrixMethodCount = 4;
inline constexpr const char* kMatrixMethodNames[kMatrixMethodCount] = {"maps", "dag", "dag-exact",
                                                                       "hybrid"};

/// What is counted in a cell and bounded. Over all frames of the cell.
enum class CellMeasure : uint8_t {
    kFalseShadow, ///< as validate counts, as the next four
    kFalseLight,
    kUnexplained, ///< false shadow and false light together
    kAcne,
    kContact,
    kMissingTap, ///< taps on pages without memory
    kMeanError,  ///< mean |visibility - Embree's|, in millionths
    kFlicker     ///< answers that change from a frame to the next where Embree's do not
};
constexpr int kCellMeasureCount = 8;
inline constexpr const char* kCellMeasureNames[kCellMeasureCount] = {
    "false_shadow_count", "false_light_count", "unexplained_count",     "acne_count",
    "contact_count",      "missing_tap_count", "mean_error_millionths", "flicker_count"};
using CellCounts = std::array<uint64_t, kCellMeasureCount>;

/// Returns what counts add up to, of a cell's pairs; the last two are its missing taps and flicker.
CellCounts cellCounts(const ErrorCounts& errors, uint64_t missingTapCount, uint64_t flickerCount);

/// A remedy that must be seen: with it off, `measure` of that method's cell is more than `factor`
/// times what it is with it on, and more than 20.
struct RemedySeen {
    MatrixMethod method;
    CellMeasure measure;
    double factor;
};

/// A row of the matrix. All texts are for readers of the report but scene and settings.
struct Failure {
    std::string name;    ///< of letters, digits and '-'; unique
    std::string listed;  ///< rows of the list of failures, as "1" or "14, 15"; "ours": found here
    std::string scene;   ///< of failScenes()
    std::string what;    ///< one sentence: which method fails at what, and why
    std::string remedy;  ///< one sentence: what helps, and what it costs
    std::string source;  ///< who described failure or remedy
    std::string always;  ///< settings of all cells
    std::string off, on; ///< settings on top; both "": no option helps, there is one cell a method
    std::vector<RemedySeen> seen = {}; ///< empty exactly where there is no remedy
    double startSeconds = 0.0, stepSeconds = 0.0;
    int frameCount = 1;

    bool hasRemedy() const { return !on.empty(); }
};

/// Returns all rows, in the order of the list of failures.
const std::vector<Failure>& failures();

/// A failure that no scene shows: a test with an injected size, hash or ray does.
struct UnitTestedFailure {
    std::string listed, what, test;
};
const std::vector<UnitTestedFailure>& unitTestedFailures();

/// One setting that rows may name.
struct FailureSetting {
    std::string key, help;
    std::vector<MatrixMethod> readBy;
};
const std::vector<FailureSetting>& failureSettings();

/// What a cell is rendered with.
struct CellSetup {
    FrameOptions frame;
    uint32_t resolutionLog2 = 9;
    float hybridTexels = 96; ///< the hybrid's threshold
    bool keepsFrames = true; ///< false: hysteresis and kept maps are forgotten before each frame
    bool hasPlane = true, hasMovers = true, redraws = true;
};

/// Returns the settings of the texts, each on top of those before it. Throws Error kUsage for an
/// unknown key and for a value that is none.
CellSetup cellSetup(const std::vector<std::string>& settings);

/// Returns the cost model that serves lights by a method, and, of dag-exact, lets the setup's rays
/// be exact.
std::unique_ptr<CostModel> modelOf(MatrixMethod method, CellSetup& setup);

/// Returns whether the method reads any key of the settings: if not, its cell with the remedy off
/// is the one with it on and is not rendered.
bool readsAny(MatrixMethod method, const std::string& settings);

/// What was measured of a cell once, on the CPU; the table is written by
/// tools/report/failure_known.py.
struct KnownCell {
    const char* failure;
    MatrixMethod method;
    bool isOn;
    CellCounts counts;
};
const std::vector<KnownCell>& knownCells();

/// Returns what a cell may be at most: what is known and a twentieth, and 3 more (20 of
/// kMeanError).
CellCounts boundOf(const CellCounts& known);

/// What to measure, and where pictures go.
struct MatrixRequest {
    Backend backend = Backend::kCpu;
    std::vector<std::string> names;       ///< of failures; empty: all
    std::string pictureDirectory;         ///< "" for none; else files are written there
    std::function<void(double)> progress; ///< told the share that is done; may be empty
};

/// Returns the rows of these names, in order; all of none. Throws Error kUsage for an unknown one.
std::vector<const Failure*> failuresNamed(const std::vector<std::string>& names);

/// Measures rows. Returns {"cells": [...], "remedies": [...], "pictures": [...]}: one object a cell
/// with its counts, "bounds" and "broken" (the names of the measures over their bounds, or
/// "unknown": the cell is not in the table), one a remedy to be seen with "is_seen", and one a
/// failure with its truth's file. Counts depend on nothing but the rows. Throws Error kUsage for an
/// unknown name.
Json measureFailures(const MatrixRequest& request);

/// Returns one line a cell that does not hold and a remedy that is not seen.
std::vector<std::string> brokenLines(const Json& matrix);

/// Returns the texts of all rows and of failures that no scene shows: what "study" of failures.json
/// holds and the page quotes.
Json failuresStudy();
/// Returns what "settings" of failures.json holds: what each setting is.
Json failureSettingHelps();

/// What `compare failures` was asked for.
struct FailuresCommand {
    std::string output;
    std::string names; ///< comma-separated; "": all
    Backend backend = Backend::kCpu;
};
class Console;

/// Thrown when all work is done and its results do not hold; the message names what. Not an Error:
/// nothing was asked wrongly and nothing is missing.
struct NotHeld : std::runtime_error {
    using std::runtime_error::runtime_error;
    static constexpr int kExitStatus = 5;
};

/// Throws NotHeld where brokenLines names anything: how much, the first of it, and the report.
void requireHeld(const Json& matrix, const std::string& report);

/// Measures, writes the report and says what does not hold. Throws NotHeld when anything does not,
/// the report standing.
void runFailures(const FailuresCommand& command, const Console& console);

} // namespace shadowdag
