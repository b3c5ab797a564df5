// SPDX-License-Identifier: Apache-2.0
// The counts of a cell of a study, and their bounds: the recorded counts and a small slack.
// tools/studies/update_known.py writes the recorded counts into the study's file.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/studies/cell_setup.h"
#include "tools/studies/study_file.h"

#include <array>
#include <vector>

namespace shadowdag {

/// The bounded counts of a cell, over all of its frames.
enum class CellMeasure : uint8_t {
    kFalseShadow, ///< as validate counts, as the next five
    kFalseLight,
    kUnexplained, ///< false shadow and false light together
    kAcne,
    kContact,
    kMagnified,
    kMissingTap, ///< taps on pages without memory
    kMeanError,  ///< mean |visibility - Embree's|, in millionths
    kFlicker     ///< results that change from one frame to the next while Embree's do not
};
constexpr int kCellMeasureCount = 9;
inline constexpr const char* kCellMeasureNames[kCellMeasureCount] = {
    "false_shadow_count", "false_light_count",     "unexplained_count",
    "acne_count",         "contact_count",         "magnified_count",
    "missing_tap_count",  "mean_error_millionths", "flicker_count"};
using CellCounts = std::array<uint64_t, kCellMeasureCount>;

/// Returns the measures of a cell's pairs; the last two are its missing taps and flicker.
CellCounts cellCounts(const ErrorCounts& errors, uint64_t missingTapCount, uint64_t flickerCount);

/// The recorded counts of a cell, measured on the CPU.
struct KnownCell {
    MatrixMethod method;
    bool isOn = true; ///< with the remedy, if the row has one
    CellCounts counts{};
};

/// Returns the cell of a method and side, or null.
const KnownCell* findKnown(const std::vector<KnownCell>& cells, MatrixMethod method, bool isOn);

/// The slack of a cell over its recorded counts: a share of them, and a count.
struct Slack {
    double share = 0.05;
    uint64_t count = 3, meanErrorMillionths = 20; ///< the latter of kMeanError
};

/// Returns the bounds of a cell.
CellCounts boundOf(const CellCounts& known, const Slack& slack);

/// Reads the key "slack" of a study: share, count, mean_error_millionths.
Slack readSlack(StudyReader& study);

/// Reads the key "known" of a row: a list of cells by method, in rows with a remedy also by
/// "remedy", "off" or "on"; missing counts are 0.
std::vector<KnownCell> readKnown(StudyReader& row, bool hasRemedy);

} // namespace shadowdag
