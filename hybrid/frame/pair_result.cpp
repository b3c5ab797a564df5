// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/pair_result.h"

#include "hybrid/rays/embree_scene.h"

namespace shadowdag {

uint8_t computePairResultOnHost(const VisibilityInputs& inputs, PairServer server,
                                uint32_t lightIndex, const Light& light,
                                const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                                uint32_t receiver, VisibilityCounts& counts) {
    const RayInputs& rays = inputs.rays;
    if (server.by() != ServedBy::kRays || rays.options.triangleRays != TriangleRays::kEmbree)
        return computePairResult(inputs, server, lightIndex, light, positionWorld, normalWorld,
                                 receiver, counts);
    SDAG_ASSERT(rays.embree != nullptr);
    ++counts.rayCount;
    const uint32_t first = 0;
    uint8_t isBlocked = 0;
    rays.embree->trace(light, {&positionWorld, 1}, {&normalWorld, 1}, {&first, 1}, {&isBlocked, 1});
    if (isBlocked == 0 && rays.movers.mayShadow(lightIndex)) {
        ++counts.rays.moverTestCount;
        const ShadowPair pair{positionWorld, normalWorld, pointAtLight(light, positionWorld),
                              receiver,      lightIndex,  light.kind == Light::kSun};
        isBlocked = isDarkByMovers(rays.movers, pair);
    }
    return isBlocked != 0 ? uint8_t(0) : kLit;
}

} // namespace shadowdag
