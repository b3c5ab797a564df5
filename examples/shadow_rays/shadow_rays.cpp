// SPDX-License-Identifier: Apache-2.0
// Traces shadow rays through voxels, from points one metre above the atrium's floor to every light,
// and prints a map of them: the more lights a point sees, the denser its character.
#include "scenes/builtin.h"
#include "scenes/world.h"
#include "voxel/dag_trace.h"
#include "voxel/voxelize.h"

#include <cstdio>

int main() {
    using namespace shadowdag;
    const Scene scene = makeBuiltin("atrium"); // or readGltf(PATH) of scenes/gltf.h
    const World world(scene, {});
    const VoxelGrid grid = gridAround(world.staticBoundsWorld(), 8); // 2^8 voxels an axis
    const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()), grid);
    const Box& bounds = world.boundsWorld();
    constexpr int kRows = 24, kColumns = 72;
    size_t litCount = 0;
    for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            const glm::vec3 share((column + 0.5f) / kColumns, 0.0f, (row + 0.5f) / kRows);
            glm::vec3 point = glm::mix(bounds.min, bounds.max, share);
            point.y = 1.0f;
            size_t seen = 0;
            for (const Light& light : world.lights())
                seen += !occluded(dag.view(), shadowSegment(grid, point, {0, 1, 0},
                                                            pointAtLight(light, point), 1.0f, 0));
            std::putchar(" .:-=+*#%@"[seen * 9 / world.lights().size()]);
            litCount += seen;
        }
        std::putchar('\n');
    }
    const size_t pairCount = kRows * kColumns * world.lights().size();
    std::printf("%zu of %zu pairs of a point and a light are lit\n", litCount, pairCount);
    return litCount > 0 && litCount < pairCount ? 0 : 1;
}
