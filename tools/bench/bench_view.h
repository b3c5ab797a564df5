// SPDX-License-Identifier: Apache-2.0
// The samples and clusters of a camera's view, and the shadow rays of its pairs, for benchmarks.
#pragma once

#include "cuda/quantile_interval.h"
#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/gbuffer/gbuffer_pass.h"
#include "hybrid/judge/embree_baseline.h"
#include "scenes/world.h"
#include "tools/settings/json.h"
#include "voxel/dag_trace.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The view samples of one frame on the CPU, and their clusters.
struct BenchView {
    GBuffer gbuffer{Backend::kCpu};
    ClusterSet clusters{Backend::kCpu};
};

/// Returns the samples and clusters of the camera at width x height. Throws Error kUsage as
/// makeViewRays does.
BenchView makeBenchView(const World& world, const Camera& camera, uint32_t width, uint32_t height);

/// The order of a frame's pairs.
enum class RayOrder {
    kImage,   ///< light by light, samples in scanline order
    kCluster, ///< cluster by cluster, light by light: neighbours have similar ends
};
constexpr RayOrder kRayOrders[] = {RayOrder::kImage, RayOrder::kCluster};
const char* rayOrderName(RayOrder order);

/// The shadow rays of a frame's pairs (hybrid/clusters/pairs.h) by shadowSegment(): the same
/// segments twice, in the voxel space of a grid and in world space, each rounded to float.
struct BenchRays {
    std::vector<DagSegment> voxel;
    std::vector<WorldSegment> world;
};

/// Returns the shadow rays of all pairs of the view except those to directional lights, with the
/// offset of 1. Deterministic.
BenchRays makeBenchRays(const BenchView& view, const World& world, const VoxelGrid& grid,
                        RayOrder order);

/// Median of a measurement's repeats with its interval, least and greatest.
struct Spread {
    QuantileInterval median;
    double min = 0, max = 0;

    /// Returns the spread of at least one value.
    static Spread of(const std::vector<double>& values);

    /// Returns `key` (the median), and beside it `key`_low, `key`_high and `key`_confidence (its
    /// interval by order statistics), `key`_min and `key`_max.
    Json toJson(const std::string& key) const;
};

} // namespace shadowdag
