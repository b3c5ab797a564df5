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

/// Coordinates x | y << 1 | z << 2 of children, twice (dag.h), to x, y, z in 0..3.
inline glm::uvec3 placeOf(uint32_t cell) {
    return {(cell >> 3 & 1) * 2 + (cell & 1), (cell >> 4 & 1) * 2 + (cell >> 1 & 1),
            (cell >> 5 & 1) * 2 + (cell >> 2 & 1)};
}

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

bool Shaft::make(const ShadowStarts& starts, const ShaftBase& base, const glm::vec3& lightWorld) {
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

    // No end may be lifted: n_i . (light - start_i) >= n . (light - start_i) - spread * distance.
    double lowest = 1e300, least = 1e300, furthest = 0;
    for (const glm::dvec3& c : base.corner) {
        const glm::dvec3 way = l - c;
        const double height = glm::dot(base.normal, way);
        lowest = std::min(lowest, height);
        least = std::min(least, glm::dot(base.normal, c));
        furthest = std::max(furthest, glm::dot(way, way));
    }
    furthest = std::sqrt(furthest) + 2 * excess;
    lowest -= 2 * excess;
    if (!(lowest - base.normalSpread * furthest > 1e-3))
        return false;
    // Starts are drawn towards the light by at least so much, which lifts them so far.
    const double back = offset_ * 1.7320508075688772;
    const double drawn =
        std::max(std::min(offset_, 0.5 * (nearest_ - excess - back)), 0.0);
    const double gain = drawn * lowest / furthest;

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
    n[15] = -base.side[1];
    for (int p = 0; p < ShaftPlanes::kCount; ++p) {
        const glm::vec3 f(n[p]);
        const glm::dvec3 d(f);
        double support = p == 8 ? 1e300 : glm::dot(d, l);
        for (const glm::dvec3& c : base.corner)
            support = std::min(support, glm::dot(d, c));
        if (p == 8)
            support += gain;
        const double norm = std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z);
        for (int a = 0; a < 3; ++a)
            planes_.n[a][p] = f[a];
        planes_.d[p] = float(norm * (scale * 3.337860107421875e-6 + excess) - support);
        planes_.reach[p] = std::max(f.x, 0.0f) + std::max(f.y, 0.0f) + std::max(f.z, 0.0f);
    }
    for (uint32_t i = 0; i < 64; ++i) {
        const glm::vec3 at(placeOf(i));
        for (int p = 0; p < ShaftPlanes::kCount; ++p)
            planes_.place[i][p] =
                planes_.n[0][p] * at.x + planes_.n[1][p] * at.y + planes_.n[2][p] * at.z;
    }
    slack_ = scale * 4 * 5.9604644775390625e-8 + excess;
    return true;
}

uint64_t Shaft::cellsInside(const float corner[3], float side, uint64_t cells) const {
    uint64_t inside = 0;
#if defined(SDAG_RAY_SLABS_AVX2)
    const __m256 x = _mm256_set1_ps(corner[0]), y = _mm256_set1_ps(corner[1]),
                 z = _mm256_set1_ps(corner[2]), s = _mm256_set1_ps(side);
    const auto base = [&](int p) {
        __m256 b = _mm256_fmadd_ps(s, _mm256_load_ps(planes_.reach + p),
                                   _mm256_load_ps(planes_.d + p));
        b = _mm256_fmadd_ps(x, _mm256_load_ps(planes_.n[0] + p), b);
        b = _mm256_fmadd_ps(y, _mm256_load_ps(planes_.n[1] + p), b);
        return _mm256_fmadd_ps(z, _mm256_load_ps(planes_.n[2] + p), b);
    };
    const __m256 b0 = base(0), b1 = base(8);
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

bool Shaft::isInside(const WideCell& cell) const {
    return cellsInside(cell.corner, float(1u << cell.level), 1) != 0;
}

bool Shaft::refine(const WideDagView& dag, const std::vector<WideCell>& from, ShaftCells& to) {
    const uint32_t* words = dag.words.data;
    to.isExact = false;
    now_.clear();
    uint32_t level = 0;
    for (const WideCell& cell : from)
        if (isInside(cell)) {
            now_.push_back(cell);
            level = std::max(level, cell.level);
        }
    to.cells = now_;
    // All lists hold cells of one level, except that `from` may.
    while (level > kLeafLog2) {
        next_.clear();
        uint32_t below = kLeafLog2;
        for (const WideCell& cell : now_) {
            if (cell.level < level) {
                next_.push_back(cell);
                below = std::max(below, cell.level);
                continue;
            }
            const float side = float(1u << (level - 2));
            const uint64_t mask = maskAt(words, cell.address);
            below = std::max(below, level - 2);
            for (uint64_t in = cellsInside(cell.corner, side, mask); in; in &= in - 1) {
                const uint32_t i = uint32_t(std::countr_zero(in));
                const uint32_t rank = uint32_t(std::popcount(mask & ((uint64_t(1) << i) - 1)));
                const glm::uvec3 p = placeOf(i);
                next_.push_back({words[cell.address + 2 + rank],
                                 level - 2,
                                 {cell.corner[0] + side * float(p.x),
                                  cell.corner[1] + side * float(p.y),
                                  cell.corner[2] + side * float(p.z)}});
            }
            if (next_.size() > kMostCells)
                return true; // to.cells is the last short list
        }
        now_.swap(next_);
        level = below;
        if (now_.size() <= kCoarseCells)
            to.cells = now_;
    }
    next_.clear();
    for (const WideCell& cell : now_)
        if (cellsInside(cell.corner, 1.0f, maskAt(words, cell.address)) != 0)
            next_.push_back(cell);
    to.cells.swap(next_);
    to.isExact = true;
    return !to.cells.empty();
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
bool Shaft::isParted(const WideDagView& dag, const ShaftCells& exact) {
    if (!exact.isExact || exact.cells.empty())
        return false;
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
    order_.resize(exact.cells.size());
    for (uint32_t i = 0; i < order_.size(); ++i)
        order_[i] = i;
    std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
        const int slabA = slabOf(exact.cells[a]), slabB = slabOf(exact.cells[b]);
        return slabA != slabB ? slabA < slabB : a < b;
    });

    uint64_t occupied[4][kSide], reached[kSide], before[kSide];
    bool isReset = true; // everything is reached
    int slabBefore = 0, x0 = 0, y0 = 0, rowCount = 0;
    for (size_t begin = 0, end; begin < order_.size(); begin = end) {
        const int slab = slabOf(exact.cells[order_[begin]]);
        for (end = begin; end < order_.size() && slabOf(exact.cells[order_[end]]) == slab;)
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
            const WideCell& cell = exact.cells[order_[i]];
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
            for (int r = 0; r < rowCount; ++r) {
                const double dy0 = y0 + r - l[v], dy1 = dy0 + 1; // the row's reach, from the light
                free[r] = 0;
                if (dy1 < lowest(1, t0, t1) || dy0 > highest(1, t0, t1)) {
                    reached[r] = 0;
                    continue;
                }
                const double from =
                    std::max({lowest(0, t0, t1), lowest(2, t0, t1) - dy1, lowest(3, t0, t1) + dy0});
                const double to = std::min(
                    {highest(0, t0, t1), highest(2, t0, t1) - dy0, highest(3, t0, t1) + dy1});
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
