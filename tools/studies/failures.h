// SPDX-License-Identifier: Apache-2.0
// Studies of kind "failures": every known failure of shadow maps and voxel rays, as a scene, by
// every method, with the remedy against it switched on and off; what is known of each cell, and
// what a cell may be at most.
//
// A cell is a scene rendered at 256 x 144 by one method with one choice of settings (cell_setup.h),
// each pair held against Embree.
#pragma once

#include "tools/studies/cell_counts.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// A remedy that must be seen: with it off, `measure` of that method's cell is more than `factor`
/// times what it is with it on, and more than 20.
struct RemedySeen {
    MatrixMethod method;
    CellMeasure measure;
    double factor;
};

/// A row. All texts are for readers of the report but scene and settings.
struct Failure {
    std::string name;    ///< unique
    std::string listed;  ///< rows of the list of failures, as "1" or "14, 15"; "ours": found here
    std::string scene;   ///< SCENE
    std::string what;    ///< one sentence: which method fails at what, and why
    std::string remedy;  ///< one sentence: what helps, and what it costs
    std::string source;  ///< who described failure or remedy
    std::string always;  ///< settings of all cells
    std::string off, on; ///< settings on top; both "": no option helps, there is one cell a method
    std::vector<RemedySeen> seen = {};
    double startSeconds = 0.0, stepSeconds = 0.0;
    int frameCount = 1;
    std::vector<KnownCell> known = {};
    bool isBounded = true; ///< false: of a scene that the user gave, of which nothing is known

    bool hasRemedy() const { return !on.empty(); }
};

/// A failure that no scene shows: a test with an injected size, hash or ray does.
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
/// [...]}: one object a cell with its counts, "bounds" and "broken" (the names of the measures over
/// their bounds, or "unknown": the row knows nothing of the cell), one a remedy to be seen with
/// "is_seen", and one a failure with its truth's file.
Json measureFailure(const Failure& row, const Slack& slack, const StudyRequest& request,
                    const Console& console);

/// Returns one line a cell that does not hold and a remedy that is not seen.
std::vector<std::string> failureLines(const Json& results);

std::unique_ptr<Study> makeFailureStudy(const StudyFile& file, const StudyRequest& request,
                                        const Console& console);

} // namespace shadowdag
