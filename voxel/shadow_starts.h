// SPDX-License-Identifier: Apache-2.0
// The samples of one cluster, prepared for many lights: shadowSegment() of dag_trace.h for all of
// them, bit for bit. What depends on the sample alone is computed once, not per light.
#pragma once

#include "voxel/dag_trace.h"

#include <vector>

namespace shadowdag {

/// Samples with their lifted starts. Level 0 only. Reused from cluster to cluster; not thread safe.
class ShadowStarts {
public:
    /// Starts over, without samples. @param offset as shadowSegment's
    void reset(const VoxelGrid& grid, float offset);

    /// Adds a sample. @param normalWorld unit, on the light's side
    void add(const glm::vec3& positionWorld, const glm::vec3& normalWorld);

    size_t count() const { return sampleX_.size(); }
    const VoxelGrid& grid() const { return grid_; }
    float offset() const { return offset_; }

    /// Returns where sample i's segments start before they are drawn towards the light, voxel
    /// space, for lights of which no coordinate is beyond the resolution; other lights lift it
    /// further, by lightExcess() per axis at most.
    glm::dvec3 liftedStart(size_t i) const {
        const double lift = offsetNorm_[i] * (1.0 + (scale_[i] * kTwiceSlabMargin + rounding_[i]));
        return glm::dvec3(sampleX_[i], sampleY_[i], sampleZ_[i]) + normal(i) * lift;
    }
    glm::dvec3 normal(size_t i) const { return glm::dvec3(normalX_[i], normalY_[i], normalZ_[i]); }

    /// Returns by how much more, per axis, starts may be lifted towards this light (voxel space)
    /// than liftedStart.
    double lightExcess(const glm::dvec3& lightVoxel) const;

    /// Writes shadowSegment(grid, position, normal, lightWorld, offset, 0) of the samples listed.
    /// @param segments which.count
    void segments(const glm::vec3& lightWorld, View<const uint32_t> which,
                  DagSegment* segments) const;

private:
    VoxelGrid grid_;
    float offset_ = 1;
    // By sample: voxel space; offset * (|nx| + |ny| + |nz|); shadowLift's scale and rounding
    // without the light.
    std::vector<double> sampleX_, sampleY_, sampleZ_, normalX_, normalY_, normalZ_, offsetNorm_,
        scale_, rounding_;
};

} // namespace shadowdag
