// SPDX-License-Identifier: Apache-2.0
// What a frame promises beside its answers, held against definitions in double precision: errors
// that no comparison with the truth finds, because the truth is asked about the frame's own pairs.
// Of a right frame every count is 0.
#pragma once

#include "tools/workspace/judge.h"

#include <cstdint>
#include <string>

namespace shadowdag {

/// Returns how many pixels have another colour than their pairs give, beyond the rounding of a sum.
uint64_t countWrongColors(const World& world, const PairResults& answers);

/// What is wrong with one frame, and what its wrong pairs say of the promises of its method.
struct SelfChecks {
    uint64_t wrongListPairCount = 0, misplacedSampleCount = 0, hiddenSampleCount = 0,
             wrongLookupCount = 0, coarserMapCount = 0, wrongColorCount = 0;
    /// Of wrong pairs by voxels: ErrorReport::beyondBeliefCount, coarserCellCount.
    uint64_t beyondBeliefCount = 0, coarserCellCount = 0;
    Adjudication exact;        ///< of wrong pairs that triangles or a proof decided
    bool promisesExact = true; ///< whether the method promises that these are right: not Embree's

    /// Returns what is wrong as a sentence, "" if nothing is.
    std::string text() const;
    /// Returns the counts by their names in results.
    Json json() const;
};

/// Checks a frame. Takes time in proportion to samples times lights.
/// @param answers of a renderer of the CPU or CUDA: gl rounds samples to its own grid
/// @param workspace that rendered it @param report of the frame
SelfChecks checkFrame(Workspace& workspace, const PairResults& answers, const ErrorReport& report);

} // namespace shadowdag
