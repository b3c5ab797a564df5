// SPDX-License-Identifier: Apache-2.0
// ResolveSamples in lanes of doubles: the same operations in the same order.
#include "cuda/parallel_for.h"
#include "hybrid/gbuffer/gbuffer_raster.h"
#include "scenes/double_lanes.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

#if defined(SDAG_DOUBLE_LANES)
namespace {

using namespace avx2;

/// Vectors of floats, one of each lane.
struct FloatVectors {
    alignas(16) float lane[4][4];

    explicit FloatVectors(const Lanes3& v) {
        __m128 x = _mm256_cvtpd_ps(v.x), y = _mm256_cvtpd_ps(v.y), z = _mm256_cvtpd_ps(v.z),
               none = _mm_setzero_ps();
        _MM_TRANSPOSE4_PS(x, y, z, none);
        _mm_store_ps(lane[0], x);
        _mm_store_ps(lane[1], y);
        _mm_store_ps(lane[2], z);
        _mm_store_ps(lane[3], none);
    }
    glm::vec3 operator[](uint32_t i) const { return {lane[i][0], lane[i][1], lane[i][2]}; }
};

/// Resolves pixels [x, x + count) of row `y`, at most four.
void resolveFour(const ResolveSamples& work, uint32_t x, uint32_t y, uint32_t count) {
    const ViewRays& view = work.view;
    const size_t pixel = size_t(y) * view.width + x;
    uint32_t four[4]; // triangles; lanes that see nothing repeat another's
    alignas(16) uint32_t depthBits[4];
    uint32_t seeing = 0;
    for (uint32_t lane = 0; lane < count; ++lane)
        if (work.visibility[pixel + lane] != kNothingSeen)
            seeing |= 1u << lane;
    for (uint32_t lane = 0; lane < 4; ++lane) {
        const bool isSeeing = seeing >> lane & 1u;
        const uint64_t seen =
            seeing == 0
                ? 0
                : work.visibility[pixel + (isSeeing ? lane : uint32_t(std::countr_zero(seeing)))];
        four[lane] = uint32_t(seen);
        depthBits[lane] = uint32_t(seen >> 32);
        if (lane < count && !isSeeing) {
            work.positionWorld[pixel + lane] = work.normalWorld[pixel + lane] = glm::vec3(0.0f);
            work.depthView[pixel + lane] = 0.0f;
            work.triangle[pixel + lane] = kBackground;
        }
    }
    if (seeing == 0)
        return;
    const Lanes3 origin = all(view.origin), first = all(view.first), stepX = all(view.stepX),
                 ofRow = all(double(y) * view.stepY);
    Lanes3 corner[3];
    for (int i = 0; i < 3; ++i)
        corner[i] = difference(vertices(work.triangles, four, i), origin);
    const Lanes3 normal = cross(difference(corner[1], corner[0]), difference(corner[2], corner[0]));
    const Lanes X = all(double(x)) + _mm256_setr_pd(0, 1, 2, 3);
    const Lanes3 direction = {first.x + X * stepX.x + ofRow.x, first.y + X * stepX.y + ofRow.y,
                              first.z + X * stepX.z + ofRow.z};
    const Lanes along = dot(normal, direction);
    const Lanes seen = _mm256_cvtps_pd(_mm_load_ps(reinterpret_cast<const float*>(depthBits)));
    const Lanes ofPlane = dot(normal, corner[0]) / along;
    const Lanes depth =
        _mm256_blendv_pd(seen, ofPlane, atLeast(seen * all(0x1p-20), magnitude(ofPlane - seen)));
    const Lanes toUnit = _mm256_blendv_pd(all(1.0), all(-1.0), above(along, _mm256_setzero_pd())) /
                         _mm256_sqrt_pd(dot(normal, normal));
    const FloatVectors positions({origin.x + depth * direction.x, origin.y + depth * direction.y,
                                  origin.z + depth * direction.z});
    const FloatVectors normals({normal.x * toUnit, normal.y * toUnit, normal.z * toUnit});
    for (; seeing; seeing &= seeing - 1) {
        const auto lane = uint32_t(std::countr_zero(seeing));
        work.positionWorld[pixel + lane] = positions[lane];
        work.normalWorld[pixel + lane] = normals[lane];
        work.depthView[pixel + lane] = std::bit_cast<float>(depthBits[lane]);
        work.triangle[pixel + lane] = four[lane];
    }
}

} // namespace

void launchPass(CpuTag, const ResolveSamples& work) {
    parallelFor<CpuTag>(
        work.view.height,
        [&](size_t row) {
            for (uint32_t x = 0; x < work.view.width; x += 4)
                resolveFour(work, x, uint32_t(row), std::min(4u, work.view.width - x));
        },
        8);
}

#else

void launchPass(CpuTag, const ResolveSamples& work) {
    parallelFor<CpuTag>(work.itemCount(), work, work.grain());
}

#endif

} // namespace shadowdag
