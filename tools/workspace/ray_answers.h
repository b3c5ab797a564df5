// SPDX-License-Identifier: Apache-2.0
// Answers to a ray set (ray_set.h) by any tracer, and their score. docs/rays.md describes the file.
#pragma once

#include "hybrid/judge/adjudicator.h"
#include "tools/workspace/ray_set.h"

#include <string>
#include <vector>

namespace shadowdag {

inline constexpr std::string_view kAnswersKind = "SDAGANSW";

/// What a tracer says of each pair of a set.
struct RayAnswers {
    std::string tracer;              ///< its name, for rows and charts
    std::string setId;               ///< RaySet::id of the set that is answered
    std::vector<float> visibility;   ///< by pair: 1 lit, 0 dark, or a fraction
    std::vector<double> timeMs;      ///< of all pairs, one per repetition; may be empty
    double buildMs = -1;             ///< of its structures; negative: not stated
};

/// Returns answers out of arrays: "lit" (bits, as bytes 0 or 1) or "visibility" (fractions),
/// "set_id", "name", and optionally "time_ms" and "build_ms". Throws Error kInput, beginning with
/// `path`.
RayAnswers answersOf(const std::vector<NamedArray>& arrays, const std::string& path);
/// Returns the arrays of answers.
std::vector<NamedArray> arraysOf(const RayAnswers& answers);
/// Reads answers. Throws as readArrays and answersOf do, and Error kInput if they are not those of
/// the set.
RayAnswers readAnswers(const std::string& path, const RaySet& set);
/// Throws Error kInput, beginning with `path`, unless the answers are to this set.
void requireAnswersTo(const RaySet& set, const std::string& id, const RayAnswers& answers,
                      const std::string& path);

/// What is right about each pair of a set.
struct RaySetTruth {
    std::string setId;
    std::vector<uint8_t> lit;      ///< by the truth: 1 or 0
    std::vector<Verdict> verdicts; ///< by the adjudicator
};

/// Returns what is right, by Embree as the truth and by the adjudicator.
RaySetTruth judgeRaySet(const RaySet& set);

/// Returns a tracer's row, with the keys of a run of compare that charts read: the truth decides
/// what is wrong, as for every method. "proven_wrong_count" are answers that the adjudicator proved
/// wrong, of "proven_count". Without times there is no "time_ms".
Json scoreRow(const RaySet& set, const RaySetTruth& truth, const RayAnswers& answers);

} // namespace shadowdag
