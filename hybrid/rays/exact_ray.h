// SPDX-License-Identifier: Apache-2.0
// One exact shadow ray against the triangles of a hierarchy: the truth's own test of each triangle
// whose box the ray meets. What the CPU asks of single pairs, and CUDA of all.
//
// Boxes must not lose a triangle to rounding. The ray starts at S and ends at S + d, both floats of
// the local space. With u = 2^-24 and D the diagonal of the scene, a box is off by u (D + |S|),
// because the corners of triangles were rounded; (p - S) / d has a relative error of 4 u, and |p -
// S| is at most D for a start in the scene. An axis along which the ray moves by less than u times
// the margin is treated as if it moved by that much. So boxes are grown by 32 u (D + |S|) on each
// side.
#pragma once

#include "hybrid/rays/triangle_bvh.h"

namespace shadowdag {

/// What exact rays are tested against. Movers are asked separately.
struct ExactView {
    TruthGeometry geometry;
    TriangleBvhView bvh = {}; ///< of static triangles of `geometry`
};

/// Returns whether a triangle of the hierarchy blocks the ray, by blocksTruthRay. Rays that end at
/// tFar <= 0 are never blocked; of others a start or a direction that is not finite is: never
/// silently lit. A hierarchy that was not made blocks nothing.
/// @param blocker receives the triangle that blocks, unchanged when none does; may be null
SDAG_HD inline bool isBlockedExactly(const ExactView& exact, const TruthRay& ray,
                                     uint32_t* blocker = nullptr) {
    if (!(ray.tFar > 0.0f) || exact.bvh.root == kNoTriangleChild)
        return false;
    constexpr float kRounding = 0x1p-24f;
    const float diagonal = float(exact.geometry.diagonal);
    const glm::vec3 s = ray.startLocal;
    const float margin =
        32.0f * kRounding * (diagonal + fabsf(s.x) + fabsf(s.y) + fabsf(s.z)) + 1e-30f;
    const float least = kRounding * margin;
    glm::vec3 inverse;
    for (int a = 0; a < 3; ++a) {
        const float d = ray.direction[a];
        if (!(fabsf(d) <= 3e38f) || !(fabsf(s[a]) <= 3e38f))
            return true;
        inverse[a] = 1.0f / (fabsf(d) < least ? (d < 0.0f ? -least : least) : d);
    }
    uint32_t stack[kTriangleBvhDepth * (kTriangleBvhWidth - 1) + 1], count = 0;
    stack[count++] = exact.bvh.root;
    while (count > 0) {
        const uint32_t child = stack[--count];
        if (child & kTriangleLeafTag) {
            const TriangleBvhLeaf& leaf = exact.bvh.leaves[child & ~kTriangleLeafTag];
            for (uint32_t k = 0; k < kTrianglesPerLeaf; ++k) {
                if (leaf.longest[k] == 0.0f)
                    continue; // unused, or a point, which blocks nothing
                const uint32_t triangle = leaf.triangle[k] & ~kCutTriangleTag;
                if (blocksTruthRay(exact.geometry, ray, triangle)) {
                    if (blocker)
                        *blocker = triangle;
                    return true;
                }
            }
            continue;
        }
        const TriangleBvhNode& node = exact.bvh.nodes[child];
        for (uint32_t i = 0; i < kTriangleBvhWidth; ++i) {
            float enter = 0.0f, leave = 1.0f;
            for (int a = 0; a < 3; ++a) {
                const bool isAgainst = inverse[a] < 0.0f;
                const float low = (node.low[a][i] - margin - s[a]) * inverse[a];
                const float high = (node.high[a][i] + margin - s[a]) * inverse[a];
                enter = fmaxf(enter, isAgainst ? high : low);
                leave = fminf(leave, isAgainst ? low : high);
            }
            if (node.child[i] != kNoTriangleChild && enter <= leave)
                stack[count++] = node.child[i];
        }
    }
    return false;
}

} // namespace shadowdag
