// SPDX-License-Identifier: Apache-2.0
// Shafts: what all shadow segments of a group of samples towards one light say together. A shaft is
// a convex region that holds every one of the segments. When no occupied voxel meets it, all are
// lit; when the occupied voxels in it part its one end from the other, all are dark; else the cells
// in it are where their rays may be traced from. Answers are those of occluded(), proven, never
// guessed: the predicate of dag_trace.h does not depend on the order in which it is asked.
// Sources: Haines, Wallace, Shaft Culling for Efficient Ray-Traced Radiosity, 1991; Reshetov et
// al., Multi-Level Ray Tracing Algorithm, SIGGRAPH 2005 (entry points).
#pragma once

#include "voxel/dag_stream.h"
#include "voxel/shadow_starts.h"

#include <vector>

namespace shadowdag {

/// Where the segments of a group of samples start, whatever the light: a skewed box around their
/// lifted starts, and their normals.
struct ShaftBase {
    glm::dvec3 corner[8];        ///< voxel space; bits of the index: along axis 0, 1, 2
    glm::dvec3 side[3];          ///< normals of its three pairs of sides; side[2] = normal
    glm::dvec3 normal{0, 0, 1};  ///< about unit
    double normalSpread = 0;     ///< no sample's normal is further from `normal`
};

/// What is known of all segments of a shaft.
enum class ShaftAnswer : uint8_t {
    kMixed, ///< nothing
    kLit,   ///< occluded() is false for every one
    kDark,  ///< occluded() is true for every one
};

/// Cells of a DAG's wide form that a shaft meets.
struct ShaftCells {
    std::vector<WideCell> cells;
    /// All cells are leaves, and each has an occupied voxel in the shaft.
    bool isExact = false;
};

/// The half-spaces that bound a shaft, 16 of them, in float: a point is inside when n . x + d >= 0
/// for all. Some are there twice or bound nothing.
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
    /// Makes the region; returns false when there is none to be had: the light is within a voxel of
    /// the base on every axis, lies so low above the receivers that an end may be lifted
    /// (shadowSegment), or is too far away for float. Nothing else may be asked then.
    /// @param base of samples of `starts`
    bool make(const ShadowStarts& starts, const ShaftBase& base, const glm::vec3& lightWorld);

    /// Writes to `to` the cells of `from` that meet the shaft, refined to leaves whose voxels meet
    /// it; where more than kMostCells would have to be held, the last list of no more than
    /// kCoarseCells instead, not exact. Returns whether any is left: if not, all segments are lit.
    bool refine(const WideDagView& dag, const std::vector<WideCell>& from, ShaftCells& to);

    /// Returns whether the occupied voxels of an exact list part the light from the starts in some
    /// run of slices across the shaft, so that all segments are dark. Not every dark shaft is
    /// found: only runs across the shaft's main axis, in slices no wider than 64 voxels.
    bool isParted(const WideDagView& dag, const ShaftCells& exact);

    static constexpr size_t kMostCells = 512, kCoarseCells = 64;

private:
    uint64_t cellsInside(const float corner[3], float side, uint64_t cells) const;
    bool isInside(const WideCell& cell) const;

    ShaftPlanes planes_;
    std::vector<WideCell> now_, next_;
    glm::dvec3 light_;
    int axis_ = 0;      ///< the main axis
    double sign_ = 1;   ///< the base lies on this side of the light along it
    double low_[4], high_[4]; ///< of (x, y, x + y, x - y) / |w| from the light to base corners
    double nearest_ = 0; ///< least distance between light and base along the axis
    double slack_ = 0;  ///< segments may leave the hull by as much per axis
    double offset_ = 1;
    std::vector<uint32_t> order_; ///< of cells, by slab
};

} // namespace shadowdag
