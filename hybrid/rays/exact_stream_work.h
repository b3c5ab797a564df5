// SPDX-License-Identifier: Apache-2.0
// What exact_stream.cpp passes to the files that are compiled for one kind of processor each. Plain
// pointers, for the reason that dag_stream_work.h gives.
#pragma once

#include "hybrid/rays/triangle_bvh_nodes.h"

#include <cstddef>
#include <cstdint>

namespace shadowdag::stream {

/// One call of ExactStream::trace: rays to one light. Local space (TruthSpace), its unit of length.
struct ExactWork {
    const TriangleBvhNode* nodes;
    const TriangleBvhLeaf* leaves;
    uint32_t root; ///< not kNoTriangleChild

    /// What coordinates are taken relative to: the light; of a directional light one of the starts.
    float origin[3];
    /// Unit vector towards a directional light.
    float direction[3];
    /// Largest distance of a ray's end in the truth from the light, beyond what rounding the light
    /// and the ray to float does: by how much the truth raises it above a receiver's plane. Of a
    /// directional light: the largest angle between `direction` and a ray of the truth.
    float endError;
    float size; ///< directional lights: no start is farther than this from any triangle

    const float* starts;       ///< x, y, z of each ray
    const uint32_t* receivers; ///< triangle that never blocks the ray
    size_t count;
    uint8_t* blocked;

    /// Returns whether the triangle blocks the ray of that index, by the truth's test in double.
    bool (*confirm)(void* user, uint32_t ray, uint32_t triangle);
    void* user;
    uint64_t confirmCount; ///< grows by the number of calls of confirm
};

void traceExactPortable(ExactWork& work, bool isDirectional);
void traceExactAvx2(ExactWork& work, bool isDirectional);   ///< where hasStreamIsa(kAvx2)
void traceExactAvx512(ExactWork& work, bool isDirectional); ///< where hasStreamIsa(kAvx512)

} // namespace shadowdag::stream
