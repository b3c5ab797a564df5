// SPDX-License-Identifier: Apache-2.0
// Makes scenes of any number of triangles out of a scene, for studies of scale: its triangles
// divided, its copies side by side, or leaves strewn over its surfaces. Lights and cameras stay.
//
// All arithmetic is double with + - * / and sqrt only, rounded to float once: the same bits on
// every machine, whatever the number of threads.
#pragma once

#include "scenes/world.h"

#include <cstdint>

namespace shadowdag {

/// How a scene gets more triangles. In brackets: what a step is; step 0 is the scene itself.
enum class Growth : uint8_t {
    kTessellate, ///< each triangle is divided at its edges' midpoints [once: 4 times as many]
    kInstance,   ///< copies stand side by side in x and z [one more copy along each axis]
    kLeaves,     ///< leaves of two triangles lie on the surfaces [a leaf]
};
inline constexpr const char* kGrowthNames[] = {"tessellate", "instance", "leaves"};

/// The leaves of Growth::kLeaves.
struct LeafOptions {
    uint64_t seed = 1;
    /// The area of all leaves' rectangles over that of the scene's triangles, above 0: the more
    /// leaves, the smaller they are.
    double cover = 0.25;
    /// Leaves are ellipses that an alpha mask cuts out of their rectangles; else the rectangles.
    bool isMasked = true;
};

/// Returns the number of triangles of a scene after so many steps; 2^64 - 1 if it is larger.
uint64_t grownCount(Growth growth, uint64_t triangleCount, uint64_t step);

/// Returns the step whose number of triangles is nearest to the one asked for, by their ratio; for
/// leaves, the last one that does not exceed it. 0 if the scene has as many triangles already.
/// @param triangleCount of the scene, at least 1
uint64_t nearestStep(Growth growth, uint64_t triangleCount, uint64_t askedCount);

/// Returns the world's scene with all its triangles, at the world's time, as one mesh that does not
/// move, in their order. Lights, cameras, materials and animations of nodes stay.
Scene flattened(const World& world);

/// Returns the scene grown by `step` steps, with grownCount() triangles in one mesh that does not
/// move; flattened() for step 0. Deterministic in its arguments.
/// - kTessellate: triangles of the same surface: midpoints are rounded to float, and those of two
///   triangles that share an edge are the same, so that no gap opens. Bounds and area stay.
/// - kInstance: the scene itself stays where it is, among step * (step + 2) copies, a gap of 1/64
///   of the scene's size apart. They have no lights.
/// - kLeaves: each leaf is at a point of the surface, all areas alike, off it on the side of the
///   normal by at most half its length, and tilted at random. Bounds stay, if the scene is thicker
///   than a leaf along each axis.
/// Throws Error kResource for 2^32 - 1 vertices or triangles and more.
Scene grownScene(const World& world, Growth growth, uint64_t step, const LeafOptions& leaves = {});

} // namespace shadowdag
