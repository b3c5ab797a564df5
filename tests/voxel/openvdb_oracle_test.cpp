// SPDX-License-Identifier: Apache-2.0
// OpenVDB's distances to the same triangles as the oracle of our voxels. In a file of its own: its
// headers take half a minute to compile.
#include "tests/voxel/soup.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>

namespace shadowdag {
namespace {

// A voxel touched by a triangle has its centre within half its diagonal of it, and a voxel whose
// centre is nearer than half its side to the triangle contains a point of it.
TEST(OpenVdbOracle, VoxelsAreThoseNearTheTriangles) {
    std::mt19937 random(4713);
    const Soup soup = randomSoup(60, 1.0f, random);
    const VoxelGrid grid = gridAround(soup.bounds(), 8);
    const Dag dag = voxelize(soup.view(), soup.all(), grid);

    // The adapter wants points in index space, where OpenVDB's voxels have integer centres.
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    for (const glm::vec3& p : soup.positions) {
        const glm::dvec3 q = grid.voxelFromWorld(glm::dvec3(p)) - 0.5;
        points.emplace_back(float(q.x), float(q.y), float(q.z));
    }
    for (const glm::uvec3& t : soup.triangles)
        faces.emplace_back(t.x, t.y, t.z);
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
    EXPECT_GT(surelyOccupied, 10000u);
    EXPECT_GT(occupied, surelyOccupied);
}

} // namespace
} // namespace shadowdag
