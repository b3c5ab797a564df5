// SPDX-License-Identifier: Apache-2.0
// One frame: G-buffer, clusters, (cluster, light) pairs, required resolution, routing, pages and
// rays, shading.
#pragma once

#include "cuda/timer.h"
#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/clusters/clusters.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/clusters/prune.h"
#include "hybrid/gbuffer/gbuffer.h"
#include "hybrid/rays/shadow_rays.h"
#include "hybrid/routing/cost_model.h"
#include "hybrid/routing/pair_server.h"
#include "hybrid/routing/pixel_footprint.h"
#include "scenes/batches.h"
#include "scenes/world.h"
#include "shadowmap/shadow_maps.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

struct FrameOptions {
    uint32_t width = 640, height = 360;
    float undersample = 1.0f; ///< divisor of the required resolution, u2 = 2
    ResolutionRule resolutionRule = ResolutionRule::kSphere; ///< before undersampling
    uint32_t mapsPerLight =
        1; ///< 1..kMaxMapsPerLight: by octaves of what clusters ask for (4SM = 4)
    uint32_t minFaceTexels =
        16; ///< lower limit of the allocated resolution, so that thin walls do not leak light
    uint32_t maxFaceTexels = 2048; ///< and to this from above, kMaxFaceTexels at most
    ClusterBounds clusterBounds = ClusterBounds::kTight;
    /// The k of Nk clustering, k x k cells of normals on every face of a cube, at most
    /// kMaxNormalCellsPerEdge; 0: clusters by position alone.
    uint32_t normalClusters = 0;
    /// Shades with each cluster's lights in the order of a curve through space instead of by index;
    /// answers stay the same, sums of colours round in another order.
    bool reorderLights = false;
    PairPruning pruning = PairPruning::kFacing;
    ShadowMapOptions maps;
    ShadowMapBias bias; ///< taps: at most maps.taps, whose pages are marked
    RayOptions rays;
    /// A map changes its method only when the other is cheaper by more than the factor 1 + margin;
    /// 0 routes every frame anew. For frames in sequence by one model.
    float routeMargin = 0.0f;
    bool recordPairs = true; ///< keep visibility per pair (outside the timing of the stages)
    /// Count the quantities of maps that the model does not read, for reports (outside as well).
    bool recordQuantities = true;

    bool operator==(const FrameOptions&) const = default;
};

/// Everything that a frame knows about one shadow map, that is the clusters of one light whose
/// requests share an octave, whether it is drawn or traced instead.
struct MapRecord {
    MapQuantities quantities;
    Route route = Route::kRays;
    uint64_t pairCount = 0; ///< exact pairs served (only with recordPairs)
    SunWindow window =
        {}; ///< of a directional light's map; its `texels` are the width of what receives
    uint32_t heldTexels =
        0; ///< what hysteresis holds: faceTexels; of a directional light those of its lattice
};

struct FrameCounts {
    uint64_t sampleCount = 0;  ///< pixels that see geometry
    uint64_t clusterCount = 0; ///< unique clusters
    uint64_t clusterLightCount = 0;
    uint64_t prunedClusterLightCount = 0; ///< of these, taken out (PairPruning)
    uint64_t pairCount = 0;               ///< exact pairs
    uint64_t rayCount = 0;
    uint64_t moverTestCount = 0; ///< rays that voxels left lit and that were held against movers
    /// Ray-traced pairs in (cluster, light) pairs that are wholly lit, wholly dark, neither: what
    /// proofs could answer without parting clusters (only with recordPairs).
    uint64_t wholeLitPairCount = 0, wholeDarkPairCount = 0, mixedPairCount = 0;
    uint64_t lookupCount = 0;
    uint64_t provenPairCount = 0;  ///< pairs lit by proof: neither a ray nor a lookup
    uint32_t tracedLightCount = 0; ///< lights with a traced map; one may count as mapped as well
    uint32_t mappedLightCount = 0; ///< lights with a drawn map
    uint32_t tracedMapCount = 0;
    uint32_t drawnMapCount = 0;
    uint64_t missingTapCount = 0; ///< PCF taps on pages without memory; 0 unless something is wrong
    ShadowMapCounts maps;
    uint64_t unsplitTriangleCount = 0; ///< large ones of the G-buffer that found no room to be
                                       ///< shared out, and were drawn by a thread each; CUDA only
    uint64_t listRerunCount = 0;       ///< lists guessed too short, and made again (guessLengths)
    HostCopyCounts hostCopies; ///< of the frame proper, before its reports: round trips on CUDA
};

struct FrameResult {
    std::vector<glm::vec3> color;    ///< width * height, linear radiance
    PairList pairs;                  ///< with recordPairs
    std::vector<uint8_t> visibility; ///< with recordPairs; per pair
    std::vector<Route> pairRoute;    ///< with recordPairs; per pair, which method answered (kRays
                                     ///< for proofs, which voxels give)
    std::vector<PairServer> pairServer; ///< with recordPairs; per pair
    std::vector<MapRecord> maps;        ///< ascending light, then octave
    StageTimes stages;   ///< of the frame proper: without recording, truth, host copies for reports
    StageTimes counting; ///< of the quantities that models count (kCountNames), read or not; with
                         ///< recordQuantities
    FrameCounts counts;
};

/// Returns the time of the stages whose work depends on the routes, milliseconds.
double servingMs(const StageTimes& stages);

/// Returns who serves every record: rays, or which of FrameRenderer::shadowMaps(), those that are
/// drawn, in order.
std::vector<PairServer> serversOf(const std::vector<MapRecord>& maps);

/// Renders frames of one world on one backend. Keeps what persists between frames (allocated
/// resolutions and routes for hysteresis, shadow maps with static optimization, buffers).
class FrameRenderer {
public:
    /// World and dag outlive the renderer. A dag without voxels blocks nothing; one that was never
    /// built (Dag::isBuilt) is none: rendering then throws Error kUsage when a map is routed to
    /// rays.
    FrameRenderer(Backend backend, const World& world, const Dag& dag,
                  const BatchOptions& batchOptions = {});
    ~FrameRenderer();

    /// Returns another renderer of the same world and DAG that shares with this one what stands for
    /// them (batches, levels of detail, the DAG as rays read it, what moves) and keeps its own of
    /// all that frames leave. One of those that share is told what changed, for all. Not to be
    /// used by several threads at once.
    std::unique_ptr<FrameRenderer> shareScene() const;

    /// Tells that World::setTime moved instances (refits batches) or lights. Returns what that
    /// took: "batch boxes", "batch hierarchy", and "scene update", which is positions, lights with
    /// their hierarchy, and what moves as rays are held against it.
    /// @param ofLevels receives what levels of detail took of the first two, for those renderers
    /// that draw them; null: it is part of what is returned
    StageTimes worldChanged(const std::vector<uint32_t>& movedInstances,
                            StageTimes* ofLevels = nullptr);

    /// Says whether frames guess the lengths of their lists by those of the frame before, so that
    /// the host need not wait for them (cuda/list_length.h); at first on CUDA alone. No result
    /// depends on it but FrameCounts::listRerunCount. @param spare as LengthGuess::forget
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);

    /// Forgets what earlier frames left (hysteresis, kept shadow maps), so that the next frame
    /// depends on its inputs alone, but for FrameCounts::listRerunCount and unsplitTriangleCount.
    void reset();

    /// Renders one frame with the routes of `model`. When the model needs costs they must have been
    /// set. Deterministic but for stage times, FrameCounts::listRerunCount (which depends on the
    /// frames before) and unsplitTriangleCount (on the order of threads).
    /// @param beforeStage is called before every stage; what it throws gives the frame up. The next
    /// frame is then what it would have been without this one, but that kept maps may be drawn
    /// anew; until then what is said below of the last frame means nothing
    FrameResult render(const Camera& camera, const CostModel& model, const FrameOptions& options,
                       const std::function<void()>& beforeStage = {});

    /// Returns the pairs that render with recordPairs finds, without answering them; gbuffer() is
    /// that of this frame then, and what is kept between frames stays as it is.
    PairList listPairs(const Camera& camera, const FrameOptions& options);

    /// Returns the cost of every map of this frame by both methods: its rays alone; its masks,
    /// pages, culling, drawing and lookups alone; each measured by itself, then scaled so that
    /// those of all maps by one method add up to what the frame takes by it (FrameCosts::raysScale,
    /// mapsScale): what a method shares among maps is paid once a frame, and by every map that is
    /// measured alone. Without static optimization; forgets the frames before. Medians of
    /// `repeats`.
    /// @param beforeStage as render() has it
    FrameCosts measureCosts(const Camera& camera, const FrameOptions& options, int repeats = 3,
                            const std::function<void()>& beforeStage = {});

    /// Returns the host G-buffer of the last frame; valid until the next.
    GBufferView gbuffer() const;
    /// Returns what moves, on the host, as rays are held against it; valid until worldChanged.
    MoverView movers() const;
    /// Returns what exact rays were held against, on the host; without words before the first frame
    /// of RayKind::kExact or prepareExact().
    ExactView exact() const;
    /// Lists the triangles near voxels, which exact rays need, once; does nothing without voxels.
    void prepareExact();
    /// Returns maps of the last frame for the error analysis (FrameResult::pairServer names them);
    /// valid until the next.
    ShadowMapView shadowMaps() const;
    /// Returns the clusters of the last frame and the lights of each, on the host; valid until the
    /// next. A record indexes FrameResult::maps of a frame that was rendered.
    ClusterView clusters() const;
    ClusterLightsView clusterLights() const;
    /// Returns R^2 that every entry of clusterLights() asks for, before undersampling, on the host;
    /// meaningless where the record is kProvenLit; valid until the next frame.
    View<const float> wantedSquared() const;
    /// Returns the projection maps of the last frame's drawn maps, on the host: bit u of word v of
    /// face f of map m (page_mask.h) says that a receiver lies in that cell; valid until the next.
    View<const uint32_t> projectionMaps() const;
    /// Returns what the last frame's rays were asked by and traced through, on the host, for the
    /// error analysis; valid until the next.
    /// @param options as the frame used
    RayInputs rayInputs(const RayOptions& options) const;
    /// Returns the bytes of the DAG that rays of this backend read: the words, or the wide form
    /// where rays are traced through that (dag.h).
    uint64_t dagBytes() const;
    /// Returns the bytes that exact rays read besides the DAG and the triangles; 0 before the first
    /// frame of RayKind::kExact.
    uint64_t exactBytes() const;

private:
    struct State;
    explicit FrameRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
