// SPDX-License-Identifier: Apache-2.0
// OpenVDB's distances to the same triangles as a reference for our voxels. In a separate file
// because its headers take half a minute to compile.
#include "scenes/builtin.h"
#include "tests/voxel/soup.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>

namespace shadowdag {
namespace {

/// Holds the voxels of triangles against OpenVDB's distances from their centres: a voxel touched by
/// a triangle has its centre within half its diagonal of it, and a voxel whose centre is nearer
/// than half its side to the triangle contains a point of it.
/// @param surelyCount how many voxels at least must be nearer than that
void expectVoxelsNearTriangles(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid, size_t surelyCount) {
    const Dag dag = voxelize(triangles, which, grid);

    // The adapter wants points in index space, where OpenVDB's voxels have integer centres.
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    for (size_t i = 0; i < triangles.positions.count; ++i) {
        const glm::dvec3 q = grid.voxelFromWorld(glm::dvec3(triangles.positions[i])) - 0.5;
        points.emplace_back(float(q.x), float(q.y), float(q.z));
    }
    for (size_t i = 0; i < which.count; ++i) {
        const glm::uvec3& t = triangles.triangles[which[i]];
        faces.emplace_back(t.x, t.y, t.z);
    }
    openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points, faces);
    const auto distances = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        mesh, *openvdb::math::Transform::createLinearTransform(1.0), 2.0f, 2.0f,
        openvdb::tools::UNSIGNED_DISTANCE_FIELD);
    const auto accessor = distances->getConstAccessor();

    constexpr float kSlack = 1e-3f; // OpenVDB's distances are floats of coordinates up to 256
    size_t occupied = 0, surelyOccupied = 0;
    for (int z = 0; z < int(grid.resolution()); ++z)
        for (int y = 0; y < int(grid.resolution()); ++y)
            for (int x = 0; x < int(grid.resolution()); ++x) {
                const float distance = accessor.getValue(openvdb::Coord(x, y, z));
                const bool ours = isOccupied(dag.view(), uint32_t(x), uint32_t(y), uint32_t(z));
                occupied += ours;
                surelyOccupied += distance < 0.5f - kSlack;
                if (ours) {
                    ASSERT_LT(distance, std::sqrt(0.75f) + kSlack) << x << " " << y << " " << z;
                }
                if (distance < 0.5f - kSlack) {
                    ASSERT_TRUE(ours) << x << " " << y << " " << z << " at " << distance;
                }
            }
    EXPECT_GT(surelyOccupied, surelyCount);
    EXPECT_GT(occupied, surelyOccupied);
    EXPECT_EQ(occupied, computeDagStats(dag).voxelCount);
}

TEST(OpenVdbOracle, VoxelsOfASoupAreThoseNearIt) {
    std::mt19937 random(4713);
    const Soup soup = randomSoup(60, 1.0f, random);
    expectVoxelsNearTriangles(soup.view(), soup.all(), gridAround(soup.bounds(), 8), 10000);
}

TEST(OpenVdbOracle, VoxelsOfBuiltInScenesAreThoseNearTheirTriangles) {
    for (const char* name : {"atrium", "fail-wires"}) {
        SCOPED_TRACE(name);
        const Scene scene = makeBuiltin(name);
        const World world(scene, {});
        expectVoxelsNearTriangles(world.triangles(), viewOf(world.staticTriangles()),
                                  gridAround(world.staticBoundsWorld(), 8), 100);
    }
}

} // namespace
} // namespace shadowdag
