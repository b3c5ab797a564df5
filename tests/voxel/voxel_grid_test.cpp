// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxel_grid.h"

#include "cuda/error.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(VoxelGrid, CubeOfTheLongestExtentIsCentredOnTheBounds) {
    Box box;
    box.add(glm::vec3(-1, 2, 3));
    box.add(glm::vec3(7, 4, 4));
    const VoxelGrid grid = gridAround(box, 4);
    EXPECT_EQ(grid.resolution(), 16u);
    EXPECT_EQ(grid.voxelSizeWorld, 0.5);
    EXPECT_EQ(grid.originWorld, glm::dvec3(-1, -1, -0.5));
    EXPECT_EQ(grid.voxelFromWorld(glm::dvec3(7, 2, 3)), glm::dvec3(16, 6, 7));
    EXPECT_EQ(grid.worldFromVoxel(glm::dvec3(16, 6, 7)), glm::dvec3(7, 2, 3));
}

TEST(VoxelGrid, SinglePointGetsAMetre) {
    Box box;
    box.add(glm::vec3(5, 6, 7));
    const VoxelGrid grid = gridAround(box, 0);
    EXPECT_EQ(grid.voxelSizeWorld, 1.0);
    EXPECT_EQ(grid.originWorld, glm::dvec3(4.5, 5.5, 6.5));
}

TEST(VoxelGrid, RefusesTooManyLevelsAndEmptyBounds) {
    Box box;
    box.add(glm::vec3(0));
    EXPECT_NO_THROW(gridAround(box, kMaxResolutionLog2));
    EXPECT_THROW(gridAround(box, kMaxResolutionLog2 + 1), Error);
    EXPECT_THROW(gridAround(Box{}, 4), Error);
}

} // namespace
} // namespace shadowdag
