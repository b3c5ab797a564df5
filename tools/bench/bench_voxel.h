// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench voxel`: voxelizing and shadow rays, compared with Embree and NanoVDB on the same
// rays in the same run.
#pragma once

#include "tools/bench/bench_view.h"
#include "tools/settings/console.h"
#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

struct VoxelBenchOptions {
    uint32_t width = 320, height = 180;
    uint32_t frameWidth = 320, frameHeight = 180; ///< of the whole frame (bench_frame.h)
    uint32_t resolutionLog2 = 10;
    uint32_t nanoVdbResolutionLog2 =
        11; ///< above it NanoVDB is omitted: its grid takes as much memory as everything else
    int repeats = 10; ///< of fewer than six the interval of a median holds less than 95 %
    double voxelizeSeconds = 120; ///< maximum number of repeats of voxelizing, and the time after
                                  ///< which they end (at least one)
};

/// The share of the rays for which our result may differ from one that need not be equal. Lit where
/// Embree is dark: both round the ends of a segment, each in its own space. Lit where NanoVDB is
/// dark, or the reverse: it has no margin and steps in float (nanovdb_baseline.h), while we count
/// everything within the margin of ray_slabs.h.
constexpr double kEmbreeTolerance = 1e-4;
constexpr double kNanoVdbTolerance = 5e-3;

/// Verifies the results, then measures: voxelizing on all threads; tracing on one, tracers
/// interleaved. Returns the measurements as JSON (keys in the code, units in their names), without
/// provenance. Throws Error kInput when the view has no pairs, or more results are wrong than
/// tolerated; nothing is reported then.
Json runVoxelBench(const World& world, const Camera& camera, const VoxelBenchOptions& options,
                   const Console& console);

/// Prints the result of runVoxelBench as a table.
void printVoxelBench(std::ostream& out, const Json& result);

} // namespace shadowdag
