// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/drawn_maps.h"

#include "cuda/mutant.h"
#include "hybrid/frame/host_copy.h"
#include "hybrid/frame/map_routing.h"
#include "hybrid/frame/page_marker.h"

#include <utility>

namespace shadowdag {

std::vector<PairServer> serversOf(const std::vector<MapRecord>& maps) {
    std::vector<PairServer> servers;
    uint32_t drawnCount = 0;
    for (const MapRecord& map : maps)
        servers.push_back(map.route == Route::kMap ? PairServer::drawnMap(drawnCount++)
                                                   : PairServer::rays());
    if (servers.size() > 1 && drawnCount > 1 && isMutant(Mutant::kRoutesSwapped))
        std::swap(servers.front(), servers.back());
    return servers;
}

void DrawnMaps::setServers(std::vector<PairServer> servers) {
    servers_ = std::move(servers);
    serversOnBackend_.set(servers_);
}

void DrawnMaps::build(const VisibleSurface& surface, const FrameClusters& clusters,
                      const std::vector<MapRecord>& records, const FrameOptions& options,
                      StageTimes& stages) {
    FrameScene& scene = context_.scene;
    std::vector<MapRequest> requests;
    {
        const StageTimer timer(context_.backend, stages, "routing");
        for (const MapRecord& record : records) {
            if (record.route == Route::kMap) {
                requests.push_back(requestOf(scene.world().lights(), record));
            } else if (!scene.canTrace(options.rays)) {
                throw Error(ErrorKind::kUsage,
                            "light " + std::to_string(record.quantities.light) +
                                " is routed to rays, but there is no voxel DAG; voxelize the "
                                "scene, or route every light to maps with texels:0");
            }
        }
        setServers(serversOf(records));
        if (requests.empty())
            receivers_.list.resize(0);
        else
            listReceivers(context_.backend, clusters.lists(), {servers()}, receivers_,
                          clusters.isGuessing());
    }
    const MapGeometry onBackend = scene.mapGeometryOnBackend(options.maps.lodTexels);
    const std::vector<uint32_t> moved = moved_.take(options.maps.lodTexels);
    const View<const MapReceiver> receivers = std::as_const(receivers_.list).view();
    maps_.build(requests,
                {clusters.view().boxesWorld, receivers, onBackend.triangles, onBackend.batches,
                 *pageMarkerOf(context_, surface, clusters, receivers, options.pageMarks), true},
                scene.mapGeometry(options.maps.lodTexels).batches, options.maps, stages,
                viewOf(moved));
}

void DrawnMaps::buildAlone(const VisibleSurface& surface, const FrameClusters& clusters,
                           const MapRequest& request, View<const MapReceiver> receivers,
                           const FrameOptions& options, StageTimes& stages) {
    const float lodTexels = options.maps.lodTexels;
    const MapGeometry onBackend = context_.scene.mapGeometryOnBackend(lodTexels);
    maps_.build({request},
                {clusters.view().boxesWorld, receivers, onBackend.triangles, onBackend.batches,
                 *pageMarkerOf(context_, surface, clusters, receivers, options.pageMarks)},
                context_.scene.mapGeometry(lodTexels).batches, options.maps, stages);
}

ShadowMapView DrawnMaps::hostView() {
    const auto current = context_.device.makeCurrent();
    const ShadowMapView view = maps_.view();
    return {copyToHost(context_.backend, view.maps, host_.maps),
            copyToHost(context_.backend, view.pageTable, host_.pageTable),
            context_.device.hostDepths(view.depths, host_.depths), view.pageTexelsLog2};
}

View<const uint32_t> DrawnMaps::hostProjectionMaps() {
    return copyToHost(context_.backend, maps_.projectionMaps(), host_.projection);
}

} // namespace shadowdag
