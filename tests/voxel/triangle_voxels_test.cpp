// SPDX-License-Identifier: Apache-2.0
#include "voxel/triangle_voxels.h"

#include "tests/voxel/exact_geometry.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace shadowdag {
namespace {

VoxelGrid unitGrid(uint32_t log2) {
    VoxelGrid grid;
    grid.resolutionLog2 = log2;
    return grid;
}

using Cell = std::array<int, 3>;

/// The voxels of the cube at `corner` that the voxelizer's column walk emits.
std::set<Cell> columnsOf(const TriangleSetup& s, const glm::ivec3& corner, int size) {
    std::set<Cell> cells;
    forEachColumn(s, corner, size, [&](int u, int v, int first, int last) {
        EXPECT_TRUE(0 <= u && u < size && 0 <= v && v < size && 0 <= first && first <= last &&
                    last < size);
        for (int d = first; d <= last; ++d) {
            Cell cell;
            cell[s.axis[0]] = corner[s.axis[0]] + u;
            cell[s.axis[1]] = corner[s.axis[1]] + v;
            cell[s.axis[2]] = corner[s.axis[2]] + d;
            EXPECT_TRUE(cells.insert(cell).second) << "emitted twice";
        }
    });
    return cells;
}

/// Holds columns and cubes of one triangle against integers: every touched voxel is there, and none
/// that does not touch when grown by `grow` voxels. `shift`: coordinates are multiples of 2^-shift.
void expectOverlap(const VoxelGrid& grid, const glm::vec3 t[3], int shift, double grow) {
    const TriangleSetup s = setupTriangle(grid, t);
    const int n = int(grid.resolution());
    std::vector<exact::Point> hull;
    for (int i = 0; i < 3; ++i)
        hull.push_back(exact::point(t[i], shift));
    const auto touches = [&](const Cell& c, int size, double g) {
        exact::Point lo, hi;
        for (int a = 0; a < 3; ++a) {
            lo[a] = exact::scaled(c[a] - g, shift);
            hi[a] = exact::scaled(c[a] + size + g, shift);
        }
        return exact::hullTouchesBox(hull, lo, hi);
    };
    const std::set<Cell> cells = columnsOf(s, glm::ivec3(0), n);
    for (int size = 1; size <= n; size *= 2)
        for (int z = 0; z < n; z += size)
            for (int y = 0; y < n; y += size)
                for (int x = 0; x < n; x += size) {
                    const Cell c{x, y, z};
                    const bool computed = touchesCube(s, glm::ivec3(x, y, z), size);
                    const bool inColumns = size > 1 ? computed : cells.count(c) != 0;
                    if (touches(c, size, 0)) {
                        ASSERT_TRUE(computed) << "cube missed";
                        ASSERT_TRUE(inColumns) << "voxel missed";
                    } else if ((computed || inColumns) && !touches(c, size, grow)) {
                        FAIL() << (computed ? "cube " : "column voxel ") << x << " " << y << " "
                               << z << " size " << size << " does not touch";
                    }
                }
}

TEST(TriangleVoxels, EqualsTheExactOverlapOnLatticeTriangles) {
    std::mt19937 random(21);
    for (int i = 0; i < 400; ++i) {
        // Integers and halves: faces in voxel faces, edges through voxel corners, points, segments.
        const int shift = i % 2;
        glm::vec3 t[3];
        for (glm::vec3& p : t)
            for (int a = 0; a < 3; ++a)
                p[a] = float(int(random() % 25) - 8) / float(1 << shift);
        if (i % 5 == 1)
            t[1] = t[0];
        if (i % 25 == 1)
            t[2] = t[0];
        if (i % 5 == 2)
            t[2] = t[0] + (t[1] - t[0]) * 2.0f;
        if (i % 5 == 3)
            t[0][i % 3] = t[1][i % 3] = t[2][i % 3];
        SCOPED_TRACE(testing::Message() << "seed 21 triangle " << i);
        expectOverlap(unitGrid(3), t, shift, 0);
        if (HasFatalFailure())
            return;
    }
}

TEST(TriangleVoxels, MissesNothingAndGrowsByLessThanAMillionthOnFineTriangles) {
    std::mt19937 random(22);
    for (int i = 0; i < 200; ++i) {
        glm::vec3 t[3];
        const float spread = std::ldexp(1.0f, int(random() % 7) - 2);
        const glm::vec3 centre(random() % 9, random() % 9, random() % 9);
        for (glm::vec3& p : t)
            for (int a = 0; a < 3; ++a)
                p[a] = centre[a] +
                       std::round(std::ldexp(spread * (float(random() % 20001) / 10000 - 1), 12)) /
                           4096;
        if (i % 4 == 1) // a sliver
            t[2] = t[0] + (t[1] - t[0]) * 0.5f + glm::vec3(0, std::ldexp(1.0f, -12), 0);
        SCOPED_TRACE(testing::Message() << "seed 22 triangle " << i);
        expectOverlap(unitGrid(3), t, 40, std::ldexp(1.0, -20));
        if (HasFatalFailure())
            return;
    }
}

// Slivers whose normal drowns in rounding, tiny triangles, and triangles far larger than the grid.
TEST(TriangleVoxels, MissesNothingOfSliversSpecksAndGiants) {
    std::mt19937 random(23);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (int i = 0; i < 300; ++i) {
        glm::vec3 t[3];
        const float size = i % 3 == 0 ? 1e-6f : i % 3 == 1 ? 6.0f : 1e7f;
        const glm::vec3 centre =
            glm::vec3(4) + 4.0f * glm::vec3(unit(random), unit(random), unit(random));
        const glm::vec3 along(unit(random), unit(random), unit(random)),
            across(unit(random), unit(random), unit(random));
        for (glm::vec3& p : t)
            p = centre +
                size * (unit(random) * along + (i % 2 ? 1e-7f : 1.0f) * unit(random) * across);
        SCOPED_TRACE(testing::Message() << "seed 23 triangle " << i);
        // What triangle_voxels.h states: a sliver of extent E may be grown by 2^-23.5 E.
        const bool isGiant = i % 3 == 2;
        expectOverlap(unitGrid(3), t, 149, !isGiant ? 1e-5 : i % 2 ? 3.0 : 1e-3);
        if (HasFatalFailure())
            return;
    }
}

// The same voxels whether a cube is walked at once or in parts, wherever it lies and with the
// transform not trivial.
TEST(TriangleVoxels, PartsOfACubeGiveTheVoxelsOfTheWhole) {
    std::mt19937 random(24);
    std::uniform_real_distribution<float> unit(-1, 1);
    VoxelGrid grid;
    grid.resolutionLog2 = 12;
    grid.voxelSizeWorld = 0.00737;
    grid.originWorld = glm::dvec3(-13.1, 2.7, 100.3);
    for (int i = 0; i < 100; ++i) {
        glm::vec3 t[3];
        const glm::ivec3 corner(glm::ivec3(random() % 64, random() % 64, random() % 64) * 64);
        for (glm::vec3& p : t)
            p = glm::vec3(
                grid.worldFromVoxel(glm::dvec3(corner) + 32.0 +
                                    50.0 * glm::dvec3(unit(random), unit(random), unit(random))));
        const TriangleSetup s = setupTriangle(grid, t);
        std::set<Cell> parts;
        for (int c = 0; c < 8; ++c) {
            const glm::ivec3 part = corner + glm::ivec3(c & 1, c >> 1 & 1, c >> 2) * 32;
            const std::set<Cell> cells = columnsOf(s, part, 32);
            EXPECT_TRUE(touchesCube(s, part, 32) || cells.empty());
            parts.insert(cells.begin(), cells.end());
        }
        EXPECT_EQ(columnsOf(s, corner, 64), parts);
    }
}

} // namespace
} // namespace shadowdag
