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
    double displacedWorld; ///< of a shadow's edge at the sample; 0: not by resolution
    double startOffsetWorld, endOffsetWorld;
    bool isExact;            ///< rays, by triangles: only rounding can differ
    bool isCoarserThanAsked; ///< maps: the map has fewer texels than its clusters request
    bool isOfOwnLight;       ///< maps: the map is one of the pair's light
    DagHit hit;              ///< rays, dark by a voxel
    ShadowMapTrace trace;    ///< maps, dark
};

} // namespace shadowdag
