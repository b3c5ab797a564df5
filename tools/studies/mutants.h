// SPDX-License-Identifier: Apache-2.0
// Studies of kind "mutants": the checks of accuracy, checked. Each row is a fault (cuda/mutant.h)
// that the program commits in a process of its own, while rows of the failure table and comparisons
// of whole frames judge it. A fault that no check notices is a defect of the checks.
#pragma once

#include "cuda/mutant.h"
#include "tools/studies/failures.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The name of the part without a fault, in which every check must be silent.
inline constexpr const char* kNoMutant = "none";

/// A sequence of frames that judges beside the failure table, without recorded counts.
struct MutantFrames {
    Failure row;              ///< its name, scene, settings and times
    bool movesLights = false; ///< as groups of stability of the kind "moving lights" do
};

/// A fault and what judges it.
struct MutantRow {
    std::string name; ///< of the fault
    /// Rows of the failure table and sequences of frames, first those of the study.
    std::vector<std::string> judges;
    std::string harmless; ///< why it is no fault; "" for a fault
};

struct MutantTable {
    std::vector<MutantRow> rows;
    std::vector<Failure> failures; ///< the table that `judges` name rows of
    Slack slack;                   ///< of its bounds
    std::vector<MutantFrames> frames;
    double limitSeconds = 600; ///< for one fault; beyond it the fault is noticed by its time
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
MutantTable readMutants(const StudyFile& file);

/// One check that is not satisfied: which one, in which row of the failure table, by which method
/// and side of the remedy, and how often.
struct Notice {
    std::string check, row, method, remedy;
    uint64_t count = 0;
};

/// What the failure table says of a fault: notices, and by method and side of the remedy the wrong
/// pairs and how many of them the resolution explains: "row", "method", "remedy", "wrong_count",
/// "explained_count".
struct CellJudgement {
    std::vector<Notice> notices;
    Json cells = Json::array();
};

/// Judges a row of the failure table by its recorded counts, both ways: a count above its bound,
/// one so far below that the bound does not describe the method, a remedy that is not visible, and
/// more wrong pairs than recorded of rays that believe no voxel ("exact": they have no slack).
CellJudgement judgeCells(const Failure& row, const Slack& slack, const StudyRequest& request,
                         const Console& console);

/// Judges whole frames of a row, with its remedy, by every method:
/// - "pairs": the listed pairs against their definition, tested in double for every sample and
///   light; near a limit within rounding either is right.
/// - "samples": each sample lies on the ray of its own pixel, made from the camera in double.
/// - "picture": the frame's colours against those of the recorded pairs.
/// - "resolution": maps have the texels that the frame asked for, divided as it reports.
/// - "lookup": each pair of a map has the visibility of the stored depths, read by taps that
///   are made in double without the method's code (hybrid/judge/own_taps.h).
/// - "belief": where voxels are believed up to so many pixels, no error is magnified beyond them.
/// - "other way": the same answers, bit for bit, by single rays, by the code of all processors, by
///   maps that keep nothing and draw every batch, and with lights in another order.
std::vector<Notice> judgeFrames(const MutantFrames& frames, const StudyRequest& request,
                                const Console& console);

/// Measures the fault of this process, or none. Returns {"name", "what", "is_used", "ended",
/// "notices", "cells"}.
Json measureMutant(const MutantTable& table, const MutantRow& row, const StudyRequest& request,
                   const Console& console);

/// Measures a fault in a process of its own, started as `study FILE --only NAME` with
/// kMutantVariable set. A process that ends by an assertion, a signal, an error or after
/// the limit gives a notice of that name. Returns what measureMutant returns.
Json measureInOwnProcess(const StudyFile& file, const MutantTable& table, const MutantRow& row);

/// Replaces the cells of each fault, where the run without one was measured, too, by "excess": by
/// row of the failure table, over the cells that have more wrong pairs than without the fault, how
/// many more, and how many more explained ones. The latter are errors that the class "explained"
/// hides.
void setExcess(Json& mutants);

std::unique_ptr<Study> makeMutantStudy(const StudyFile& file, const StudyRequest& request,
                                       const Console& console);

} // namespace shadowdag
