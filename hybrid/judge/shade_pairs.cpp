// SPDX-License-Identifier: Apache-2.0
// Pictures of visibilities that no frame produced.
#include "hybrid/judge/error.h"

#include "cuda/parallel_for.h"

namespace shadowdag {

std::vector<glm::vec3> shadePairs(const GBufferView& gbuffer, const World& world,
                                  const PairList& pairs, const std::vector<uint8_t>& visibility) {
    SDAG_ASSERT(visibility.size() == pairs.count());
    std::vector<glm::vec3> color(gbuffer.count(), glm::vec3(0.0f));
    const std::vector<Material>& materials = world.scene().materials;
    cpuParallelRanges(color.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t s = begin; s < end; ++s) {
            if (gbuffer.triangle[s] == kBackground)
                continue;
            const Material& material = materials[world.triangleMaterial()[gbuffer.triangle[s]]];
            const SurfaceColor surface{gbuffer.baseColorOr(s, material.baseColor),
                                       material.emission};
            color[s] = unlitRadiance(surface);
            for (uint64_t p = pairs.sampleStart[s]; p < pairs.sampleStart[s + 1]; ++p)
                if (visibility[p] != 0)
                    color[s] +=
                        reflectedRadiance(world.lights()[pairs.light[p]], gbuffer.positionWorld[s],
                                          gbuffer.normalWorld[s], surface, visibility[p]);
        }
    });
    return color;
}

} // namespace shadowdag
