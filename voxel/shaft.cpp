// SPDX-License-Identifier: Apache-2.0
// Why it is conservative. With eps = 2^-24 and S no less than the resolution and every coordinate,
// ends included:
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

/// Returns the seeds and all that is joined to them within a row of free cells.
inline uint64_t spreadInRow(uint64_t seeds, uint64_t free) {
    uint64_t up = seeds, down = seeds, upFree = free, downFree = free;
    for (int step = 1; step < 64; step *= 2) {
        up |= upFree & up << step;
        down |= downFree & down >> step;
        upFree &= upFree << step;
        downFree &= downFree >> step;
    }
    return up | down;
}

/// Adds to what is reached all free cells that are joined to it, side by side.
void spread(uint64_t* reached, const uint64_t* free, int rowCount) {
    for (bool isChanged = true; isChanged;) {
        isChanged = false;
        for (int pass = 0; pass < 2; ++pass)
            for (int i = 0; i < rowCount; ++i) {
                const int r = pass == 0 ? i : rowCount - 1 - i;
                const int neighbour = pass == 0 ? r - 1 : r + 1;
                uint64_t seeds = reached[r];
                if (neighbour >= 0 && neighbour < rowCount)
                    seeds |= reached[neighbour] & free[r];
                if (seeds == 0)
                    continue;
                const uint64_t all = spreadInRow(seeds, free[r]);
                isChanged |= all != reached[r];
                reached[r] = all;
            }
    }
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
    light_ = grid.voxelFromWorld(glm::dvec3(lightWorld));
    offset_ = double(starts.offset());
    const glm::dvec3& l = light_;
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
    nearest_ = 0;
    for (int a = 0; a < 3; ++a) {
        const double away = std::max(separation[a][0], -separation[a][1]);
        if (away > nearest_) {
            nearest_ = away;
            axis_ = a;
            sign_ = separation[a][0] > 0 ? 1.0 : -1.0;
        }
    }
    if (!(nearest_ > 1.0 + excess))
        return false;

    // Starts are drawn towards the light by at least so much, which lifts them so far.
    const double back = offset_ * 1.7320508075688772;
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
    const double drawn = std::max(std::min(offset_, 0.5 * (nearest_ - excess - back)), 0.0);
    const double gain = drawn * std::max(lowest, 0.0) / furthest;
    // Ends stay `back` short of the light: so far before a plane across the shaft. No direction's
    // cosine is less than the least height over the greatest length.
    middle = middle / glm::length(middle);
    double height = 1e300;
    for (const glm::dvec3& c : base.corner)
        height = std::min(height, glm::dot(middle, c - l));
    const double before =
        std::max(height, 0.0) / furthest * std::min(back, std::max(nearest_ - excess, 0.0));

    const int w = axis_, u = (w + 1) % 3, v = (w + 2) % 3;
    for (int k = 0; k < 4; ++k) {
        low_[k] = 1e300;
        high_[k] = -1e300;
    }
    for (const glm::dvec3& c : base.corner) {
        const double inverse = 1.0 / std::fabs(c[w] - l[w]);
        const double x = (c[u] - l[u]) * inverse, y = (c[v] - l[v]) * inverse;
        const double of[4] = {x, y, x + y, x - y};
        for (int k = 0; k < 4; ++k) {
            low_[k] = std::min(low_[k], of[k]);
            high_[k] = std::max(high_[k], of[k]);
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
        n[2 * k][w] = -low_[k] * sign_;
        n[2 * k + 1] = -along;
        n[2 * k + 1][w] = high_[k] * sign_;
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
    slack_ = scale * 4 * 5.9604644775390625e-8 + excess;
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

void Shaft::expand(const WideDagView& dag, const WideCell& cell, uint64_t cells,
                   std::vector<WideCell>& to) const {
    const uint32_t* words = dag.words.data;
    const float side = float(1u << (cell.level - 2));
    const uint64_t mask = maskAt(words, cell.address);
    for (uint64_t in = cellsInside(cell.corner, side, mask & cells); in; in &= in - 1) {
        const uint32_t i = uint32_t(std::countr_zero(in));
        const uint32_t rank = uint32_t(std::popcount(mask & ((uint64_t(1) << i) - 1)));
        const glm::uvec3 p = placeOf(i);
        to.push_back({words[cell.address + 2 + rank],
                      cell.level - 2,
                      {cell.corner[0] + side * float(p.x), cell.corner[1] + side * float(p.y),
                       cell.corner[2] + side * float(p.z)}});
    }
}

bool Shaft::isEmpty(const WideDagView& dag, const std::vector<WideCell>& from,
                    std::vector<WideCell>& cut) {
    cut.clear();
    now_ = from; // a stack
    while (!now_.empty()) {
        const WideCell cell = now_.back();
        now_.pop_back();
        if (cell.level > kLeafLog2) {
            expand(dag, cell, ~uint64_t(0), now_);
        } else if (cellsInside(cell.corner, 1.0f, maskAt(dag.words.data, cell.address)) != 0) {
            if (cut.size() == kCutLeaves) {
                cut.clear();
                return false;
            }
            cut.push_back(cell);
        }
    }
    return cut.empty();
}

uint64_t Shaft::cellsInSlab(const WideCell& cell, int low, int high) const {
    const int side = 1 << (cell.level - 2), corner = int(cell.corner[axis_]);
    uint64_t cells = 0;
    for (int i = 0; i < 4; ++i)
        if (corner + i * side <= high && corner + (i + 1) * side > low) {
            // Bits of cells with coordinate i along the axis.
            const uint64_t low1[3] = {0x5555555555555555u, 0x3333333333333333u,
                                      0x0f0f0f0f0f0f0f0fu};
            const uint64_t high1[3] = {0x00ff00ff00ff00ffu, 0x0000ffff0000ffffu,
                                       0x00000000ffffffffu};
            cells |=
                ((i & 1) ? ~low1[axis_] : low1[axis_]) & ((i & 2) ? ~high1[axis_] : high1[axis_]);
        }
    return cells;
}

bool Shaft::isParted(const WideDagView& dag, const std::vector<WideCell>& from,
                     const glm::uvec3& voxel) {
    // One slice to either side of the voxel, and what else its leaves hold: a wall across the shaft
    // fills so few. Walls that slant need more slices (24 to either side: twice as many shafts
    // found, at four times the cost of this, more than their rays').
    constexpr int kReach = 1;
    constexpr size_t kMostLeaves = 100;
    const int low = int(voxel[axis_]) - kReach, high = int(voxel[axis_]) + kReach;
    leaves_.clear();
    now_ = from;
    while (!now_.empty()) {
        const WideCell cell = now_.back();
        now_.pop_back();
        if (cell.level > kLeafLog2) {
            expand(dag, cell, cellsInSlab(cell, low, high), now_);
        } else {
            if (leaves_.size() == kMostLeaves)
                return false;
            leaves_.push_back(cell);
        }
    }
    return parts(dag, leaves_);
}

// Why a parted shaft is dark. A segment that meets no occupied voxel by the predicate touches none
// exactly (the predicate takes all that it touches). At any point it then lies in closed voxels all
// of which are free; so it goes from one voxel to the next through a face, or through an edge or a
// corner whose voxels around are all free, which is a way through faces as well. All these voxels
// meet the shaft, and where the slices lie between all ends and all starts the segment crosses each
// of them from the light's side to the other. So if no chain of free voxels of the shaft, face to
// face, crosses a run of slices, there is no such segment. Chains are held slice by slice: what is
// reached from the light's side, spread within the slice. A chain that goes back to an earlier
// slice need not be followed: segments are monotone along the axis.
bool Shaft::parts(const WideDagView& dag, const std::vector<WideCell>& leaves) {
    constexpr int kSide = 64; // of a slice at most
    const int w = axis_, u = (w + 1) % 3, v = (w + 2) % 3;
    const glm::dvec3& l = light_;
    const double first = offset_ * 1.7320508075688772 + slack_; // between ends and starts
    const double last = nearest_ - offset_ - slack_;
    const auto slabOf = [&](const WideCell& cell) {
        const int slab = int(cell.corner[w]) >> kLeafLog2;
        return sign_ > 0 ? slab : -slab;
    };
    // Bits of a leaf's mask along one axis.
    const auto bitsAt = [](int axis, uint32_t i) {
        return (i & 1) << axis | (i >> 1) << (3 + axis);
    };
    const uint64_t rowBits = uint64_t(1) | uint64_t(1) << (1u << u) | uint64_t(1) << (8u << u) |
                             uint64_t(1) << (9u << u);
    order_.resize(leaves.size());
    for (uint32_t i = 0; i < order_.size(); ++i)
        order_[i] = i;
    std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
        const int slabA = slabOf(leaves[a]), slabB = slabOf(leaves[b]);
        return slabA != slabB ? slabA < slabB : a < b;
    });

    uint64_t occupied[4][kSide], reached[kSide], before[kSide];
    bool isReset = true; // everything is reached
    int slabBefore = 0, x0 = 0, y0 = 0, rowCount = 0;
    for (size_t begin = 0, end; begin < order_.size(); begin = end) {
        const int slab = slabOf(leaves[order_[begin]]);
        for (end = begin; end < order_.size() && slabOf(leaves[order_[end]]) == slab;)
            ++end;
        if (begin > 0 && slab != slabBefore + 1)
            isReset = true;
        slabBefore = slab;
        // Distances of the leaves' four slices from the light, and the section's bounds in them.
        const double corner = double(sign_ > 0 ? slab : -slab) * 4;
        const double near = sign_ > 0 ? corner - l[w] : l[w] - corner - 4;
        const double tLow = std::max(near, first), tHigh = std::min(near + 4, last);
        if (tHigh - tLow < 1) {
            isReset = true;
            continue;
        }
        const auto lowest = [&](int k, double t0, double t1) {
            return std::min(low_[k] * t0, low_[k] * t1) - slack_;
        };
        const auto highest = [&](int k, double t0, double t1) {
            return std::max(high_[k] * t0, high_[k] * t1) + slack_;
        };
        const int xLow = int(std::floor(l[u] + lowest(0, tLow, tHigh))) & ~3;
        const int yLow = int(std::floor(l[v] + lowest(1, tLow, tHigh))) & ~3;
        const int xCount = int(std::floor(l[u] + highest(0, tLow, tHigh))) - xLow + 1;
        const int yCount = int(std::floor(l[v] + highest(1, tLow, tHigh))) - yLow + 1;
        if (xCount > kSide || yCount > kSide) {
            isReset = true;
            continue;
        }
        if (!isReset) { // bring what was reached to the new origin
            const int dx = xLow - x0, dy = yLow - y0;
            for (int r = 0; r < yCount; ++r) {
                const int old = r + dy;
                const uint64_t bits = old >= 0 && old < rowCount ? reached[old] : 0;
                before[r] = dx >= 64 || dx <= -64 ? 0 : dx >= 0 ? bits >> dx : bits << -dx;
            }
            std::copy(before, before + yCount, reached);
        }
        x0 = xLow;
        y0 = yLow;
        rowCount = yCount;
        for (auto& slice : occupied)
            std::fill(slice, slice + rowCount, 0);
        for (size_t i = begin; i < end; ++i) {
            const WideCell& cell = leaves[order_[i]];
            const int x = int(cell.corner[u]) - x0, y = int(cell.corner[v]) - y0;
            if (x < 0 || x >= kSide || y < 0 || y >= rowCount)
                continue;
            const uint64_t mask = maskAt(dag.words.data, cell.address);
            for (uint32_t j = 0; j < 4; ++j)
                for (uint32_t r = 0; r < 4 && y + int(r) < rowCount; ++r) {
                    const uint64_t row = mask >> (bitsAt(w, j) + bitsAt(v, r)) & rowBits;
                    const uint64_t nibble = (row & 1) | (row >> (1u << u) & 1) << 1 |
                                            (row >> (8u << u) & 1) << 2 |
                                            (row >> (9u << u) & 1) << 3;
                    occupied[j][y + r] |= nibble << x;
                }
        }
        for (uint32_t i = 0; i < 4; ++i) {
            const uint32_t j = sign_ > 0 ? i : 3 - i;
            const double t0 = near + double(i), t1 = t0 + 1;
            if (t0 < first || t1 > last) {
                isReset = true;
                continue;
            }
            uint64_t free[kSide], any = 0;
            double least[4], most[4];
            for (int k = 0; k < 4; ++k) {
                least[k] = lowest(k, t0, t1);
                most[k] = highest(k, t0, t1);
            }
            for (int r = 0; r < rowCount; ++r) {
                const double dy0 = y0 + r - l[v], dy1 = dy0 + 1; // the row's reach, from the light
                free[r] = 0;
                if (dy1 < least[1] || dy0 > most[1]) {
                    reached[r] = 0;
                    continue;
                }
                const double from = std::max(std::max(least[0], least[2] - dy1), least[3] + dy0);
                const double to = std::min(std::min(most[0], most[2] - dy0), most[3] + dy1);
                const int b0 = std::max(int(std::floor(l[u] + from)) - x0, 0);
                const int b1 = std::min(int(std::floor(l[u] + to)) - x0, kSide - 1);
                if (b0 <= b1)
                    free[r] = (~uint64_t(0) >> (63 - b1) & ~uint64_t(0) << b0) & ~occupied[j][r];
                reached[r] = isReset ? free[r] : reached[r] & free[r];
                any |= reached[r];
            }
            if (any == 0)
                return true;
            if (!isReset)
                spread(reached, free, rowCount);
            isReset = false;
        }
    }
    return false;
}

} // namespace shadowdag
