// SPDX-License-Identifier: Apache-2.0
// The voxels of a real scene compared with other programs: Crytek's Sponza at 1024^3, whose voxels
// and nodes were counted by public builders of SVDAGs on the same grid (a cube centred on the
// bounding box, as long as its longest side; a voxel counts when a triangle touches it).
#include "scenes/gltf.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace shadowdag {
namespace {

std::string sponzaPath() {
    const char* named = std::getenv("SDAG_SHARED_SCENES");
    const std::string folder = named ? named : std::string(SDAG_SOURCE_DIR) + "/../shared/scenes";
    const std::string path = folder + "/glb/crytek_sponza_half.glb";
    return std::filesystem::exists(path) ? path : "";
}

bool hasEqualCorners(const TriangleView& triangles, uint32_t t) {
    const glm::vec3 a = triangles.vertex(t, 0), b = triangles.vertex(t, 1),
                    c = triangles.vertex(t, 2);
    return a == b || b == c || c == a;
}

// The other programs were given the scene without its degenerate triangles. Ours voxelizes them as
// the segments and points that they are; here they lie in voxels that their neighbours touch.
TEST(Sponza, HasTheVoxelsAndNodesThatOtherProgramsCount) {
    const std::string path = sponzaPath();
    if (path.empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    const Scene scene = readGltf(path);
    const World world(scene, {});
    const TriangleView triangles = world.triangles();
    std::vector<uint32_t> whole;
    for (const uint32_t t : world.staticTriangles())
        if (!hasEqualCorners(triangles, t))
            whole.push_back(t);
    EXPECT_LT(whole.size(), world.staticTriangles().size());

    const VoxelGrid grid = gridAround(world.boundsWorld(), 10);
    const Dag dag = voxelize(triangles, viewOf(world.staticTriangles()), grid);
    const DagStats stats = computeDagStats(dag);
    EXPECT_EQ(stats.voxelCount, 9'786'828u);
    EXPECT_EQ(stats.nodeCounts,
              (std::vector<uint64_t>{1, 8, 30, 149, 608, 2003, 6092, 18503, 31220, 239}));
    EXPECT_EQ(voxelize(triangles, viewOf(whole), grid).words, dag.words);
}

} // namespace
} // namespace shadowdag
