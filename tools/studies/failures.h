// SPDX-License-Identifier: Apache-2.0
// Studies of kind "failures": every known failure of shadow maps and voxel rays, as a scene, by
// every method, with the remedy against it switched on and off; the recorded counts of each cell,
// and its bounds.
//
// A cell is a scene rendered at 256 x 144 by one method with one choice of settings (cell_setup.h),
// each pair compared with Embree.
#pragma once

#include "tools/studies/cell_counts.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// A remedy that must be visible: with it off, `measure` of that method's cell is more than
/// `factor` times its value with it on, and more than 20.
struct RemedySeen {
    MatrixMethod method;
    CellMeasure measure;
    double factor;
};

/// A row. All texts except scene and settings are for readers of the report.
struct Failure {
    std::string name;    ///< unique
    std::string listed;  ///< rows of the list of failures, as "1" or "14, 15"; "ours": found here
    std::string scene;   ///< SCENE
    std::string what;    ///< one sentence: which method fails at what, and why
    std::string remedy;  ///< one sentence: what helps, and what it costs
    std::string source;  ///< who described failure or remedy
    std::string always;  ///< settings of all cells
    std::string off, on; ///< additional settings; both "": no option helps, one cell per method
    std::vector<RemedySeen> seen = {};
    double startSeconds = 0.0, stepSeconds = 0.0;
    int frameCount = 1;
    std::vector<KnownCell> known = {};
    bool isBounded = true; ///< false: for a user's scene, without recorded counts

    bool hasRemedy() const { return !on.empty(); }
};

/// A failure without a scene: a test with an injected size, hash or ray shows it.
struct UnitTestedFailure {
    std::string listed, what, test;
};

struct FailureTable {
    std::vector<Failure> rows;
    std::vector<UnitTestedFailure> tests;
    Slack slack;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
FailureTable readFailures(const StudyFile& file);

/// Measures a row. Returns {"cells": [...], "remedies": [...], "pictures": [...], "left_out":
/// [...]}: one object per cell with its counts, "bounds" and "broken" (the names of the measures
/// above their bounds, or "unknown" for a cell without recorded counts), one per remedy to be
/// verified with "is_seen", and one per failure with its truth's file.
Json measureFailure(const Failure& row, const Slack& slack, const StudyRequest& request,
                    const Console& console);

/// Returns one line per cell that exceeds its bounds and per remedy that is not visible.
std::vector<std::string> failureLines(const Json& results);

std::unique_ptr<Study> makeFailureStudy(const StudyFile& file, const StudyRequest& request,
                                        const Console& console);

} // namespace shadowdag
