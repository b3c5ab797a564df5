// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/frame_state.h"

#include "hybrid/clusters/cluster_grid.h"

namespace shadowdag {

FrameState::FrameState(Backend backend, const World& world, const Dag& dag,
                       const BatchOptions& batchOptions)
    : FrameState(std::make_shared<FrameScene>(backend, world, dag, batchOptions)) {}

FrameState::FrameState(std::shared_ptr<FrameScene> scene)
    : sharedScene(std::move(scene)),
      device(sharedScene->device().makeFrame()), context{sharedScene->backend(), *sharedScene,
                                                         *device},
      surface(context), clusters(context), routing(context), maps(context), shading(context) {
    guessLengths(context.backend == Backend::kCuda);
}

FrameOptions FrameState::accept(const FrameOptions& asked) const {
    if (asked.rays.triangleRays == TriangleRays::kEmbree && context.backend != Backend::kCpu)
        throw Error(ErrorKind::kUsage,
                    std::string("rays of Embree run on the CPU only, not with ") +
                        backendName(context.backend) + "; use --backend cpu");
    if (asked.rays.keepsBeams() && context.backend != Backend::kCpu)
        throw Error(ErrorKind::kUsage, std::string("beams are kept on the CPU only, not with ") +
                                           backendName(context.backend) +
                                           "; use --backend cpu or leave --beams out");
    device->checkOptions(asked);
    checkOptions(asked);
    return device->followed(asked);
}

void FrameState::gather(const ViewRays& view, const FrameOptions& options, StageTimes& stages) {
    checkClusterGrid(view);
    surface.draw(view, stages);
    clusters.gather(surface, view, options, stages);
}

void FrameState::count(const std::vector<uint32_t>& records, FrameResult& result) {
    FrameCounts& counts = result.counts;
    counts.sampleCount = clusters.clusters().samples.size();
    counts.clusterCount = clusters.clusters().cell.size();
    counts.clusterLightCount = clusters.lights().lights.size();
    for (const uint32_t record : records)
        counts.prunedClusterLightCount += record == kProvenLit;
    shading.count(counts);
    std::vector<uint8_t> served(context.scene.world().lights().size(), 0); // bit 0: rays, 1: maps
    for (const MapRecord& map : result.maps) {
        const bool isTraced = map.route == Route::kRays;
        ++(isTraced ? counts.tracedMapCount : counts.drawnMapCount);
        served[map.quantities.light] |= isTraced ? 1 : 2;
    }
    for (const uint8_t by : served) {
        counts.tracedLightCount += by & 1;
        counts.mappedLightCount += by >> 1;
    }
    counts.maps = maps.maps().counts();
    counts.unsplitTriangleCount = surface.unsplitTriangleCount();
    counts.listRerunCount = clusters.listRerunCount() + counts.maps.listRerunCount;
}

void FrameState::guessLengths(bool isOn, size_t spare) {
    clusters.guessLengths(isOn, spare);
    maps.maps().guessLengths(isOn, spare);
}

void FrameState::forget() {
    clusters.forgetLengths();
    routing.forget();
    maps.maps().forget();
    shading.forget();
}

} // namespace shadowdag
