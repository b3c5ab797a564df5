// SPDX-License-Identifier: Apache-2.0
// The input of cost models: a record of every map that clusters request, with its quantities, and
// its state between frames.
#pragma once

#include "hybrid/frame/frame_clusters.h"
#include "hybrid/frame/map_receivers_pass.h"
#include "shadowmap/shadow_maps.h"

namespace shadowdag {

/// Makes the records of a frame's maps; keeps resolutions and routes for hysteresis.
class MapRouting {
public:
    explicit MapRouting(const FrameContext& context)
        : context_(context), receivers_(context.backend), counting_(context.backend) {}

    /// Returns a record of every map that a cluster requests, in the order of
    /// ClusterLightsView::record, with all quantities except those of count(). Reads the held
    /// resolutions and does not change them.
    std::vector<MapRecord> describe(const FrameClusters& clusters,
                                    const FrameOptions& options) const;

    /// Fills in the counted quantities of every record.
    /// @param counts which, a set of Counts. @param times the time of each is added, by kCountNames
    void count(const VisibleSurface& surface, const FrameClusters& clusters,
               const FrameOptions& options, uint32_t counts, std::vector<MapRecord>& maps,
               StageTimes& times);

    /// Keeps the allocated resolutions and the routes for the next frame.
    void hold(const FrameClusters& clusters, const std::vector<MapRecord>& maps);
    /// Releases the state of earlier frames.
    void forget();

private:
    /// The batches in a light's sphere whose instances never move.
    struct SphereCount {
        glm::vec3 positionWorld{0.0f};
        float rangeWorld = -1; ///< < 0: not counted yet
        uint32_t batches = 0;
        uint64_t triangles = 0;
        bool hasMoved = false; ///< the light moved
    };
    /// The output of counting a map's pages and pairs.
    struct Counting {
        explicit Counting(Backend backend)
            : maps(backend, "routing maps"), pageCounts(backend, "routing page counts"),
              pages(backend, "routing pages"), pairs(backend, "routing pairs") {}

        Buffer<ShadowMapInfo> maps;
        Buffer<uint32_t> pageCounts, pages, pairs;
    };

    void countPages(const VisibleSurface& surface, const FrameClusters& clusters,
                    const FrameOptions& options, std::vector<MapRecord>& records);
    void countStanding(const std::vector<MapRecord>& maps);
    void estimatePairs(const VisibleSurface& surface, const FrameClusters& clusters,
                       std::vector<MapRecord>& records);

    FrameContext context_;
    MapReceivers receivers_; ///< of all maps
    Counting counting_;
    std::vector<SphereCount> spheres_; ///< by light; affects no result
    /// By slot (LightDemandView): the resolution that the last frame allocated, 0 for none, and its
    /// source.
    std::vector<uint32_t> heldFaceTexels_;
    std::vector<PreviousRoute> heldRoutes_;
};

/// Returns the quantities of every record.
std::vector<MapQuantities> quantitiesOf(const std::vector<MapRecord>& maps);

/// Returns the request of a map to the shadow maps.
MapRequest requestOf(const std::vector<Light>& lights, const MapRecord& map);

} // namespace shadowdag
