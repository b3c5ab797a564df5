// SPDX-License-Identifier: Apache-2.0
// Studies of kind "adjudication": tracers against the adjudicator (hybrid/judge/adjudicator.h),
// which decides pairs by proofs and shares no arithmetic with any of them, the truth included: a
// sample of a frame's pairs, and all pairs of a larger frame in which truth and exact rays differ.
#pragma once

#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Who answers pairs.
enum class Tracer : uint8_t {
    kTruth,          ///< Embree as the program uses it for the truth
    kExactPackets,   ///< rays that believe no voxel, in packets
    kExactSingle,    ///< the same one by one, by the source that CUDA compiles
    kEmbreeMethod,   ///< the method `embree`, as a renderer would use it
    kEmbree1,        ///< rtcOccluded1 along the truth's segments
    kEmbree16,       ///< rtcOccluded16 along them
    kEmbreeRobust1,  ///< the same in a robust scene
    kEmbreeRobust16, ///< the same in a robust scene
    kVoxels,         ///< rays that believe all voxels
    kMaps,           ///< virtual cube maps
};
inline constexpr const char* kTracerNames[] = {
    "truth",         "exact packets",       "exact single",         "embree method", "rtcOccluded1",
    "rtcOccluded16", "rtcOccluded1 robust", "rtcOccluded16 robust", "voxels",        "maps"};

/// A scene whose pairs are judged.
struct AdjudicationRow {
    std::string name, scene;
    std::string geometryHash; ///< of a file of this name among the scenes given; "" for `scene`
    uint64_t pairLimit = 0;   ///< pairs of a seeded sample, 0: all pairs of the frame
    double timeSeconds = 0;
};

struct AdjudicationTable {
    std::string settings;                               ///< of all cells
    uint64_t givenPairLimit = 0;                        ///< of scenes on the command line
    uint32_t placedLightCount = 0;                      ///< in those without lights; 0: refused
    double mostAmbiguousShare = 1;                      ///< of the pairs of a scene
    uint32_t disputedWidth = 640, disputedHeight = 360; ///< of the frame of disputed pairs
    std::vector<Tracer> faultless;                      ///< tracers that may answer no pair wrongly
    std::vector<AdjudicationRow> rows;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
AdjudicationTable readAdjudication(const StudyFile& file);

/// Measures a row. Returns {"verdicts": [the counts of lit, dark and ambiguous pairs, and of all
/// disputed ones of another frame: ambiguous, the truth is right, exact packets are], "cells": one
/// per tracer with its wrong pairs: those whose answer is not the proven one, "skipped": [the row
/// and the reason, if its scene has another geometry than recorded]}.
Json measureAdjudication(const AdjudicationTable& table, const AdjudicationRow& row,
                         const StudyRequest& request, const Console& console);

std::unique_ptr<Study> makeAdjudicationStudy(const StudyFile& file, const StudyRequest& request,
                                             const Console& console);

} // namespace shadowdag
