// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_view.h"

#include "hybrid/clusters/cluster_grid.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/gbuffer/view_rays.h"
#include "scenes/batches.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace shadowdag {

BenchView makeBenchView(const World& world, const Camera& camera, uint32_t width, uint32_t height) {
    BenchView view;
    const ViewRays rays = makeViewRays(camera, width, height);
    checkClusterGrid(rays);
    const BatchSet batches(world);
    drawGBuffer(Backend::kCpu, world.triangles(), batches.view(), rays, view.gbuffer);
    buildClusters(Backend::kCpu, view.gbuffer.view(), rays, ClusterBounds::kTight, view.clusters);
    return view;
}

const char* rayOrderName(RayOrder order) {
    return order == RayOrder::kImage ? "image" : "cluster";
}

BenchRays makeBenchRays(const BenchView& view, const World& world, const VoxelGrid& grid,
                        RayOrder order) {
    const GBufferView samples = view.gbuffer.view();
    const ClusterView clusters = view.clusters.view();
    BenchRays rays;
    const auto ask = [&](uint32_t sample, const Light& light) {
        const glm::vec3 position = samples.positionWorld[sample],
                        normal = samples.normalWorld[sample];
        if (light.kind == Light::kSun || samples.triangle[sample] == kBackground ||
            !isPair(light, position, normal))
            return;
        const DagSegment segment =
            shadowSegment(grid, position, normal, light.positionWorld, 1.0f, 0);
        rays.voxel.push_back(segment);
        rays.world.push_back({glm::vec3(grid.worldFromVoxel(glm::dvec3(segment.from))),
                              glm::vec3(grid.worldFromVoxel(glm::dvec3(segment.to)))});
    };
    if (order == RayOrder::kImage) {
        for (const Light& light : world.lights())
            for (uint32_t sample = 0; sample < samples.count(); ++sample)
                ask(sample, light);
    } else {
        for (size_t cluster = 0; cluster < clusters.count(); ++cluster)
            for (const Light& light : world.lights())
                for (uint32_t i = clusters.sampleStart[cluster];
                     i < clusters.sampleStart[cluster + 1]; ++i)
                    ask(clusters.samples[i], light);
    }
    return rays;
}

Spread Spread::of(const std::vector<double>& values) {
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    return {medianInterval(values), *least, *greatest};
}

Json Spread::toJson(const std::string& key) const {
    return {{key, median.value},          {key + "_low", median.low},
            {key + "_high", median.high}, {key + "_confidence", median.confidence},
            {key + "_min", min},          {key + "_max", max}};
}

} // namespace shadowdag
