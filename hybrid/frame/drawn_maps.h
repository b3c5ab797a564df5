// SPDX-License-Identifier: Apache-2.0
// The shadow maps of a frame: those that are routed to be drawn.
#pragma once

#include "cuda/resident.h"
#include "hybrid/frame/frame_clusters.h"
#include "hybrid/frame/map_receivers_pass.h"
#include "shadowmap/shadow_maps.h"

#include <algorithm>

namespace shadowdag {

/// Builds the maps of a frame and lists the sources of all records. Keeps maps from frame to frame.
class DrawnMaps {
public:
    explicit DrawnMaps(const FrameContext& context)
        : context_(context), moved_(context.scene),
          maps_(context.backend, context.device.mapDrawer()), receivers_(context.backend),
          serversOnBackend_(context.backend, "servers of maps") {}

    /// Builds the maps routed to be drawn; all others are traced. Adds the stages' times. Throws
    /// Error kUsage when a map is routed to rays and there is no DAG.
    void build(const VisibleSurface& surface, const FrameClusters& clusters,
               const std::vector<MapRecord>& records, const FrameOptions& options,
               StageTimes& stages);
    /// Builds one map alone, for costs.
    /// @param receivers of the map, on the backend
    void buildAlone(const VisibleSurface& surface, const FrameClusters& clusters,
                    const MapRequest& request, View<const MapReceiver> receivers,
                    const FrameOptions& options, StageTimes& stages);
    /// Sets the sources of the records of a frame.
    void setServers(std::vector<PairServer> servers);

    /// Returns the source of every record of the last frame, on the backend.
    View<const PairServer> servers() const { return serversOnBackend_.view(); }
    /// Returns whether a record of the last frame is served by a method.
    bool serves(ServedBy method) const {
        return std::any_of(servers_.begin(), servers_.end(),
                           [&](const PairServer& server) { return server.by() == method; });
    }
    /// Returns the input of lookups; valid until the next build.
    ShadowMapView view() const { return maps_.view(); }
    ShadowMaps& maps() { return maps_; }
    const ShadowMaps& maps() const { return maps_; }

    /// Return the maps and their projection maps on the host; valid until the next frame.
    ShadowMapView hostView();
    View<const uint32_t> hostProjectionMaps();

private:
    FrameContext context_;
    MovedBatches moved_;
    ShadowMaps maps_;
    MapReceivers receivers_;
    std::vector<PairServer> servers_;
    Resident<PairServer> serversOnBackend_;

    struct HostCopies {
        std::vector<ShadowMapInfo> maps;
        std::vector<uint32_t> pageTable, depths, projection;
    } host_;
};

} // namespace shadowdag
