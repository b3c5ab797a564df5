// SPDX-License-Identifier: Apache-2.0
// Exact shadow rays to one light in packets on the CPU: blocksTruthRay (truth_ray.h) over all
// triangles of a hierarchy, with the widest vector instructions of the processor.
#pragma once

#include "hybrid/rays/triangle_bvh.h"
#include "scenes/light.h"
#include "voxel/dag_stream.h"

#include <vector>

namespace shadowdag {

/// Returns whether a point or spot light is so far away, beside the scene, that the rounding of its
/// position is no small part of the scene: packets would leave nearly every triangle to the test in
/// double, so its rays go one by one.
bool isFarLight(const glm::vec3& lightLocal, double diagonal);

/// Traces rays of one light after the other. Not thread-safe: one a thread.
class ExactStream {
public:
    /// @param bvh of triangles of `geometry`
    ExactStream(const TruthGeometry& geometry, const TriangleBvhView& bvh,
                StreamIsa isa = bestStreamIsa());

    /// Sets blocked[i] to whether a triangle of the hierarchy blocks the truth's ray from sample
    /// which[i] to the light (truthPairRay), by blocksTruthRay: 1 or 0. Starts that are neighbours
    /// in `which` should be near each other: they are traced together.
    /// @param starts,positionsWorld of the samples; the positions of directional lights only
    /// @param blocked which.count
    void trace(const Light& light, View<const TruthStart> starts,
               View<const glm::vec3> positionsWorld, View<const uint32_t> which,
               View<uint8_t> blocked);

    /// Returns how many pairs of a ray and a triangle packets left to the test in double so far;
    /// rays of lights far beside the scene go one by one and are not counted.
    uint64_t confirmCount() const { return confirmCount_; }

private:
    TruthGeometry geometry_;
    TriangleBvhView bvh_;
    StreamIsa isa_;
    uint64_t confirmCount_ = 0;
    std::vector<float> starts_;               ///< x, y, z of the rays that are traced
    std::vector<uint32_t> receivers_, empty_; ///< empty_: of rays without length
};

} // namespace shadowdag
