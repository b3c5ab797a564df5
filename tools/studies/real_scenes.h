// SPDX-License-Identifier: Apache-2.0
// Scenes that nobody staged, held against bounds: the lit scenes that are known, each by the four
// methods of the matrix of failures (failures.h), over a short camera move, every pair against
// Embree.
//
// A cell is one scene by one method. It holds while
//  - each count is at most what is known of the cell, a twentieth and 3 more (boundOf; 20 of the
//    mean error); but of dag-exact at most what is known, without slack, and of acne by rays none;
//  - no error is without a name: each is explained, acne, contact or settled
//  (hybrid/judge/explain.h).
//    The few that are left and understood stand in namedErrors() with a name and a reason;
//  - some of its pairs are dark by the truth and some lit: else there is no shadow to be wrong at,
//    and the cell proves nothing.
// A scene that is not known is measured as well, and held to what any scene is held to: no error
// without a name, no acne by rays, and no error at all by dag-exact; where it shows no shadow edge
// the report says so. Of known scenes dag-exact may err where it is known to: one explained pair of
// 1963164 in lost_empire_torches.
//
// The move: kRealFrameCount frames, the camera a pixel's width at the median distance of what it
// sees farther to the right in each; frames follow each other and keep what is kept.
#pragma once

#include "tools/studies/failures.h"
#include "tools/workspace/scene_setup.h"

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

constexpr int kRealFrameCount = 4;

/// A scene that is known. It is no part of the project: what is measured of another file of that
/// name is not held to its counts.
struct RealScene {
    std::string name;         ///< of the file, without directories and extension; unique
    std::string geometryHash; ///< as `info` prints it
    std::string camera;       ///< as --camera takes it
    std::string what;         ///< one sentence: what the view shows
};
const std::vector<RealScene>& realScenes();

/// What was measured of each known scene by each method once, on the CPU, isOn true throughout; the
/// table is written by tools/report/failure_known.py.
const std::vector<KnownCell>& knownRealCells();

/// Errors that neither the resolution nor the taps explain and that are understood all the same; a
/// cell may have as many, a twentieth and 3 more.
struct NamedErrors {
    std::string scene; ///< of realScenes()
    MatrixMethod method;
    uint64_t count; ///< measured once, over all frames
    std::string failure, reason;
};
const std::vector<NamedErrors>& namedErrors();

/// Returns the settings of all real cells, as texts of cellSetup.
const std::string& realSettings();

/// What to measure, and where pictures go.
struct RealRequest {
    Backend backend = Backend::kCpu;
    std::vector<std::string> files;       ///< paths of scenes
    std::string settings;                 ///< on top of realSettings(); then nothing is known
    std::string cacheDirectory;           ///< of voxels, as VoxelSource takes it
    std::string pictureDirectory;         ///< "" for none; else files are written there
    std::function<void(double)> progress; ///< told the share that is done; may be empty
};

/// Returns the files that arguments of `compare real` mean: files as they are, of a directory every
/// .glb and .gltf in it that has lights, by name. Throws Error kUsage when there is none and where
/// two are of one name (measureReal), kInput for what is neither and for a scene that cannot be
/// read.
std::vector<std::string> realFiles(const std::vector<std::string>& arguments,
                                   const Console& console);

/// Measures scenes. Returns {"cells": [...], "pictures": [...]}: one object a scene and method with
/// its counts, "unnamed_count", "unnamed" (the first few of these pairs: frame, pixel, light,
/// places, blocker), "known" ("yes", "no", "another file", "other settings"), "bounds" and "broken"
/// (realBroken, and "unknown" where a known scene has no counts). Counts depend on nothing but
/// files and settings. Throws Error kInput for a scene that has no lights or cannot be read, and
/// kUsage where two files are of one name but for directories and extension: scenes and pictures go
/// by it.
Json measureReal(const RealRequest& request, const Console& console);

/// Returns the bounds of a cell, by name of its measure. @param known of KnownCell, or null
Json realBounds(const std::string& scene, MatrixMethod method, const CellCounts* known);

/// Returns whether the truth of a cell's pairs is dark for some and lit for others.
bool showsShadowEdge(const Json& cell);

/// Returns the names of a cell's measures that are over its bounds, and "occluded_count" where a
/// known cell shows no shadow edge.
/// @param cell with the measures, "known", "occluded_count" and "pair_count"
Json realBroken(const Json& cell, const Json& bounds);

/// Returns one line a bound that a cell breaks.
std::vector<std::string> realBrokenLines(const Json& results);

/// Returns what scenes show and why their named errors are there: what "study" of real.json holds
/// and the page quotes.
Json realStudy();

/// What `compare real` was asked for.
struct RealCommand {
    std::string output;
    std::vector<std::string> arguments; ///< files and directories
    std::string cacheDirectory;
    Backend backend = Backend::kCpu;
};

/// Measures, writes the report and says what does not hold. Throws NotHeld when anything does not,
/// the report standing.
void runReal(const RealCommand& command, const Console& console);

} // namespace shadowdag
