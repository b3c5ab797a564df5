// SPDX-License-Identifier: Apache-2.0
// What is counted in a cell of a study, and what it may be at most: what was measured once, and a
// little more. tools/studies/update_known.py writes what was measured into the study's file.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/studies/cell_setup.h"
#include "tools/studies/study_file.h"

#include <array>
#include <vector>

namespace shadowdag {

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

/// What was measured of a cell once, on the CPU.
struct KnownCell {
    MatrixMethod method;
    bool isOn = true; ///< with the remedy, where the row has one
    CellCounts counts{};
};

/// Returns the cell of a method and side, or null.
const KnownCell* findKnown(const std::vector<KnownCell>& cells, MatrixMethod method, bool isOn);

/// How much more than what is known a cell may have: a share of it, and a count.
struct Slack {
    double share = 0.05;
    uint64_t count = 3, meanErrorMillionths = 20; ///< the latter of kMeanError
};

/// Returns what a cell may be at most.
CellCounts boundOf(const CellCounts& known, const Slack& slack);

/// Reads the key "slack" of a study: share, count, mean_error_millionths.
Slack readSlack(StudyReader& study);

/// Reads the key "known" of a row: a list of cells by method, of rows with a remedy also "remedy",
/// "off" or "on"; counts that are not named are 0.
std::vector<KnownCell> readKnown(StudyReader& row, bool hasRemedy);

} // namespace shadowdag
