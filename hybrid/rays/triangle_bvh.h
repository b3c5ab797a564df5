// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy over static triangles, for exact shadow rays in packets
// (exact_stream.h) and one by one (exact_ray.h). Built by Embree's builder (rtcBuildBVH); nodes and
// leaves are ours.
#pragma once

#include "hybrid/rays/triangle_bvh_nodes.h"
#include "hybrid/rays/truth_ray.h"

#include <vector>

namespace shadowdag {

/// Non-owning.
struct TriangleBvhView {
    View<const TriangleBvhNode> nodes;
    View<const TriangleBvhLeaf> leaves;
    uint32_t root = kNoTriangleChild; ///< kNoTriangleChild: no triangles
};

/// Owns a hierarchy on the host.
struct TriangleBvh {
    std::vector<TriangleBvhNode> nodes;
    std::vector<TriangleBvhLeaf> leaves;
    uint32_t root = kNoTriangleChild;

    TriangleBvhView view() const { return {viewOf(nodes), viewOf(leaves), root}; }
    uint64_t bytes() const {
        return nodes.size() * sizeof(TriangleBvhNode) + leaves.size() * sizeof(TriangleBvhLeaf);
    }
};

/// Returns the hierarchy of the listed triangles. Coordinates below 1e18. The tree may depend on
/// the number of threads; what is found by it does not. Throws Error kResource where Embree fails.
/// @param geometry all world triangles @param which indices into them
TriangleBvh buildTriangleBvh(const TruthGeometry& geometry, View<const uint32_t> which);

/// Moves a hierarchy into the local space of another origin: its boxes and corners become those
/// that the builder would have found there, exactly, as both spaces hold its triangles exactly
/// (truthSpaceOf). Cost: linear. @param from the origin of its space
void moveToSpace(TriangleBvh& bvh, const glm::dvec3& from, const glm::dvec3& to);

} // namespace shadowdag
