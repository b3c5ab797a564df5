// SPDX-License-Identifier: Apache-2.0
// Studies of kind "scale": the same scenes with more and more triangles (scenes/scene_growth.h) at
// fixed resolutions of voxels. Each method's build time, bytes, time of a pair and errors are
// measured at each number of triangles; from them follow the crossovers, where a method becomes
// faster than Embree.
#pragma once

#include "scenes/scene_growth.h"
#include "tools/studies/study.h"

#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// A scene that grows.
struct ScaleRow {
    std::string name, scene;
    std::string what;   ///< text of the report
    std::string camera; ///< as --camera takes it; the same for all numbers of triangles
    Growth growth = Growth::kTessellate;
    std::vector<uint64_t> triangleCounts; ///< asked for, ascending
    std::vector<uint32_t> resolutionLog2; ///< of voxels, ascending
    LeafOptions leaves;                   ///< of Growth::kLeaves
    bool isOnlyByName = false;            ///< measured only if it is named
};

struct ScaleTable {
    std::string settings; ///< of all methods
    uint32_t width = 640, height = 360;
    int warmups = 0, repeats = 6;      ///< rounds in which all methods are timed in turn
    double mostExactWrongShare = 1e-5; ///< of the pairs of a frame by exact rays
    uint32_t placedLightCount = 0;     ///< in scenes without lights; 0: such scenes are refused
    std::vector<ScaleRow> rows;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
ScaleTable readScale(const StudyFile& file);

/// Returns the memory that the measurement of so many triangles takes at least.
/// @param resolutionCount of voxels, which are all kept until the last frame
uint64_t scaleBytes(uint64_t triangleCount, size_t resolutionCount);
/// Throws Error kResource, naming the row, if it is more than the process may take.
/// @param availableBytes as processMemoryBytes gives it
void requireScaleMemory(const std::string& row, uint64_t triangleCount, size_t resolutionCount,
                        uint64_t availableBytes);

/// Measures a row at one of its numbers of triangles. Returns {"steps": [what was measured: counts
/// and the time of the growth], "cells": [one per method], "skipped": []}. If the nearest step of
/// growth is that of the number before, nothing is measured: it is in "skipped" with the reason.
/// @param index of row.triangleCounts
Json measureScale(const ScaleTable& table, const ScaleRow& row, size_t index,
                  const StudyRequest& request, const Console& console);

/// The time of a pair at a number of triangles.
struct ScalePoint {
    double triangleCount = 0;
    double nsPerPair = 0; ///< above 0
};

/// How two methods compare over the number of triangles.
enum class CrossoverKind : uint8_t {
    kNone,       ///< no number of triangles has both, or more than one time of either
    kNever,      ///< not faster at any number
    kFrom,       ///< faster from a number on
    kEverywhere, ///< faster at all numbers
    kUpTo,       ///< faster up to a number, and not at the largest
};
inline constexpr const char* kCrossoverNames[] = {"none", "never", "from", "everywhere", "up to"};

struct Crossover {
    CrossoverKind kind = CrossoverKind::kNone;
    double triangleCount = 0;      ///< of kFrom and kUpTo
    double least = 0, largest = 0; ///< numbers of triangles that both were measured at
};

/// Returns where a method becomes faster than another for good, that is, up to the largest number
/// that both were measured at; for kUpTo, where it is so last. Between two numbers, both times are
/// lines in the logarithms of number and time. Equal times are not faster. Points without a partner
/// at the same number are left out.
/// @param method,base in any order
Crossover crossoverOf(std::vector<ScalePoint> method, std::vector<ScalePoint> base);

/// Returns the crossovers of every row's methods against Embree: "row", "method", "kind",
/// "triangle_count" (null without), "least_triangle_count", "largest_triangle_count", of the
/// largest "ns_per_pair", "embree_ns_per_pair" and "are_apart" (the intervals of both are
/// known and disjoint), and "text", a sentence.
Json crossoversOf(const Json& cells);

std::unique_ptr<Study> makeScaleStudy(const StudyFile& file, const StudyRequest& request,
                                      const Console& console);

} // namespace shadowdag
