// SPDX-License-Identifier: Apache-2.0
// Which voxels a triangle touches: the exact closed triangle/box overlap, evaluated column by
// column in double, with every rounding error on the conservative side.
//
// The separating axes of triangle and box (Akenine-Moeller, Fast 3D Triangle-Box Overlap Testing,
// 2001) are the box axes, the triangle's normal, and the nine edge x axis products. The nine are
// the overlap of the two projections on each coordinate plane, and in a plane the overlap of a
// triangle with the cell of slabs a and b is: the part of the triangle inside slab a reaches slab b
// (both convex). So per slab an interval replaces half-planes; nothing has a winding, and segments
// and points need no case of their own.
#pragma once

#include "scenes/world.h"
#include "voxel/voxel_grid.h"

#include <cmath>

namespace shadowdag {

/// The smaller and the larger of two numbers, as one instruction each (fmin and fmax are calls).
SDAG_HD inline double lesser(double a, double b) {
    return a < b ? a : b;
}
SDAG_HD inline double greater(double a, double b) {
    return a > b ? a : b;
}

/// A triangle prepared for overlap tests. Voxel space; axes are renamed so that d is the axis of
/// the largest normal component.
///
/// Error bound, with eps = 2^-53, M = max(|vertex|, resolution), E = the largest edge component:
///  vertices     (w - o) / s has two roundings                              2 eps M
///  slab ends    fl(cell - slack)                                           1 eps M
///  interval     b0 + ((end - a0) * inv) * db: six roundings, |db| <= 2M    13 eps M
///  plane        N = 8 eps E^2 bounds the error of a normal's component; with |nd| > 4 N a slope is
///  off by
///               3.6 N / |nd| + 2 eps at most, over a lever of E + 3; evaluating costs 30 eps M,
///               moved vertices 6 eps M.
/// So a box grown by slack = 32 eps M, and a plane grown by 8 N (E + 3) / |nd| + 64 eps M, miss
/// nothing that the exact triangle touches. With |nd| <= 4 N (a sliver: thinner than the plane is
/// known) the plane test is dropped; the three projections remain and are exact for the segment
/// that the sliver then is. What is accepted besides lies within the smaller of the plane's growth
/// and the sliver's thickness, hence within 2^-23 E.
struct TriangleSetup {
    double p[3][3];           ///< [axis u, v, d][corner]
    double inv[3][3];         ///< [axis][edge i to i + 1]: 1 / (p[i + 1] - p[i]), 0 where that is 0
    double least[3], most[3]; ///< bounds grown by slack
    double slack;
    double slopeU, slopeV; ///< d(u, v) = p[2][0] + slopeU (u - p[0][0]) + slopeV (v - p[1][0])
    double slackPlane;     ///< infinite without a plane
    int axis[3];           ///< which of x, y, z are u, v, d
};

/// Returns the setup of a triangle given by its corners in world space.
SDAG_HD inline TriangleSetup setupTriangle(const VoxelGrid& grid, const glm::vec3 world[3]) {
    constexpr double kEps = 1.1102230246251565e-16; // 2^-53
    TriangleSetup s;
    glm::dvec3 q[3];
    double largest = double(grid.resolution());
    for (int i = 0; i < 3; ++i) {
        q[i] = grid.voxelFromWorld(glm::dvec3(world[i]));
        for (int a = 0; a < 3; ++a)
            largest = greater(largest, fabs(q[i][a]));
    }
    const glm::dvec3 e1 = q[1] - q[0], e2 = q[2] - q[0];
    double edge = 0;
    for (int a = 0; a < 3; ++a)
        edge = greater(edge, greater(fabs(e1[a]), fabs(e2[a])));
    const double n[3] = {e1.y * e2.z - e1.z * e2.y, e1.z * e2.x - e1.x * e2.z,
                         e1.x * e2.y - e1.y * e2.x};
    int d = fabs(n[0]) > fabs(n[1]) ? 0 : 1;
    d = fabs(n[2]) > fabs(n[d]) ? 2 : d;
    s.axis[0] = d == 0 ? 1 : 0;
    s.axis[1] = d == 2 ? 1 : 2;
    s.axis[2] = d;
    s.slack = 32 * kEps * largest;
    for (int a = 0; a < 3; ++a) {
        for (int i = 0; i < 3; ++i)
            s.p[a][i] = q[i][s.axis[a]];
        for (int i = 0; i < 3; ++i) {
            // Under 1e-290 both ends share a slab (slack is larger), and each edge's start is
            // counted: 0 will do.
            const double delta = s.p[a][(i + 1) % 3] - s.p[a][i];
            s.inv[a][i] = fabs(delta) > 1e-290 ? 1.0 / delta : 0.0;
        }
        s.least[a] = lesser(s.p[a][0], lesser(s.p[a][1], s.p[a][2])) - s.slack;
        s.most[a] = greater(s.p[a][0], greater(s.p[a][1], s.p[a][2])) + s.slack;
    }
    const double normalError = 8 * kEps * edge * edge;
    const double nd = n[d];
    if (fabs(nd) > 4 * normalError) {
        s.slopeU = -n[s.axis[0]] / nd;
        s.slopeV = -n[s.axis[1]] / nd;
        s.slackPlane = 8 * normalError * (edge + 3) / fabs(nd) + 64 * kEps * largest;
    } else {
        s.slopeU = s.slopeV = 0;
        s.slackPlane = INFINITY;
    }
    return s;
}

/// Returns in [bMin, bMax] what the part of the triangle with lo <= a <= hi covers on axis b, grown
/// by slack; bMin > bMax when no part is there. `a` and `b` are 0..2 for u, v, d.
SDAG_HD inline void slabInterval(const TriangleSetup& s, int a, int b, double lo, double hi,
                                 double& bMin, double& bMax) {
    lo -= s.slack;
    hi += s.slack;
    bMin = INFINITY;
    bMax = -INFINITY;
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        const double a0 = s.p[a][i], a1 = s.p[a][j];
        const double b0 = s.p[b][i], db = s.p[b][j] - b0;
        const double t0 = lesser(greater((lo - a0) * s.inv[a][i], 0.0), 1.0);
        const double t1 = lesser(greater((hi - a0) * s.inv[a][i], 0.0), 1.0);
        const double c0 = b0 + t0 * db, c1 = b0 + t1 * db;
        const bool meets = lesser(a0, a1) <= hi && greater(a0, a1) >= lo;
        bMin = meets ? lesser(bMin, lesser(c0, c1)) : bMin;
        bMax = meets ? greater(bMax, greater(c0, c1)) : bMax;
    }
    bMin -= s.slack;
    bMax += s.slack;
}

/// Returns whether the triangle touches the closed cube of side `size` whose least corner is
/// `corner` (voxel space, x y z). Never false for a touching pair.
SDAG_HD inline bool touchesCube(const TriangleSetup& s, const glm::ivec3& corner, int size) {
    double lo[3], hi[3];
    for (int a = 0; a < 3; ++a) {
        lo[a] = corner[s.axis[a]];
        hi[a] = lo[a] + size;
        if (s.least[a] > hi[a] || s.most[a] < lo[a])
            return false;
    }
    double least, most;
    slabInterval(s, 0, 1, lo[0], hi[0], least, most);
    if (least > hi[1] || most < lo[1])
        return false;
    slabInterval(s, 0, 2, lo[0], hi[0], least, most);
    if (least > hi[2] || most < lo[2])
        return false;
    slabInterval(s, 1, 2, lo[1], hi[1], least, most);
    if (least > hi[2] || most < lo[2])
        return false;
    const double half = 0.5 * size;
    const double middle =
        s.p[2][0] + s.slopeU * (lo[0] + half - s.p[0][0]) + s.slopeV * (lo[1] + half - s.p[1][0]);
    const double reach = half * (fabs(s.slopeU) + fabs(s.slopeV)) + s.slackPlane;
    return !(middle - reach > hi[2] || middle + reach < lo[2]);
}

constexpr int kBrickLog2 = 6;
constexpr int kBrickSize = 1 << kBrickLog2;

/// The voxels of a cube to test: first to last along the setup's axes u, v, d, relative to its
/// corner.
struct ColumnWindow {
    int first[3], last[3];
};

/// Calls emit(u, v, first, last) for every column of the cube of side `size` <= kBrickSize at
/// `corner` in which the triangle touches voxels of the window. Numbers are relative to the corner,
/// along the setup's axes u, v, d; exactly voxels first..last of the column are touched. A window
/// omits voxels and changes none: the windows of a cube together give the same voxels as the cube.
/// @param window within the cube, at most kMostV voxels along v
template <int kMostV, class Emit>
SDAG_HD inline void forEachColumnIn(const TriangleSetup& s, const glm::ivec3& corner, int size,
                                    const ColumnWindow& window, const Emit& emit) {
    int first[3], last[3];
    double base[3];
    for (int a = 0; a < 3; ++a) {
        base[a] = corner[s.axis[a]];
        if (s.least[a] > base[a] + size || s.most[a] < base[a])
            return;
        first[a] = int(greater(floor(s.least[a]) - base[a], double(window.first[a])));
        last[a] = int(lesser(floor(s.most[a]) - base[a], double(window.last[a])));
        if (first[a] > last[a])
            return;
    }
    // Intervals are kept as whole voxel numbers relative to the corner, clamped to the window.
    const double dFirst = first[2], dLast = last[2];
    double vLo[kMostV], vHi[kMostV];
    for (int v = first[1]; v <= last[1]; ++v) {
        double least, most;
        slabInterval(s, 1, 2, base[1] + v, base[1] + v + 1, least, most);
        vLo[v - first[1]] = greater(floor(least) - base[2], dFirst);
        vHi[v - first[1]] = lesser(floor(most) - base[2], dLast);
    }
    const double reach = 0.5 * (fabs(s.slopeU) + fabs(s.slopeV)) + s.slackPlane;
    for (int u = first[0]; u <= last[0]; ++u) {
        double least, most;
        slabInterval(s, 0, 2, base[0] + u, base[0] + u + 1, least, most);
        const double uLo = greater(floor(least) - base[2], dFirst);
        const double uHi = lesser(floor(most) - base[2], dLast);
        slabInterval(s, 0, 1, base[0] + u, base[0] + u + 1, least, most);
        const double vLeast = greater(floor(least) - base[1], double(first[1]));
        const double vMost = lesser(floor(most) - base[1], double(last[1]));
        if (!(uLo <= uHi && vLeast <= vMost))
            continue;
        const int vFirst = int(vLeast), vLast = int(vMost);
        const double row = s.p[2][0] + s.slopeU * (base[0] + u + 0.5 - s.p[0][0]) +
                           s.slopeV * (base[1] + 0.5 - s.p[1][0]);
        int lo[kMostV], hi[kMostV];
        for (int v = vFirst; v <= vLast; ++v) {
            const double middle = row + s.slopeV * v;
            const int i = v - first[1];
            const double from = greater(greater(floor(middle - reach) - base[2], uLo), vLo[i]);
            const double to = lesser(lesser(floor(middle + reach) - base[2], uHi), vHi[i]);
            lo[i] =
                int(lesser(from, double(kBrickSize))); // any distance outside gives the same result
            hi[i] = int(greater(to, -1.0));
        }
        for (int v = vFirst; v <= vLast; ++v)
            if (lo[v - first[1]] <= hi[v - first[1]])
                emit(u, v, lo[v - first[1]], hi[v - first[1]]);
    }
}

/// The same for the whole cube.
template <class Emit>
SDAG_HD inline void forEachColumn(const TriangleSetup& s, const glm::ivec3& corner, int size,
                                  const Emit& emit) {
    const int last = size - 1;
    forEachColumnIn<kBrickSize>(s, corner, size, {{0, 0, 0}, {last, last, last}}, emit);
}

} // namespace shadowdag
