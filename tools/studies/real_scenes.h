// SPDX-License-Identifier: Apache-2.0
// Studies of kind "real": scenes that were not made for this program, each by the four methods,
// over a short camera move, every pair compared with Embree, with bounds. Scenes without lights of
// their own get some that the program places.
//
// A cell is one scene by one method. It holds while
//  - each count is at most what is known of the cell and the study's slack; but of rays that
//    believe no voxel at most what is known, without slack, and of acne by them none;
//  - the shares of wrong and of magnified pairs are within the study's tolerance of the method,
//    whatever is known. Where most right answers near outlines would be explained as well,
//    "explained" excuses nothing: there all wrong pairs together are held to a share of their own.
//    A cell of a known scene that exceeds these may stand in the study under "untrusted" with the
//    reason;
//  - every error is classified: it is magnified, explained, acne, contact or settled
//    (hybrid/judge/explain.h). The few that are left and understood stand in the study under
//    "unexplained" with a reason;
//  - some of its pairs are dark by the truth and some lit: else there is no shadow to be wrong at,
//    and the cell proves nothing.
// A scene without recorded counts is measured as well, with the bounds of any scene: no
// unclassified error, and no error at all by rays that believe no voxel; if it
// shows no shadow edge the report states it.
//
// The move: in each frame the camera is farther to the right by a pixel's width at the median
// distance of the visible surface; frames form a sequence and keep state.
#pragma once

#include "tools/studies/cell_counts.h"
#include "tools/studies/study.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Errors that neither the resolution nor the taps explain but that are understood; a cell may have
/// this number and the slack.
struct NamedErrors {
    MatrixMethod method;
    uint64_t count = 0; ///< measured once, over all frames
    std::string failure, reason;
};

/// What a method is held to in any scene: shares of the pairs of all frames. Where more than
/// `nullRate` of the right pairs near outlines would be explained if they were wrong, explaining
/// has no power: results say so in place of the explained share, and false shadow and false light
/// together may be `powerlessWrongShare` of the pairs at most.
struct RealTolerance {
    std::vector<MatrixMethod> methods;
    double falseShadowShare = 0, falseLightShare = 0, magnifiedShare = 0, acneShare = 1,
           nullRate = 1, powerlessWrongShare = 1;
};

/// A cell that is known to exceed the tolerance in its shares of wrong and magnified pairs.
struct Untrusted {
    MatrixMethod method;
    std::string reason;
};

/// A scene with recorded counts. Another file of that name is not compared with them.
struct RealScene {
    std::string name;         ///< of the file, without directories and extension; unique
    std::string geometryHash; ///< as `info` prints it
    std::string camera;       ///< as --camera takes it
    std::string what;         ///< one sentence: what the view shows
    std::vector<NamedErrors> named;
    std::vector<Untrusted> untrusted;
    std::vector<KnownCell> known;
};

struct RealTable {
    std::string settings; ///< of all cells
    int frameCount = 4;
    int placedLightCount = 0; ///< in scenes without lights; 0: such scenes are not measured
    Slack slack;
    std::vector<RealTolerance> tolerances;
    std::vector<RealScene> scenes;

    /// Returns the scene of that name, or null.
    const RealScene* find(const std::string& name) const;
};

/// Reads a study of this kind. Throws Error kInput, naming file and row.
RealTable readReal(const StudyFile& file);

/// Returns the files of the arguments: files as they are, for a directory every .glb and .gltf in
/// it, by name, without those that have no lights if none are placed. Throws Error kUsage if there
/// is none or if two have one name, which distinguishes scenes and pictures; kInput for an argument
/// that is neither and for a scene that cannot be read.
std::vector<std::string> realFiles(const RealTable& table,
                                   const std::vector<std::string>& arguments,
                                   const Console& console);

/// Measures a scene. Returns {"settings", "frame_count", "cells": [...], "pictures": [...]}: one
/// object per method with its counts, "unnamed_count", "unnamed" (the first few of these pairs:
/// frame, pixel, light, places, blocker), "known" ("yes", "no", "another file"), "lights" ("own",
/// "placed"), "explaining_has_power" (explainingHasPower), "bounds" and
/// "broken" (realBroken, and "unknown" for a known scene without counts). Throws Error kInput for a
/// scene that cannot be read, or that has no lights where none are placed.
Json measureReal(const RealTable& table, const std::string& file, const StudyRequest& request,
                 const Console& console);

/// Returns whether right and wrong pairs near outlines can be told apart by explaining: true,
/// false, or null where no such pair was sampled. @param cell with its outline null rate and its
/// count
Json explainingHasPower(const RealTable& table, MatrixMethod method, const Json& cell);

/// Returns the bounds of a cell, by name of its measure: counts and shares.
/// @param scene null for one without recorded counts
/// @param hasPower what explainingHasPower returned for the cell
Json realBounds(const RealTable& table, const RealScene* scene, MatrixMethod method,
                const Json& hasPower);

/// Returns whether the truth of a cell's pairs is dark for some and lit for others.
bool showsShadowEdge(const Json& cell);

/// Returns the names of a cell's measures that exceed their bounds, "occluded_count" if a known
/// cell shows no shadow edge, and "pair_count" if it has no pairs.
/// @param cell with the measures, "known", "occluded_count" and "pair_count"
Json realBroken(const Json& cell, const Json& bounds);

/// Returns one line per bound that a cell exceeds.
std::vector<std::string> realBrokenLines(const Json& results);

std::unique_ptr<Study> makeRealStudy(const StudyFile& file, const StudyRequest& request,
                                     const Console& console);

} // namespace shadowdag
