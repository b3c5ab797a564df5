// SPDX-License-Identifier: Apache-2.0
// What a FrameRenderer keeps, and the steps of a frame that frame.cpp and frame_costs.cpp both
// take. Not for other folders.
#pragma once

#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/clusters/pairs_pass.h"
#include "hybrid/clusters/prune_pass.h"
#include "hybrid/frame.h"
#include "hybrid/frame/frame_scene.h"
#include "hybrid/frame/map_receivers_pass.h"
#include "hybrid/frame/shade_pass.h"
#include "hybrid/gbuffer/gbuffer_pass.h"
#include "hybrid/gl/frame_gl.h"
#include "hybrid/routing/resolution_pass.h"

#include <memory>

namespace shadowdag {

/// The batches in a light's sphere whose instances never move.
struct SphereCount {
    glm::vec3 positionWorld{0.0f};
    float rangeWorld = -1; ///< < 0: not counted yet
    uint32_t batches = 0;
    uint64_t triangles = 0;
    bool hasMoved = false; ///< the light stood elsewhere before
};

struct FrameState {
    explicit FrameState(std::shared_ptr<FrameScene> scene);
    FrameState(Backend backend, const World& world, const Dag& dag,
               const BatchOptions& batchOptions = {});

    Backend backend; ///< of passes and buffers: passBackend of the renderer's
    std::shared_ptr<FrameScene> sharedScene; ///< with the renderers of the same world and DAG
    FrameScene& scene;
    std::unique_ptr<GlFrame> gl; ///< of Backend::kGl; null otherwise
    MovedBatches movedBatches;
    RayDetail detail; ///< of the last frame gathered, on the backend
    GBuffer gbuffer;
    ClusterSet clusters;
    ClusterLights lists;
    OrderedLights orderedLights; ///< of FrameOptions::reorderLights
    LightDemand demand;
    MapReceivers receivers; ///< of the maps that are drawn, or, while they are counted, of all
    ShadowMaps maps;
    /// What counting a map's pages and pairs before it is routed writes.
    struct RoutingCounts {
        explicit RoutingCounts(Backend backend)
            : maps(backend, "routing maps"), pageCounts(backend, "routing page counts"),
              pages(backend, "routing pages"), projection(backend, "routing projection"),
              faces(backend, "routing faces"), depths(backend, "routing depths"),
              pairs(backend, "routing pairs") {}

        Buffer<ShadowMapInfo> maps;
        Buffer<uint32_t> pageCounts, pages, projection, faces, depths, pairs;
    } routing;
    std::vector<uint32_t> ofMaps; ///< LightDemand::ofMaps of the last frame gathered, on the host
    /// How long gathering's lists become, where it is guessed.
    bool isGuessing = false;
    LengthGuess clusterGuess, clusterLightGuess;
    uint64_t listRerunCount = 0; ///< of the last frame gathered: 1 if they were guessed too short
    Buffer<glm::vec3> color;
    Buffer<uint32_t> rayCount, lookupCount, provenCount, missingTapCount,
        moverTestCount; ///< by cluster
    PairSet pairs;
    Buffer<uint32_t> nextPair;
    Buffer<uint8_t> pairVisibility;
    Buffer<PairServer> pairServer;

    std::vector<PairServer> servers; ///< of the last frame, by record
    Resident<PairServer> serversOnBackend;
    /// By slot (LightDemandView), what the last frame allocated; 0 for none: hysteresis.
    std::vector<uint32_t> heldFaceTexels;
    /// By slot, who served it in the last frame: hysteresis.
    std::vector<PreviousRoute> heldRoutes;
    /// By light; what frames count once (countQuantities). Changes no result.
    std::vector<SphereCount> spheres;

    // Host copies of the last frame for reports; used on CUDA only, depths on OpenGL as well.
    struct HostCopies {
        std::vector<glm::vec3> positionWorld, normalWorld;
        std::vector<float> depthView;
        std::vector<uint32_t> triangle;
        std::vector<ShadowMapInfo> maps;
        std::vector<uint32_t> pageTable, depths;
        std::vector<uint32_t> resolutionSquaredBits;
        std::vector<uint32_t> cell, sampleStart, samples, clusterOfSample, normalCell;
        std::vector<Box> boxesWorld;
        std::vector<uint32_t> lightStart, lights, record, projection;
        std::vector<float> wantedSquared;
    } host;

    /// Does what FrameRenderer::guessLengths does.
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);
    /// Makes OpenGL ready on this thread until what is returned goes; nothing on other backends.
    std::unique_ptr<GlContext::Current> makeCurrent() const {
        return gl ? gl->makeCurrent() : nullptr;
    }
    /// Returns the options that frames of this backend follow (GlFrame::followed).
    FrameOptions followed(const FrameOptions& options) const {
        return gl ? gl->followed(options) : options;
    }
};

/// Throws Error kUsage naming the option that is out of range, contradicts another, or that the
/// backend does not follow.
void checkOptions(const FrameState& state, const FrameOptions& options);

/// Draws the G-buffer, gathers clusters, assigns lights and gathers what the lights ask of their
/// maps, and fetches that; adds the stages' times. Lists have no room to spare afterwards.
void gatherFrame(FrameState& state, const ViewRays& view, const FrameOptions& options,
                 StageTimes& stages);

/// Returns what FrameRenderer::measureCosts returns, before any scaling.
FrameCosts measureFrameCosts(FrameState& state, const ViewRays& view, const FrameOptions& options,
                             int repeats, const std::function<void()>& beforeStage);

/// Multiplies the costs of a frame's maps so that those by one method add up to what the frame
/// takes by it; leaves costs alone that add up to 0.
void scaleCosts(FrameCosts& costs, double raysMs, double mapsMs);

/// Scales the costs of a frame's maps to whole frames by one method.
void scaleToFrame(FrameRenderer& renderer, const Camera& camera, const FrameOptions& options,
                  int repeats, FrameCosts& costs, const std::function<void()>& beforeStage);

/// Returns a record of every map that a cluster asks for, in the order of
/// ClusterLightsView::record, with all quantities but those of countQuantities. Reads the held
/// resolutions and does not change them.
std::vector<MapRecord> describeMaps(const FrameState& state, const FrameOptions& options);

/// Fills in the counted quantities of every record.
/// @param counts which, a set of Counts
/// @param times the time of each is added, by kCountNames
void countQuantities(FrameState& state, const FrameOptions& options, uint32_t counts,
                     std::vector<MapRecord>& maps, StageTimes& times);

/// Returns what a map asks of the shadow maps.
MapRequest requestOf(const std::vector<Light>& lights, const MapRecord& map);

/// Gives the records of suns their windows, over the clusters that ask for them.
void fitSunWindows(const FrameState& state, const FrameOptions& options,
                   std::vector<MapRecord>& records);

/// Returns the quantities of every record.
std::vector<MapQuantities> quantitiesOf(const std::vector<MapRecord>& maps);

/// Keeps the allocated resolutions and the routes for the next frame.
void holdMaps(FrameState& state, const std::vector<MapRecord>& maps);

/// Builds the maps routed to be drawn; all others are traced. Adds the stages' times. Throws Error
/// kUsage when a map is routed to rays and there is no DAG.
void buildMaps(FrameState& state, const std::vector<MapRecord>& maps, const FrameOptions& options,
               StageTimes& stages);

/// Returns the shading of the current frame; counters are cleared, nothing is recorded.
ShadeSamples prepareShading(FrameState& state, const FrameOptions& options);

/// Shades every sample by all its lights, in one pass (two on the CPU and CUDA: what is sent
/// without lights comes first).
void shade(FrameState& state, const ShadeSamples& shading);

/// Returns the exact pairs of what was gathered, and leaves them in state.pairs.
PairList findPairs(FrameState& state);

/// Lists the exact pairs and answers them again with recording on; fills pairs, visibility,
/// pairRoute and the records' pair counts.
/// @param records of every (cluster, light) pair, ClusterLightsView::record on the host
void recordPairs(FrameState& state, const ShadeSamples& shading,
                 const std::vector<uint32_t>& records, FrameResult& result);

/// Fills in the counts of a shaded frame. @param records as recordPairs has them
void countFrame(const FrameState& state, const std::vector<uint32_t>& records, FrameResult& result);

/// Return the last frame's samples, clusters, maps and what its rays' levels follow on the host;
/// valid until the next frame.
GBufferView hostGBuffer(FrameState& state);
ClusterView hostClusters(FrameState& state);
ClusterLightsView hostClusterLights(FrameState& state);
View<const float> hostWantedSquared(FrameState& state);
ShadowMapView hostShadowMaps(FrameState& state);
View<const uint32_t> hostProjectionMaps(FrameState& state);
RayDetail hostRayDetail(FrameState& state);

} // namespace shadowdag
