// SPDX-License-Identifier: Apache-2.0
#include "voxel/shadow_starts.h"

#include "cuda/mutant.h"

#include <algorithm>

namespace shadowdag {

void ShadowStarts::reset(const VoxelGrid& grid, float offset) {
    grid_ = grid;
    offset_ = offset;
    for (std::vector<double>* v : {&sampleX_, &sampleY_, &sampleZ_, &normalX_, &normalY_, &normalZ_,
                                   &offsetNorm_, &scale_, &rounding_})
        v->clear();
}

void ShadowStarts::add(const glm::vec3& positionWorld, const glm::vec3& normalWorld) {
    const glm::dvec3 sample = grid_.voxelFromWorld(glm::dvec3(positionWorld));
    const glm::dvec3 n(mutated(Mutant::kRayNormalFlipped, normalWorld, -normalWorld));
    double scale = double(grid_.resolution()), world = 0;
    for (int a = 0; a < 3; ++a) {
        scale = fabs(sample[a]) > scale ? fabs(sample[a]) : scale;
        world = fabs(double(positionWorld[a])) > world ? fabs(double(positionWorld[a])) : world;
    }
    sampleX_.push_back(sample.x);
    sampleY_.push_back(sample.y);
    sampleZ_.push_back(sample.z);
    normalX_.push_back(n.x);
    normalY_.push_back(n.y);
    normalZ_.push_back(n.z);
    const float offset = mutated(Mutant::kLiftEightfold, offset_, 8.0f * offset_);
    offsetNorm_.push_back(double(offset) * (fabs(n.x) + fabs(n.y) + fabs(n.z)));
    scale_.push_back(scale);
    rounding_.push_back(world / grid_.voxelSizeWorld * kSampleRounding);
}

double ShadowStarts::lightExcess(const glm::dvec3& lightVoxel) const {
    const double far = std::max({fabs(lightVoxel.x), fabs(lightVoxel.y), fabs(lightVoxel.z)});
    // |n|_1 is at most sqrt(3) (normals are unit to rounding), |n_a| at most 1.
    return std::max(far - double(grid_.resolution()), 0.0) * kTwiceSlabMargin * double(offset_) *
           1.75;
}

void ShadowStarts::segments(const glm::vec3& lightWorld, View<const uint32_t> which,
                            DagSegment* segments) const {
    glm::dvec3 light = grid_.voxelFromWorld(glm::dvec3(lightWorld));
    light.x = mutated(Mutant::kRayLightMoved, light.x, light.x + 2.0);
    const double lightScale = std::max({fabs(light.x), fabs(light.y), fabs(light.z)});
    size_t i = 0;
#if defined(SDAG_RAY_SLABS_AVX2)
    const double back = double(offset_) * sqrt(3.0), whole = double(offset_);
    // Four at a time; the operations of shadowSegment in its order, both sides of each of its
    // branches.
    const __m256d lx = _mm256_set1_pd(light.x), ly = _mm256_set1_pd(light.y),
                  lz = _mm256_set1_pd(light.z), one = _mm256_set1_pd(1.0),
                  zero = _mm256_setzero_pd(), all = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
    const auto madd = [](__m256d a, __m256d b, __m256d c) {
        return _mm256_add_pd(c, _mm256_mul_pd(a, b)); // not fused: as the one text
    };
    for (; i + 4 <= which.count; i += 4) {
        const __m128i index = _mm_loadu_si128(reinterpret_cast<const __m128i*>(&which[i]));
        const auto at = [&](const std::vector<double>& v) {
            return _mm256_mask_i32gather_pd(zero, v.data(), index, all, 8);
        };
        const __m256d nx = at(normalX_), ny = at(normalY_), nz = at(normalZ_);
        const __m256d scale = _mm256_max_pd(at(scale_), _mm256_set1_pd(lightScale));
        const __m256d slack = madd(scale, _mm256_set1_pd(kTwiceSlabMargin), at(rounding_));
        const __m256d lift = _mm256_mul_pd(at(offsetNorm_), _mm256_add_pd(one, slack));
        const __m256d fx = madd(nx, lift, at(sampleX_)), fy = madd(ny, lift, at(sampleY_)),
                      fz = madd(nz, lift, at(sampleZ_));
        const __m256d wx = _mm256_sub_pd(lx, fx), wy = _mm256_sub_pd(ly, fy),
                      wz = _mm256_sub_pd(lz, fz);
        const __m256d length = _mm256_sqrt_pd(_mm256_add_pd(
            _mm256_add_pd(_mm256_mul_pd(wx, wx), _mm256_mul_pd(wy, wy)), _mm256_mul_pd(wz, wz)));
        const __m256d rest = _mm256_sub_pd(length, _mm256_set1_pd(back));
        const __m256d isLong = _mm256_cmp_pd(length, _mm256_set1_pd(back), _CMP_GT_OQ);
        const __m256d t = _mm256_div_pd(rest, length);
        __m256d tx = _mm256_blendv_pd(fx, madd(wx, t, fx), isLong);
        __m256d ty = _mm256_blendv_pd(fy, madd(wy, t, fy), isLong);
        __m256d tz = _mm256_blendv_pd(fz, madd(wz, t, fz), isLong);
        const __m256d height =
            _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(_mm256_sub_pd(tx, fx), nx),
                                        _mm256_mul_pd(_mm256_sub_pd(ty, fy), ny)),
                          _mm256_mul_pd(_mm256_sub_pd(tz, fz), nz));
        const __m256d isLow = _mm256_cmp_pd(height, zero, _CMP_LT_OQ);
        const auto lowered = [&](__m256d v, __m256d n) {
            return _mm256_blendv_pd(v, _mm256_sub_pd(v, _mm256_mul_pd(n, height)), isLow);
        };
        tx = lowered(tx, nx);
        ty = lowered(ty, ny);
        tz = lowered(tz, nz);
        const __m256d half = _mm256_mul_pd(_mm256_set1_pd(0.5), rest);
        const __m256d ahead = _mm256_min_pd(half, _mm256_set1_pd(whole));
        const __m256d isDrawn = _mm256_andnot_pd(isLow, _mm256_cmp_pd(ahead, zero, _CMP_GT_OQ));
        const __m256d a = _mm256_div_pd(ahead, length);
        const __m256d sx = _mm256_blendv_pd(fx, madd(wx, a, fx), isDrawn);
        const __m256d sy = _mm256_blendv_pd(fy, madd(wy, a, fy), isDrawn);
        const __m256d sz = _mm256_blendv_pd(fz, madd(wz, a, fz), isDrawn);
        alignas(16) float ends[6][4];
        _mm_store_ps(ends[0], _mm256_cvtpd_ps(sx));
        _mm_store_ps(ends[1], _mm256_cvtpd_ps(sy));
        _mm_store_ps(ends[2], _mm256_cvtpd_ps(sz));
        _mm_store_ps(ends[3], _mm256_cvtpd_ps(tx));
        _mm_store_ps(ends[4], _mm256_cvtpd_ps(ty));
        _mm_store_ps(ends[5], _mm256_cvtpd_ps(tz));
        for (int k = 0; k < 4; ++k)
            segments[i + k] = {{ends[0][k], ends[1][k], ends[2][k]},
                               {ends[3][k], ends[4][k], ends[5][k]}};
    }
#endif
    for (; i < which.count; ++i) {
        const uint32_t s = which[i];
        const double scale = lightScale > scale_[s] ? lightScale : scale_[s];
        const double lift = offsetNorm_[s] * (1.0 + (scale * kTwiceSlabMargin + rounding_[s]));
        const glm::dvec3 n = normal(s);
        const glm::dvec3 from = glm::dvec3(sampleX_[s], sampleY_[s], sampleZ_[s]) + n * lift;
        segments[i] = segmentFromLifted(from, n, light, double(offset_), 1.0);
    }
}

} // namespace shadowdag
