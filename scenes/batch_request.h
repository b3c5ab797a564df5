// SPDX-License-Identifier: Apache-2.0
// Requests the data of a batch from memory before they are needed, on the CPU.
#pragma once

#include "scenes/batches.h"

#if defined(__SSE__) && !defined(__CUDACC__)
#include <xmmintrin.h>

namespace shadowdag {

/// Requests what drawing a batch reads: its vertices, the corners of its triangles, and their
/// numbers.
inline void requestBatch(View<const Batch> batches, const BatchVerticesView& vertices,
                         View<const uint32_t> batchTriangles, uint32_t batchIndex) {
    const auto request = [](const auto* first, size_t count) {
        constexpr size_t kLine = 64; // bytes that are requested at once
        const char* const begin = reinterpret_cast<const char*>(first);
        for (size_t i = 0; i < count * sizeof(*first); i += kLine)
            _mm_prefetch(begin + i, _MM_HINT_T0);
    };
    const Batch& batch = batches[batchIndex];
    request(vertices.positions.data + vertices.first[batchIndex], vertices.count(batchIndex));
    request(vertices.corners.data + batch.first, batch.count);
    request(batchTriangles.data + batch.first, batch.count);
}

} // namespace shadowdag

#endif
