// SPDX-License-Identifier: Apache-2.0
// Nodes and leaves of a hierarchy over triangles (triangle_bvh.h). No inline functions: kernels
// that are compiled for one processor include it (dag_stream_work.h says why).
#pragma once

#include <cstdint>

namespace shadowdag {

/// Children of a node: the 16 lanes that are tested together.
constexpr uint32_t kTriangleBvhWidth = 8;
/// Triangles of a leaf: these are prepared for a light together, in lanes. 16 gained 4 % in the
/// necropolis and lost 3 % in two other scenes.
constexpr uint32_t kTrianglesPerLeaf = 8;
/// Nodes on a path at most; deeper hierarchies are refused.
constexpr uint32_t kTriangleBvhDepth = 32;

/// A child of a node: kTriangleLeafTag | index of a leaf, or the index of a node.
constexpr uint32_t kTriangleLeafTag = 1u << 31;
/// No child: its box is empty.
constexpr uint32_t kNoTriangleChild = ~0u;

/// Boxes of the children by axis, in the local space (TruthSpace). 448 bytes. Unused children have
/// the box from infinity to -infinity.
struct TriangleBvhNode {
    float low[3][kTriangleBvhWidth];
    float high[3][kTriangleBvhWidth];
    uint32_t child[kTriangleBvhWidth];
};

/// Triangles by axis, in the local space. 384 bytes. The first corner lies across from the
/// longest side. Unused ones have edges of length 0, which no ray hits.
struct TriangleBvhLeaf {
    float corner[3][kTrianglesPerLeaf];
    float edge1[3][kTrianglesPerLeaf]; ///< second corner - first, rounded
    float edge2[3][kTrianglesPerLeaf]; ///< third corner - first, rounded
    float longest[kTrianglesPerLeaf];  ///< at least the length of the longest side
    float sides[kTrianglesPerLeaf];    ///< at least the product of the lengths of edge1 and edge2
    uint32_t triangle[kTrianglesPerLeaf]; ///< world index; kCutTriangleTag: has an alpha mask
};

/// Set for triangles of which a mask may cut away parts.
constexpr uint32_t kCutTriangleTag = 1u << 31;

} // namespace shadowdag
