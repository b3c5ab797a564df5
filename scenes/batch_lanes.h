// SPDX-License-Identifier: Apache-2.0
// Eight vertices, or eight triangles of a batch, at once, in floats: what the CPU's rasterizers
// have in common before they set triangles up in doubles.
#pragma once

#include "scenes/batches.h"
#include "scenes/double_lanes.h"

#include <algorithm>

#if defined(SDAG_DOUBLE_LANES)

namespace shadowdag::avx2 {

/// Requests from memory what drawing a batch reads: its vertices, the corners of its triangles, and
/// their numbers.
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

/// Returns corner `corner` of four triangles of a batch, in world space.
/// @param positions of the batch @param four their corners
inline Lanes3 cornersOfFour(const glm::vec3* positions, const BatchCorners* const* four,
                            int corner) {
    const auto vertex = [&](int lane) { return &positions[four[lane]->of[corner]].x; };
    const float* const vectors[4] = {vertex(0), vertex(1), vertex(2), vertex(3)};
    return fourVectors(vectors);
}

/// Eight vectors of three floats, by coordinate.
struct Floats3 {
    __m256 of[3];
};

/// Returns eight vectors, one after the other.
inline Floats3 eightVectors(const float* first) {
    const auto rows = [&](int i) {
        return _mm256_set_m128(_mm_loadu_ps(first + 12 + 4 * i), _mm_loadu_ps(first + 4 * i));
    };
    const __m256 a = rows(0), b = rows(1), c = rows(2);
    const __m256 xy = _mm256_shuffle_ps(b, c, _MM_SHUFFLE(2, 1, 3, 2)),
                 yz = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 2, 1));
    return {{_mm256_shuffle_ps(a, xy, _MM_SHUFFLE(2, 0, 3, 0)),
             _mm256_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0)),
             _mm256_shuffle_ps(yz, c, _MM_SHUFFLE(3, 0, 3, 1))}};
}

/// Exchanges rows and columns of two 4 x 4 matrices, one in each half.
inline void transpose(__m256 (&rows)[4]) {
    const __m256 a = _mm256_unpacklo_ps(rows[0], rows[1]), b = _mm256_unpackhi_ps(rows[0], rows[1]),
                 c = _mm256_unpacklo_ps(rows[2], rows[3]), d = _mm256_unpackhi_ps(rows[2], rows[3]);
    rows[0] = _mm256_shuffle_ps(a, c, _MM_SHUFFLE(1, 0, 1, 0));
    rows[1] = _mm256_shuffle_ps(a, c, _MM_SHUFFLE(3, 2, 3, 2));
    rows[2] = _mm256_shuffle_ps(b, d, _MM_SHUFFLE(1, 0, 1, 0));
    rows[3] = _mm256_shuffle_ps(b, d, _MM_SHUFFLE(3, 2, 3, 2));
}

/// The vertices of a batch, as four floats each.
struct BatchVertices {
    struct alignas(16) Vertex {
        float of[4];
    };
    static constexpr uint32_t kMaxCount = 3 * kMaxBatchTriangleCount + BatchVerticesView::kPadding;
    Vertex vertices[kMaxCount];

    /// Sets eight vertices from `first` on. @param rows one number of all eight each
    void set(uint32_t first, __m256 (&rows)[4]) {
        transpose(rows);
        for (uint32_t i = 0; i < 4; ++i) {
            _mm_store_ps(vertices[first + i].of, _mm256_castps256_ps128(rows[i]));
            _mm_store_ps(vertices[first + i + 4].of, _mm256_extractf128_ps(rows[i], 1));
        }
    }
};

/// The corners of eight triangles of a batch.
class EightTriangles {
public:
    /// @param inBatch the first @param count of them, 1..8; the last one stands for the others
    EightTriangles(const BatchVertices& batch, const BatchCorners* corners, uint32_t inBatch,
                   uint32_t count) {
        for (int c = 0; c < 3; ++c) {
            const auto vertex = [&](uint32_t i) {
                const BatchCorners& triangle = corners[inBatch + std::min(i, count - 1)];
                return _mm_load_ps(batch.vertices[triangle.of[c]].of);
            };
            for (uint32_t i = 0; i < 4; ++i)
                corner_[c][i] = _mm256_set_m128(vertex(i + 4), vertex(i));
            transpose(corner_[c]);
        }
    }
    /// Returns the least, or the greatest, number `i` of the corners.
    __m256 least(int i) const {
        return _mm256_min_ps(corner_[0][i], _mm256_min_ps(corner_[1][i], corner_[2][i]));
    }
    __m256 most(int i) const {
        return _mm256_max_ps(corner_[0][i], _mm256_max_ps(corner_[1][i], corner_[2][i]));
    }

private:
    __m256 corner_[3][4];
};

/// Whole numbers from `first` to `last`, eight times; none where `last` is less.
struct WholeSpans {
    __m256 first, last;

    /// Those of [from, to] within [0, end].
    WholeSpans(__m256 from, __m256 to, float end)
        : first(_mm256_ceil_ps(_mm256_max_ps(from, _mm256_setzero_ps()))),
          last(_mm256_floor_ps(_mm256_min_ps(to, _mm256_set1_ps(end)))) {}

    __m256 isAny() const { return _mm256_cmp_ps(last, first, _CMP_GE_OQ); }
};

/// Returns the first `count` of eight lanes.
inline __m256 firstLanes(uint32_t count) {
    return _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(int(count)),
                                                  _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
}

/// Stores eight integers. @param to 32 bytes, aligned
inline void storeWhole(int32_t* to, __m256i values) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(to), values);
}

} // namespace shadowdag::avx2

#endif
