// SPDX-License-Identifier: Apache-2.0
// Renders a frame by the hybrid: a cost model chooses rays or a shadow map for each light.
#include "cuda/error.h"
#include "hybrid/frame.h"
#include "scenes/builtin.h"
#include "voxel/voxelize.h"

#include <algorithm>
#include <cstdio>

int main() {
    using namespace shadowdag;
    try {
        const Scene scene = makeBuiltin("atrium");
        const World world(scene, {});
        const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                                 gridAround(world.staticBoundsWorld(), 8));
        FrameRenderer renderer(Backend::kCpu, world, dag);
        FrameOptions options;
        options.width = 160;
        options.height = 90;
        const FrameResult frame =
            renderer.render(world.cameras().at(0), *makeCostModel("texels:96"), options);
        const auto litCount = std::count_if(frame.visibility.begin(), frame.visibility.end(),
                                            [](uint8_t visibility) { return visibility >= 128; });
        std::printf("%zu pairs, %zu of them lit; %u maps by rays, %u drawn\n",
                    frame.visibility.size(), size_t(litCount), frame.counts.tracedMapCount,
                    frame.counts.drawnMapCount);
        return litCount > 0 ? 0 : 1;
    } catch (const Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return int(error.kind());
    }
}
