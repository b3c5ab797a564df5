// SPDX-License-Identifier: Apache-2.0
// Shafts: conservative tests for all shadow segments of a group of samples towards one light. A
// shaft is a convex region that contains all the segments. If no occupied voxel meets it, all
// samples are lit. occluded() gives the same result for each segment, because the predicate of
// dag_trace.h does not depend on the order of evaluation. Source: Haines, Wallace, Shaft Culling
// for Efficient Ray-Traced Radiosity, 1991.
#pragma once

#include "voxel/dag_stream.h"
#include "voxel/shadow_starts.h"

#include <vector>

namespace shadowdag {

/// Which of a node's 64 cells, or a leaf's voxels, may rise above a plane: a table for one normal.
class AbovePlane {
public:
    /// Makes the table for a normal.
    void make(const glm::vec3& normal);

    /// Returns the cells, as bits, whose least corner may be at n . x >= height; units and origin:
    /// cells from the node's corner.
    uint64_t cells(float height) const {
        const float bucket = (height - least_) * scale_ - kSlack;
        return !(bucket > 0.0f)          ? ~uint64_t(0)
               : bucket >= float(kCount) ? 0
                                         : above_[uint32_t(bucket)];
    }

private:
    static constexpr uint32_t kCount = 32;
    static constexpr float kSlack = 1e-3f; ///< of a bucket: more than rounding

    uint64_t above_[kCount];
    float least_ = 0, scale_ = 0;
};

/// The region in which the segments of a group of samples start, for every light: a skewed box
/// around their lifted starts, and their normals.
struct ShaftBase {
    glm::dvec3 corner[8];       ///< voxel space; bits of the index: along axis 0, 1, 2
    glm::dvec3 side[3];         ///< normals of its three pairs of sides; side[2] = normal
    glm::dvec3 normal{0, 0, 1}; ///< about unit
    double normalSpread = 0;    ///< no sample's normal is further from `normal`
    const AbovePlane* above;    ///< of `normal`, rounded to float
};

/// The 16 half-spaces that bound a shaft, in float: a point is inside when n . x + d >= 0 for all.
/// Some occur twice or bound nothing.
struct ShaftPlanes {
    static constexpr int kCount = 16;
    alignas(64) float n[3][kCount];
    alignas(64) float d[kCount];
    alignas(64) float reach[kCount];     ///< n . x rises by as much from a unit cell's least corner
    alignas(64) float place[64][kCount]; ///< n . x of a wide node's 64 cells, in cells
};

/// The shaft from a base to a light. Made anew for each; large, so reused.
class Shaft {
public:
    /// Makes the region; returns false if there is none: the light is within a voxel of the base on
    /// every axis, lies so low above a receiver that an end is lifted (shadowSegment), or is too
    /// far away for float. Call no other function then.
    /// @param base of samples of `starts`, including the selected ones
    /// @param asked the samples whose segments are meant
    bool make(const ShadowStarts& starts, const ShaftBase& base, View<const uint32_t> asked,
              const glm::vec3& lightWorld);

    /// Returns whether no voxel is in the shaft, so that all segments are lit.
    bool isEmpty(const WideDagView& dag);

private:
    uint64_t cellsInside(const float corner[3], float side, uint64_t cells) const;

    ShaftPlanes planes_;
    const AbovePlane* above_ = nullptr;
    std::vector<WideCell> open_;
};

} // namespace shadowdag
