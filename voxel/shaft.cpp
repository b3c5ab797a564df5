// SPDX-License-Identifier: Apache-2.0
// Why a shaft is conservative. With eps = 2^-24 and S no less than the resolution and every
// coordinate, ends included:
//  - A segment's exact ends, before they are rounded to float, lie in the hull of the lifted starts
//    and the light: shadowSegment moves both along the way between them. (An end that it lifts does
//    not; make() refuses lights so low.) Rounding moves them by eps S per axis.
//  - The predicate takes no voxel that lies further than twice its margin, 32 eps S per axis, from
//    the segment (ray_slabs.h).
//  - n is rounded to float first, then d is computed for that n, in double, as the support of base
//    and light; rounding d to float: 3 eps |n|_1 S. What a cell's test adds, in float: four fma for
//    the node's corner, each at most 3 eps |n|_1 S; the cells' table, 2 eps |n|_1 S; one fma more.
// Sum: 1 + 32 + 3 + 15 + 2 = 53; d grants 56 eps |n|_1 S. (Signs: a cell is dropped when the
// greatest n . x + d over it is computed negative.)
#include "voxel/shaft.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// Larger coordinates, in voxels, leave float no fraction; nothing is proven there.
constexpr double kLargest = 1e6;

/// Above this height over the receiver, in voxels, a light's end is not lifted, whatever rounding
/// does in double.
constexpr double kLowest = 1e-6;

/// Coordinates x | y << 1 | z << 2 of children, twice (dag.h), to x, y, z in 0..3.
inline glm::uvec3 placeOf(uint32_t cell) {
    return {(cell >> 3 & 1) * 2 + (cell & 1), (cell >> 4 & 1) * 2 + (cell >> 1 & 1),
            (cell >> 5 & 1) * 2 + (cell >> 2 & 1)};
}

struct Places {
    float at[64][3] = {};
    constexpr Places() {
        for (uint32_t i = 0; i < 64; ++i)
            for (uint32_t a = 0; a < 3; ++a)
                at[i][a] = float((i >> (3 + a) & 1) * 2 + (i >> a & 1));
    }
};
constexpr Places kPlaces;

inline uint64_t maskAt(const uint32_t* words, uint32_t address) {
    return words[address] | uint64_t(words[address + 1]) << 32;
}

} // namespace

void AbovePlane::make(const glm::vec3& normal) {
    float places[64], greatest = -1e30f;
    least_ = 1e30f;
    for (uint32_t i = 0; i < 64; ++i) {
        places[i] = glm::dot(normal, glm::vec3(placeOf(i)));
        least_ = std::min(least_, places[i]);
        greatest = std::max(greatest, places[i]);
    }
    const float width = std::max(greatest - least_, 1e-6f);
    scale_ = float(kCount) / width;
    for (uint32_t b = 0; b < kCount; ++b) {
        const float from = least_ + float(b) * (width / float(kCount));
        above_[b] = 0;
        for (uint32_t i = 0; i < 64; ++i)
            above_[b] |= uint64_t(places[i] >= from - kSlack * width) << i;
    }
}

bool Shaft::make(const ShadowStarts& starts, const ShaftBase& base, View<const uint32_t> asked,
                 const glm::vec3& lightWorld) {
    const VoxelGrid& grid = starts.grid();
    const glm::dvec3 l = grid.voxelFromWorld(glm::dvec3(lightWorld));
    const double offset = double(starts.offset());
    const double excess = starts.lightExcess(l);

    for (int a = 0; a < 3; ++a) { // NaN is refused here, comparisons below would pass it
        bool isSmall = std::fabs(l[a]) < kLargest;
        for (const glm::dvec3& c : base.corner)
            isSmall &= std::fabs(c[a]) < kLargest;
        if (!isSmall)
            return false;
    }
    double scale = grid.resolution();
    double separation[3][2]; // base - light along the axis: least, greatest
    for (int a = 0; a < 3; ++a) {
        double least = base.corner[0][a], greatest = least;
        for (int c = 1; c < 8; ++c) {
            least = std::min(least, base.corner[c][a]);
            greatest = std::max(greatest, base.corner[c][a]);
        }
        scale = std::max({scale, std::fabs(least), std::fabs(greatest), std::fabs(l[a])});
        separation[a][0] = least - l[a];
        separation[a][1] = greatest - l[a];
    }
    scale = scale * (1 + 1e-6) + excess;
    int axis = 0;       // the main one
    double nearest = 0; // least distance between light and base along it
    double sign = 1;    // the base lies on this side of the light along it
    for (int a = 0; a < 3; ++a) {
        const double away = std::max(separation[a][0], -separation[a][1]);
        if (away > nearest) {
            nearest = away;
            axis = a;
            sign = separation[a][0] > 0 ? 1.0 : -1.0;
        }
    }
    if (!(nearest > 1.0 + excess))
        return false;

    // Starts are drawn towards the light by at least so much, which lifts them so far.
    const double back = offset * 1.7320508075688772;
    double lowest = 1e300, furthest = 0;
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& c : base.corner) {
        const glm::dvec3 way = l - c;
        lowest = std::min(lowest, glm::dot(base.normal, way));
        furthest = std::max(furthest, glm::dot(way, way));
        middle -= way;
    }
    furthest = std::sqrt(furthest) + 2 * excess;
    lowest -= 2 * excess;
    // No end may be lifted: n_i . (light - start_i) >= n . (light - start_i) - spread * distance is
    // enough; else the samples are asked one by one.
    if (!(lowest - base.normalSpread * furthest > kLowest))
        for (const uint32_t i : asked)
            if (!(glm::dot(starts.normal(i), l - starts.liftedStart(i)) - 2 * excess > kLowest))
                return false;
    const double drawn = std::max(std::min(offset, 0.5 * (nearest - excess - back)), 0.0);
    const double gain = drawn * std::max(lowest, 0.0) / furthest;
    // Ends stay `back` short of the light: so far before a plane across the shaft. No direction's
    // cosine is less than the least height over the greatest length.
    middle = middle / glm::length(middle);
    double height = 1e300;
    for (const glm::dvec3& c : base.corner)
        height = std::min(height, glm::dot(middle, c - l));
    const double before =
        std::max(height, 0.0) / furthest * std::min(back, std::max(nearest - excess, 0.0));

    const int w = axis, u = (w + 1) % 3, v = (w + 2) % 3;
    // Of (x, y, x + y, x - y) / |w| from the light to the base's corners.
    double low[4], high[4];
    for (int k = 0; k < 4; ++k) {
        low[k] = 1e300;
        high[k] = -1e300;
    }
    for (const glm::dvec3& c : base.corner) {
        const double inverse = 1.0 / std::fabs(c[w] - l[w]);
        const double x = (c[u] - l[u]) * inverse, y = (c[v] - l[v]) * inverse;
        const double of[4] = {x, y, x + y, x - y};
        for (int k = 0; k < 4; ++k) {
            low[k] = std::min(low[k], of[k]);
            high[k] = std::max(high[k], of[k]);
        }
    }

    // Eight planes through the light, the receivers', the far sides of the box in the grid's axes,
    // the sides of the skewed box.
    glm::dvec3 n[ShaftPlanes::kCount];
    for (int k = 0; k < 4; ++k) {
        glm::dvec3 along(0.0);
        along[u] = k == 1 ? 0 : 1;
        along[v] = k == 0 ? 0 : k == 3 ? -1 : 1;
        n[2 * k] = along;
        n[2 * k][w] = -low[k] * sign;
        n[2 * k + 1] = -along;
        n[2 * k + 1][w] = high[k] * sign;
    }
    n[8] = base.normal;
    for (int a = 0; a < 3; ++a) {
        n[9 + a] = glm::dvec3(0.0);
        n[9 + a][a] = separation[a][0] + separation[a][1] > 0 ? -1.0 : 1.0;
    }
    n[12] = base.side[0];
    n[13] = -base.side[0];
    n[14] = base.side[1];
    n[15] = middle;
    // Planes in lanes: the loops over p are what the compiler makes vectors of.
    constexpr int kCount = ShaftPlanes::kCount;
    double nx[kCount], ny[kCount], nz[kCount], ofLight[kCount], support[kCount];
    for (int p = 0; p < kCount; ++p) {
        nx[p] = planes_.n[0][p] = float(n[p].x);
        ny[p] = planes_.n[1][p] = float(n[p].y);
        nz[p] = planes_.n[2][p] = float(n[p].z);
        ofLight[p] = nx[p] * l.x + ny[p] * l.y + nz[p] * l.z;
        support[p] = ofLight[p];
    }
    // The light itself is in no segment; all that counts is where the ends are.
    support[15] = 1e300;
    if (lowest > 0)
        support[8] = 1e300;
    for (const glm::dvec3& c : base.corner)
        for (int p = 0; p < kCount; ++p) {
            const double s = nx[p] * c.x + ny[p] * c.y + nz[p] * c.z;
            support[p] = s < support[p] ? s : support[p];
        }
    support[8] += gain;
    support[15] = std::min(support[15], ofLight[15] + before);
    const double grow = scale * 3.337860107421875e-6 + excess; // 56 eps S
    for (int p = 0; p < kCount; ++p) {
        planes_.d[p] =
            float((std::fabs(nx[p]) + std::fabs(ny[p]) + std::fabs(nz[p])) * grow - support[p]);
        planes_.reach[p] = (planes_.n[0][p] > 0 ? planes_.n[0][p] : 0) +
                           (planes_.n[1][p] > 0 ? planes_.n[1][p] : 0) +
                           (planes_.n[2][p] > 0 ? planes_.n[2][p] : 0);
    }
    for (uint32_t i = 0; i < 64; ++i) {
        const float x = kPlaces.at[i][0], y = kPlaces.at[i][1], z = kPlaces.at[i][2];
        for (int p = 0; p < kCount; ++p)
            planes_.place[i][p] = planes_.n[0][p] * x + planes_.n[1][p] * y + planes_.n[2][p] * z;
    }
    above_ = base.above;
    return true;
}

uint64_t Shaft::cellsInside(const float corner[3], float side, uint64_t cells) const {
    uint64_t inside = 0;
#if defined(SDAG_RAY_SLABS_AVX2)
    const __m256 x = _mm256_set1_ps(corner[0]), y = _mm256_set1_ps(corner[1]),
                 z = _mm256_set1_ps(corner[2]), s = _mm256_set1_ps(side);
    const auto base = [&](int p) {
        __m256 b =
            _mm256_fmadd_ps(s, _mm256_load_ps(planes_.reach + p), _mm256_load_ps(planes_.d + p));
        b = _mm256_fmadd_ps(x, _mm256_load_ps(planes_.n[0] + p), b);
        b = _mm256_fmadd_ps(y, _mm256_load_ps(planes_.n[1] + p), b);
        return _mm256_fmadd_ps(z, _mm256_load_ps(planes_.n[2] + p), b);
    };
    const __m256 b0 = base(0), b1 = base(8);
    cells &= above_->cells(-_mm256_cvtss_f32(b1) / side);
    while (cells) {
        const uint32_t i = uint32_t(_tzcnt_u64(cells));
        cells &= cells - 1;
        const __m256 v0 = _mm256_fmadd_ps(s, _mm256_load_ps(planes_.place[i]), b0);
        const __m256 v1 = _mm256_fmadd_ps(s, _mm256_load_ps(planes_.place[i] + 8), b1);
        inside |= uint64_t(_mm256_movemask_ps(_mm256_or_ps(v0, v1)) == 0) << i;
    }
#else
    float b[ShaftPlanes::kCount];
    for (int p = 0; p < ShaftPlanes::kCount; ++p) {
        b[p] = fmaf(side, planes_.reach[p], planes_.d[p]);
        for (int a = 0; a < 3; ++a)
            b[p] = fmaf(corner[a], planes_.n[a][p], b[p]);
    }
    cells &= above_->cells(-b[8] / side);
    for (; cells; cells &= cells - 1) {
        const uint32_t i = uint32_t(std::countr_zero(cells));
        bool isOut = false;
        for (int p = 0; p < ShaftPlanes::kCount; ++p)
            isOut |= std::signbit(fmaf(side, planes_.place[i][p], b[p]));
        inside |= uint64_t(!isOut) << i;
    }
#endif
    return inside;
}

bool Shaft::isEmpty(const WideDagView& dag) {
    const uint32_t* words = dag.words.data;
    open_.assign(1, WideCell{dag.rootAddress, dag.rootLevel, {0, 0, 0}}); // a stack
    while (!open_.empty()) {
        const WideCell cell = open_.back();
        open_.pop_back();
        const uint64_t mask = maskAt(words, cell.address);
        if (cell.level <= kLeafLog2) {
            if (cellsInside(cell.corner, 1.0f, mask) != 0)
                return false;
            continue;
        }
        const float side = float(1u << (cell.level - 2));
        for (uint64_t in = cellsInside(cell.corner, side, mask); in; in &= in - 1) {
            const uint32_t i = uint32_t(std::countr_zero(in));
            const uint32_t rank = uint32_t(std::popcount(mask & ((uint64_t(1) << i) - 1)));
            const glm::uvec3 p = placeOf(i);
            open_.push_back(
                {words[cell.address + 2 + rank],
                 cell.level - 2,
                 {cell.corner[0] + side * float(p.x), cell.corner[1] + side * float(p.y),
                  cell.corner[2] + side * float(p.z)}});
        }
    }
    return true;
}

} // namespace shadowdag
