// SPDX-License-Identifier: Apache-2.0
// What changed between two results, beyond their spread: the content of `shadowdag diff`.
//
// Rows are those of every list of the results (runs, cells, checks, mutants, ...) and of the object
// itself; two rows are the same if the keys that name them are (scene, frame, label, method, ...).
// Lists within a row (the rates of a scene, the kernels of a profile) are rows named after it.
// Their values are compared by kind:
//  - measured: a value with `_low` and `_high` beside it, or `_min` and `_max` in older results,
//    whose interval of n values holds the median with 1 - 2^(1 - n). It changed if the intervals
//    are disjoint; if either holds less than 95 %, the change is uncertain;
//  - times without a spread (of stages, of builds) are left out;
//  - counts, bytes and texts: any difference; other numbers: one beyond kLeastChange;
//  - the checks that notice a fault, as a set: a check that notices it no more is worse.
// A change of an error, of bytes or of a time is better or worse; of other values it is neither.
// Where two
// rows have different numbers of pairs, counts of wrong pairs are better or worse by their share.
#pragma once

#include "tools/settings/json.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Relative differences of numbers that are no counts up to this are rounding.
constexpr double kLeastChange = 1e-9;

/// What may differ between the results that are compared.
struct DiffOptions {
    bool allowsExperiment = false, allowsScene = false, allowsMachine = false;
    bool comparesTimes = true; ///< false: times are left out; machines and rounds may differ
};

/// Returns what two results of one experiment have not in common: `changes` (objects with list,
/// row, key, a, b, the intervals of measured values, and verdict: "worse", "better", "changed" or
/// "uncertain"), `only_in_a`, `only_in_b` (names of rows), `values_only_in_a` (list, row and key of
/// values that b lacks in rows of both), `differences` (texts of what was allowed to differ or
/// describes the programs), and the counts of all of these. A row or a value that b lacks is worse,
/// unless experiments may differ. Throws Error kUsage where the results are of different kinds,
/// experiments, scenes or machines and `options` does not allow it (other spellings of frames and
/// another order of scenes and methods are the same experiment), kInput for what readRows refuses,
/// and where nothing can be compared.
/// @param nameA, nameB of the results, for messages
Json diffResults(const std::string& nameA, const Json& a, const std::string& nameB, const Json& b,
                 const DiffOptions& options);

/// Returns the difference as text, one line per change, worse ones first.
std::string diffText(const Json& diff);

} // namespace shadowdag
