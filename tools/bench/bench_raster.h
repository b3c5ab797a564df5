// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench raster`: times the building of virtual cube shadow maps, stage by stage,
// compared with Embree's rays along as many texel centres.
#pragma once

#include "scenes/world.h"
#include "shadowmap/shadow_maps.h"
#include "tools/settings/console.h"
#include "tools/settings/json.h"

#include <vector>

namespace shadowdag {

struct RasterBenchOptions {
    uint32_t width = 320, height = 180; ///< of the view whose clusters read the maps
    uint32_t mapCount = 40;             ///< lights beyond it get no map
    uint32_t faceTexels = 512; ///< the largest; maps are spread over a factor of 16 below it
    uint32_t pageTexels = ShadowMapOptions{}.pageTexels;
    int repeats = 5;
};

/// The maps of a view: the input of ShadowMaps::build.
struct RasterBenchInputs {
    std::vector<MapRequest> requests;
    std::vector<Box> boxes;
    std::vector<MapReceiver> receivers;
};

/// Returns requests for the first lights that reach clusters of the view. Deterministic.
RasterBenchInputs makeRasterBenchInputs(const World& world, const Camera& camera,
                                        const RasterBenchOptions& options);

/// The tolerated relative difference of a stored depth from Embree's, and the tolerated share of
/// texels with a larger one: their centres lie on an edge within rounding.
constexpr float kDepthTolerance = 1e-4f;
constexpr double kTexelTolerance = 1e-3;

/// Verifies (the CPU's kernel against the shared code, bit for bit; depths against Embree along
/// texel centres), then measures `repeats` builds on all threads. Returns the measurements as JSON,
/// without provenance. Throws Error kInput when no light reaches the view or a check fails;
/// nothing is reported then.
Json runRasterBench(const World& world, const Camera& camera, const RasterBenchOptions& options,
                    const Console& console);

/// Prints the result of runRasterBench as a table.
void printRasterBench(std::ostream& out, const Json& result);

} // namespace shadowdag
