// SPDX-License-Identifier: Apache-2.0
// Studies of kind "real": lit scenes that were not made for this program, each by the four methods,
// over a short camera move, every pair against Embree, held to bounds.
//
// A cell is one scene by one method. It holds while
//  - each count is at most what is known of the cell and the study's slack; but of dag-exact at
//  most
//    what is known, without slack, and of acne by rays none;
//  - every error is classified: it is explained, acne, contact or settled
//  (hybrid/judge/explain.h).
//    The few that are left and understood stand in the study under "unexplained" with a reason;
//  - some of its pairs are dark by the truth and some lit: else there is no shadow to be wrong at,
//    and the cell proves nothing.
// A scene that is not known is measured as well, and held to what any scene is held to: no error
// that is not classified, no acne by rays, and no error at all by dag-exact; where it shows no
// shadow edge the report says so.
//
// The move: frames, the camera a pixel's width at the median distance of what it sees farther to
// the right in each; frames follow each other and keep what is kept.
#pragma once

#include "tools/studies/cell_counts.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Errors that neither the resolution nor the taps explain and that are understood all the same; a
/// cell may have as many, and the slack.
struct NamedErrors {
    MatrixMethod method;
    uint64_t count = 0; ///< measured once, over all frames
    std::string failure, reason;
};

/// A scene that is known. What is measured of another file of that name is not held to its counts.
struct RealScene {
    std::string name;         ///< of the file, without directories and extension; unique
    std::string geometryHash; ///< as `info` prints it
    std::string camera;       ///< as --camera takes it
    std::string what;         ///< one sentence: what the view shows
    std::vector<NamedErrors> named;
    std::vector<KnownCell> known;
};

struct RealTable {
    std::string settings; ///< of all cells
    int frameCount = 4;
    Slack slack;
    std::vector<RealScene> scenes;

    /// Returns the scene of that name, or null.
    const RealScene* find(const std::string& name) const;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
RealTable readReal(const StudyFile& file);

/// Returns the files that arguments mean: files as they are, of a directory every .glb and .gltf in
/// it that has lights, by name. Throws Error kUsage when there is none and where two are of one
/// name, by which scenes and pictures go; kInput for what is neither and for a scene that cannot be
/// read.
std::vector<std::string> realFiles(const std::vector<std::string>& arguments,
                                   const Console& console);

/// Measures a scene. Returns {"settings", "frame_count", "cells": [...], "pictures": [...]}: one
/// object a method with its counts, "unnamed_count", "unnamed" (the first few of these pairs:
/// frame, pixel, light, places, blocker), "known" ("yes", "no", "another file"), "bounds" and
/// "broken" (realBroken, and "unknown" where a known scene has no counts). Throws Error kInput for
/// a scene that has no lights or cannot be read.
Json measureReal(const RealTable& table, const std::string& file, const StudyRequest& request,
                 const Console& console);

/// Returns the bounds of a cell, by name of its measure. @param scene null of one that is not known
Json realBounds(const RealTable& table, const RealScene* scene, MatrixMethod method);

/// Returns whether the truth of a cell's pairs is dark for some and lit for others.
bool showsShadowEdge(const Json& cell);

/// Returns the names of a cell's measures that are over its bounds, and "occluded_count" where a
/// known cell shows no shadow edge.
/// @param cell with the measures, "known", "occluded_count" and "pair_count"
Json realBroken(const Json& cell, const Json& bounds);

/// Returns one line a bound that a cell breaks.
std::vector<std::string> realBrokenLines(const Json& results);

std::unique_ptr<Study> makeRealStudy(const StudyFile& file, const StudyRequest& request,
                                     const Console& console);

} // namespace shadowdag
