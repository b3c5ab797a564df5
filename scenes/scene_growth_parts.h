// SPDX-License-Identifier: Apache-2.0
// Parts of scene_growth.cpp: triangles divided, leaves strewn. Not used outside of it.
#pragma once

#include "scenes/scene_growth.h"

#include <cstddef>
#include <limits>

namespace shadowdag {

/// Long serial loops call pollCpu once in so many turns.
constexpr size_t kGrowthPollInterval = 65536;

/// Returns the product; 2^64 - 1 if it is larger.
inline uint64_t productOf(uint64_t a, uint64_t b) {
    constexpr uint64_t kMost = std::numeric_limits<uint64_t>::max();
    return b != 0 && a > kMost / b ? kMost : a * b;
}

/// Throws Error kResource unless indices of 32 bits reach all vertices and triangles.
void requireIndices(uint64_t vertexCount, uint64_t triangleCount);

/// Divides each triangle of a mesh into four, the corner of its first vertex first, the middle one
/// last. Throws as requireIndices.
void divideTriangles(Mesh& mesh);

/// Strews leaves over a world's surfaces (Growth::kLeaves).
/// @param scene flattened() of the world; its one mesh receives the leaves
void strewLeaves(Scene& scene, const World& world, uint64_t leafCount, const LeafOptions& options);

} // namespace shadowdag
