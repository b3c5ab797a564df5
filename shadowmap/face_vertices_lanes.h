// SPDX-License-Identifier: Apache-2.0
// Which triangles of a batch may cover texels of a face, found in floats: the vertices of a batch
// are projected once, and eight triangles are bounded at once. What remains is set up in doubles
// (rasterize_lanes.h), which decides; floats only leave out what covers nothing for certain. Half
// of the triangles of a scene with millions of them lie between texel centres.
#pragma once

#include "scenes/batch_lanes.h"
#include "shadowmap/rasterize_lanes.h"

#include <bit>
#include <cstddef>

#if defined(SDAG_RASTERIZE_AVX2)

namespace shadowdag::avx2 {

/// faceFromWorld of eight points, one after the other, each coordinate rounded once.
inline Floats3 roundedFromWorld(const float* first, const ShadowMapInfo& map, uint32_t face) {
    if (map.window.isDirectional()) {
        const Lanes3 a = faceFromWorld(fourVectors(first), map, face),
                     b = faceFromWorld(fourVectors(first + 12), map, face);
        const auto both = [](Lanes low, Lanes high) {
            return _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
        };
        return {{both(a.x, b.x), both(a.y, b.y), both(a.z, b.z)}};
    }
    Floats3 p = eightVectors(first);
    for (int axis = 0; axis < 3; ++axis)
        p.of[axis] = _mm256_sub_ps(p.of[axis], _mm256_set1_ps(map.lightPositionWorld[axis]));
    const uint32_t axis = face / 2; // as faceFromWorld
    return {{p.of[axis == 2 ? 0 : axis + 1], p.of[axis == 0 ? 2 : axis - 1],
             _mm256_xor_ps(p.of[axis], _mm256_set1_ps((face & 1u) ? -0.0f : 0.0f))}};
}

/// Sets `count` vertices of a batch as a face of a map sees them: x and y in texels, whole numbers
/// at centres; w = 1/z, or -1 where x and y are of no use: near the light's plane, or behind it; z,
/// along the face's axis. Where w is positive, and x and y within the face, they are off by less
/// than 2^-21 of its width, and w by less than 2^-22 of itself: p - light is rounded once, as are
/// 1/z, the quotient, and the three steps that make texels of it, by 2^-24 of at most the width.
/// @param positions world space; may be read up to the next multiple of eight
inline void projectOnFace(const glm::vec3* positions, uint32_t count, const ShadowMapInfo& map,
                          uint32_t face, BatchVertices& vertices) {
    const __m256 half = _mm256_set1_ps(0.5f * float(map.faceTexels)), one = _mm256_set1_ps(1.0f),
                 centre = _mm256_set1_ps(0.5f);
    const __m256 nearest = _mm256_set1_ps(float(nearDepth(map)) * (1.0f + 0x1p-20f)),
                 largest = _mm256_set1_ps(1e30f);
    const auto isSmall = [&](__m256 v) { // and a number
        return _mm256_cmp_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0f), v), largest, _CMP_LT_OQ);
    };
    for (uint32_t v = 0; v < count; v += 8) {
        const Floats3 p = roundedFromWorld(&positions[v].x, map, face);
        const __m256 z = p.of[2], perZ = _mm256_div_ps(one, z);
        const __m256 x = _mm256_mul_ps(p.of[0], perZ), y = _mm256_mul_ps(p.of[1], perZ);
        const __m256 isUsable =
            _mm256_and_ps(_mm256_and_ps(_mm256_cmp_ps(nearest, z, _CMP_LT_OQ), isSmall(z)),
                          _mm256_and_ps(isSmall(x), isSmall(y)));
        __m256 rows[4] = {_mm256_sub_ps(_mm256_mul_ps(_mm256_add_ps(x, one), half), centre),
                          _mm256_sub_ps(_mm256_mul_ps(_mm256_add_ps(y, one), half), centre),
                          _mm256_blendv_ps(_mm256_set1_ps(-1.0f), perZ, isUsable), z};
        vertices.set(v, rows);
    }
}

/// A triangle of a batch that may cover texels of a face.
struct TexelBounds {
    int32_t x0, y0, x1, y1; ///< no texel beyond these is covered
    uint32_t nearest;       ///< bits of a 1/z that no stored depth of it exceeds
    uint32_t inBatch;       ///< its number
};

/// Returns which of eight rectangles of texels (bits) touch a page with memory in which something
/// may be farther than the rectangle's triangle, or more than 2 x 2 pages.
/// @param nearest bits of the triangles' greatest 1/z @param wanted lanes that are rectangles
inline uint32_t touchPages(const FacePages& pages, __m256i x0, __m256i y0, __m256i x1, __m256i y1,
                           __m256i nearest, __m256i wanted) {
    const __m128i log2 = _mm_cvtsi32_si128(int(pages.view.pageTexelsLog2));
    const auto pageOf = [&](__m256i texel) { return _mm256_srl_epi32(texel, log2); };
    const __m256i first[2] = {pageOf(x0), pageOf(y0)}, last[2] = {pageOf(x1), pageOf(y1)};
    const __m256i one = _mm256_set1_epi32(1), none = _mm256_set1_epi32(-1);
    const __m256i isWide =
        _mm256_or_si256(_mm256_cmpgt_epi32(_mm256_sub_epi32(last[0], first[0]), one),
                        _mm256_cmpgt_epi32(_mm256_sub_epi32(last[1], first[1]), one));
    __m256i touched = _mm256_and_si256(wanted, isWide);
    const auto test = [&](__m256i x, __m256i y, __m256i lanes) {
        const __m256i at =
            _mm256_add_epi32(x, _mm256_mullo_epi32(y, _mm256_set1_epi32(pages.across)));
        const __m256i page = _mm256_mask_i32gather_epi32(
            none, reinterpret_cast<const int*>(pages.table), at, lanes, sizeof(uint32_t));
        const __m256i isMissing = _mm256_cmpeq_epi32(page, none); // kNoPage
        const __m256i least = _mm256_mask_i32gather_epi32(
            _mm256_set1_epi32(0x7fffffff), reinterpret_cast<const int*>(pages.floors.data()), page,
            _mm256_andnot_si256(isMissing, lanes), sizeof(PageFloor));
        touched =
            _mm256_or_si256(touched, _mm256_and_si256(lanes, _mm256_cmpgt_epi32(nearest, least)));
    };
    const auto bits = [](__m256i lanes) { return _mm256_movemask_ps(_mm256_castsi256_ps(lanes)); };
    const __m256i narrow = _mm256_andnot_si256(isWide, wanted);
    test(first[0], first[1], narrow);
    const __m256i twoX = _mm256_andnot_si256(_mm256_cmpeq_epi32(first[0], last[0]), narrow),
                  twoY = _mm256_andnot_si256(_mm256_cmpeq_epi32(first[1], last[1]), narrow);
    if (bits(twoX))
        test(last[0], first[1], twoX);
    if (bits(twoY)) {
        test(first[0], last[1], twoY);
        test(last[0], last[1], _mm256_and_si256(twoX, twoY));
    }
    return uint32_t(bits(touched));
}
static_assert(kNoPage == 0xffffffffu && offsetof(PageFloor, least) == 0);

/// Bounds eight triangles of a batch from `inBatch` on. Writes those that may cover texels of pages
/// with memory, as far as touchPages tells, to `bounded`, in order, and returns their number.
/// @param vertices by projectOnFace @param count of triangles, 1..8 @param bounded holds eight
inline uint32_t boundTexelsOfEight(const BatchVertices& vertices, const BatchCorners* corners,
                                   uint32_t inBatch, uint32_t count, const FacePages& pages,
                                   TexelBounds* bounded) {
    const EightTriangles eight(vertices, corners, inBatch, count);
    const float n = float(pages.map->faceTexels);
    // Triangles near the light's plane, or across it, are bounded when they are set up.
    const __m256 isUnknown = eight.least(2), isBehind = eight.most(3); // by their signs
    __m256 kept = _mm256_andnot_ps(isBehind, firstLanes(count));
    __m256i first[2], last[2];
    for (int i = 0; i < 2; ++i) {
        const __m256 margin = _mm256_set1_ps(n * 0x1p-20f + 0x1p-16f);
        WholeSpans spans(_mm256_sub_ps(eight.least(i), margin),
                         _mm256_add_ps(eight.most(i), margin), n - 1.0f);
        spans.first = _mm256_blendv_ps(spans.first, _mm256_setzero_ps(), isUnknown);
        spans.last = _mm256_blendv_ps(spans.last, _mm256_set1_ps(n - 1.0f), isUnknown);
        kept = _mm256_and_ps(kept, spans.isAny());
        first[i] = _mm256_cvttps_epi32(spans.first);
        last[i] = _mm256_cvttps_epi32(spans.last);
    }
    if (!_mm256_movemask_ps(kept))
        return 0;
    const __m256 nearest =
        _mm256_blendv_ps(_mm256_mul_ps(eight.most(2), _mm256_set1_ps(1.0f + 0x1p-21f)),
                         _mm256_set1_ps(kLargestInverseDepth), isUnknown);
    const __m256i isKept = _mm256_srai_epi32(_mm256_castps_si256(kept), 31); // by its sign
    uint32_t touched = touchPages(pages, first[0], first[1], last[0], last[1],
                                  _mm256_castps_si256(nearest), isKept);
    if (!touched)
        return 0;
    alignas(32) int32_t rect[4][8], bits[8];
    for (int i = 0; i < 2; ++i) {
        storeWhole(rect[i], first[i]);
        storeWhole(rect[i + 2], last[i]);
    }
    storeWhole(bits, _mm256_castps_si256(nearest));
    uint32_t written = 0;
    for (; touched; touched &= touched - 1) {
        const int i = std::countr_zero(touched);
        bounded[written++] = {rect[0][i], rect[1][i],        rect[2][i],
                              rect[3][i], uint32_t(bits[i]), inBatch + uint32_t(i)};
    }
    return written;
}

/// Returns whether all texels of a small triangle's rectangle are known to be nearer; false for
/// others.
inline bool isHidden(const FacePages& pages, const TexelBounds& t) {
    if (t.x1 - t.x0 >= kNarrowTexels || t.y1 - t.y0 >= kNarrowTexels)
        return false;
    const RasterView& view = pages.view;
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t side = 1 << log2;
    // Bits of positive floats order as integers.
    const __m128i nearest = _mm_set1_epi32(int32_t(t.nearest));
    for (int32_t py = t.y0 >> log2; py <= t.y1 >> log2; ++py)
        for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
            const uint32_t page = pages.table[py * pages.across + px];
            if (page == kNoPage)
                continue;
            const FourColumns columns(px, side, t.x0, t.x1);
            const int32_t top = std::max(t.y0, py * side),
                          bottom = std::min(t.y1, py * side + side - 1);
            const uint32_t* row = view.depths.data + (size_t(page) << (2 * log2)) +
                                  (size_t(top - py * side) << log2) +
                                  size_t(columns.first - px * side);
            __m128i isNearer = _mm_setzero_si128();
            for (int32_t y = top; y <= bottom; ++y, row += side)
                isNearer = _mm_or_si128(
                    isNearer, _mm_cmpgt_epi32(
                                  nearest, _mm_loadu_si128(reinterpret_cast<const __m128i*>(row))));
            if (!_mm_testz_si128(isNearer, columns.isIn))
                return false;
        }
    return true;
}

} // namespace shadowdag::avx2

#endif
