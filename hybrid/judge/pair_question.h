// SPDX-License-Identifier: Apache-2.0
// A pair, and the result of repeating its method: what explain.cpp and failure_names.cpp ask about.
#pragma once

#include "hybrid/judge/explain.h"

namespace shadowdag {

struct PairJudge::Question {
    glm::vec3 position, normal, light;
    uint32_t receiver;
    Route route;
    uint32_t map; ///< maps
    double rhoWorld;
    double ownRhoWorld;         ///< maps: rho by the texels that the map has
    double displacedWorld;      ///< of a shadow's edge at the sample; 0: not by resolution
    double leastDisplacedWorld; ///< voxels: from wherever in its cell the ray was stopped
    double startOffsetWorld, endOffsetWorld;
    bool isExact; ///< rays, by triangles: only rounding can differ
    /// The map has fewer texels than its clusters request, or the cell that stopped the ray is
    /// larger than the rule of its levels asks.
    bool isCoarserThanAsked;
    bool isOfOwnLight;    ///< maps: the map is one of the pair's light
    DagHit hit;           ///< rays, dark by a voxel
    ShadowMapTrace trace; ///< maps, dark
};

} // namespace shadowdag
