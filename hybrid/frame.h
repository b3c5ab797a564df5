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

/// What a frame finds that is measured or rendered by itself.
enum class FrameStart : uint8_t {
    kCold, ///< nothing: every map is drawn
    kWarm, ///< the state of a frame of the same view: maps of what stands still are kept
};

struct FrameOptions {
    uint32_t width = 640, height = 360;
    float undersample = 1.0f; ///< divisor of the required resolution, u2 = 2
    ResolutionRule resolutionRule = ResolutionRule::kSphere; ///< before undersampling
    uint32_t mapsPerLight =
        1; ///< 1..kMaxMapsPerLight: by octaves of the clusters' requests (4SM = 4)
    uint32_t minFaceTexels =
        16; ///< lower limit of the allocated resolution, so that thin walls do not leak light
    uint32_t maxFaceTexels = 2048; ///< upper limit, kMaxFaceTexels at most
    ClusterBounds clusterBounds = ClusterBounds::kTight;
    /// The k of Nk clustering, k x k cells of normals on every face of a cube, at most
    /// kMaxNormalCellsPerEdge; 0: clusters by position alone.
    uint32_t normalClusters = 0;
    /// Shades with each cluster's lights in the order of a curve through space instead of by index;
    /// visibilities stay the same, sums of colours round in another order.
    bool reorderLights = false;
    PairPruning pruning = PairPruning::kFacing;
    PageMarks pageMarks = PageMarks::kLookups; ///< which pages of maps get memory
    ShadowMapOptions maps;
    ShadowMapBias bias; ///< taps: at most maps.taps, whose pages are marked
    RayOptions rays;
    /// A map changes its method only when the other is cheaper by more than the factor 1 + margin;
    /// 0 routes every frame anew. For frames in sequence by one model.
    float routeMargin = 0.0f;
    FrameStart start = FrameStart::kCold; ///< read by renderFrom and measureCosts alone
    /// Makes every beam that is asked for in this frame, whatever it takes, instead of a share; set
    /// by renderFrom for the frame before a warm one.
    bool makeAllBeams = false;
    bool recordPairs = true; ///< keep visibility per pair (not part of the stages' times)
    /// Count the quantities of maps that the model does not read, and what culling skipped
    /// (ShadowMaps::countSkipped), for reports (not part of the times either).
    bool recordQuantities = true;

    bool operator==(const FrameOptions&) const = default;
};

/// The record of one shadow map, that is of the clusters of one light whose requests share an
/// octave, whether it is drawn or traced instead.
struct MapRecord {
    MapQuantities quantities;
    Route route = Route::kRays;
    uint64_t pairCount = 0; ///< exact pairs that it serves (only with recordPairs)
    DirectionalWindow window =
        {}; ///< of a directional light's map; its `texels` are the width of its receivers
    uint32_t heldTexels =
        0; ///< value kept by hysteresis: faceTexels; for directional lights those of the lattice
};

struct FrameCounts {
    uint64_t sampleCount = 0;  ///< pixels that see geometry
    uint64_t clusterCount = 0; ///< unique clusters
    uint64_t clusterLightCount = 0;
    uint64_t prunedClusterLightCount = 0; ///< of these, taken out (PairPruning)
    uint64_t pairCount = 0;               ///< exact pairs
    uint64_t rayCount = 0;
    uint64_t exactRayCount = 0; ///< of these, left to the triangles (RayOptions::believe)
    uint64_t beamRayCount = 0;  ///< exact rays that kept beams answered (RayOptions::beamBytes)
    uint64_t beamMadeCount = 0; ///< beams that the frame made; may depend on the order of threads
    uint64_t moverTestCount =
        0; ///< rays that voxels left lit and that were tested against moving triangles
    /// Ray-traced pairs in (cluster, light) pairs that are completely lit, completely dark, or
    /// neither: those that proofs could decide without dividing clusters (only with recordPairs).
    uint64_t wholeLitPairCount = 0, wholeDarkPairCount = 0, mixedPairCount = 0;
    uint64_t lookupCount = 0;
    uint64_t provenPairCount = 0;  ///< pairs lit by proof: neither a ray nor a lookup
    uint32_t tracedLightCount = 0; ///< lights with a traced map; one may count as mapped as well
    uint32_t mappedLightCount = 0; ///< lights with a drawn map
    uint32_t tracedMapCount = 0;
    uint32_t drawnMapCount = 0;
    uint64_t missingTapCount = 0; ///< PCF taps on pages without memory; 0 unless something is wrong
    ShadowMapCounts maps;
    uint64_t unsplitTriangleCount = 0; ///< large triangles of the G-buffer that did not fit the
                                       ///< list and were drawn by one thread each; CUDA only
    uint64_t listRerunCount = 0;       ///< lists guessed too short and rebuilt (guessLengths)
    HostCopyCounts hostCopies; ///< of the frame proper, before its reports: round trips on CUDA
};

struct FrameResult {
    std::vector<glm::vec3> color;       ///< width * height, linear radiance
    PairList pairs;                     ///< with recordPairs
    std::vector<uint8_t> visibility;    ///< with recordPairs; per pair
    std::vector<Route> pairRoute;       ///< with recordPairs; per pair, the method (kRays
                                        ///< for proofs, which voxels give)
    std::vector<PairServer> pairServer; ///< with recordPairs; per pair
    std::vector<MapRecord> maps;        ///< ascending light, then octave
    StageTimes stages;   ///< of the frame proper: without recording, truth, host copies for reports
    double wallMs = 0.0; ///< from the call to the end of the last stage, by the wall clock, with
                         ///< what no stage counts, such as waits between them
    StageTimes counting; ///< of the quantities that models count (kCountNames), read or not; with
                         ///< recordQuantities
    FrameCounts counts;
};

/// Returns the time of the stages whose work depends on the routes, milliseconds.
double servingMs(const StageTimes& stages);

/// Returns the source of every record: rays, or the index in FrameRenderer::shadowMaps(), which has
/// those that are drawn, in order.
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

    /// Returns another renderer of the same world and DAG that shares its data of both with this
    /// one (batches, levels of detail, the DAG as rays read it, moving geometry) and has its own
    /// results of frames. One call of worldChanged applies to all that share. Not thread safe.
    std::unique_ptr<FrameRenderer> shareScene() const;

    /// Applies World::setTime, which moved instances (refits batches) or lights. Returns the times
    /// of "batch boxes", "batch hierarchy", and "scene update", which is positions and lights with
    /// their hierarchy.
    /// @param ofLevels receives the part of the first two for levels of detail, for renderers that
    /// draw them; null: it is included in the result
    /// @param ofRays receives the "scene update" of the moving geometry, for renderers that trace
    /// rays; null: it is included in the result. If no ray was traced since the call before, that
    /// update waits until one is, and belongs to no stage
    StageTimes worldChanged(const std::vector<uint32_t>& movedInstances,
                            StageTimes* ofLevels = nullptr, StageTimes* ofRays = nullptr);

    /// The same without waiting on CUDA, where the frame that follows is queued while the device
    /// still copies: adds the times to `stages`, `ofLevels` and `ofRays` (which may be one), to be
    /// settled by the caller (StageTimes::settle) after the frame.
    void queueWorldChange(const std::vector<uint32_t>& movedInstances, StageTimes& stages,
                          StageTimes& ofLevels, StageTimes& ofRays);

    /// Sets whether frames guess the lengths of their lists from the frame before, so that the host
    /// need not wait for them (cuda/list_length.h); initially on CUDA alone. No result depends on
    /// it except FrameCounts::listRerunCount. @param spare as LengthGuess::forget
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);

    /// Releases the state of earlier frames (hysteresis, kept shadow maps), so that the next frame
    /// depends on its inputs alone, except for FrameCounts::listRerunCount and
    /// unsplitTriangleCount. Beams are released too.
    void reset();

    /// Renders one frame with the routes of `model`. If the model needs costs they must have been
    /// set. Deterministic except for stage times, FrameCounts::listRerunCount (which depends on the
    /// frames before) and unsplitTriangleCount (which depends on the order of threads).
    /// @param beforeStage is called before every stage; an exception from it cancels the frame. The
    /// next frame is then the same as without this one, except that kept maps may be redrawn; until
    /// then the functions below about the last frame have no meaning
    FrameResult render(const Camera& camera, const CostModel& model, const FrameOptions& options,
                       const std::function<void()>& beforeStage = {});

    /// Returns the pairs that render with recordPairs would find, without their visibility;
    /// gbuffer() is then that of this frame, and the state between frames is unchanged.
    PairList listPairs(const Camera& camera, const FrameOptions& options);

    /// Returns the cost of every map of this frame by both methods: of its rays alone, and of its
    /// masks, pages, culling, drawing and lookups alone; where options.start is kWarm, of a map
    /// that is kept from the frame before. Each is measured by itself, then scaled so that the
    /// costs of all maps by one method add up to the frame's time by it (FrameCosts::raysScale,
    /// mapsScale): maps share work that a frame does once, but each map measured alone includes it.
    /// Without static optimization if options.start is kCold; releases the state of earlier frames.
    /// Medians of `repeats`.
    /// @param beforeStage as render() has it
    FrameCosts measureCosts(const Camera& camera, const FrameOptions& options, int repeats = 3,
                            const std::function<void()>& beforeStage = {});

    /// Returns the host G-buffer of the last frame; valid until the next.
    GBufferView gbuffer() const;
    /// Returns the moving geometry for rays, on the host; valid until worldChanged.
    MoverView movers() const;
    /// Returns the triangles for exact rays, on the host; without a hierarchy before the first
    /// frame that tests triangles, or prepareExact().
    ExactView exact() const;
    /// Builds the hierarchy over static triangles that exact rays need, once.
    void prepareExact();
    /// Returns maps of the last frame for the error analysis (FrameResult::pairServer names them);
    /// valid until the next.
    ShadowMapView shadowMaps() const;
    /// Returns the clusters of the last frame and the lights of each, on the host; valid until the
    /// next. A record indexes FrameResult::maps of a frame that was rendered.
    ClusterView clusters() const;
    ClusterLightsView clusterLights() const;
    /// Returns the requested R^2 of every entry of clusterLights(), before undersampling, on the
    /// host; meaningless if the record is kProvenLit; valid until the next frame.
    View<const float> wantedSquared() const;
    /// Returns the projection maps of the last frame's drawn maps, on the host: bit u of word v of
    /// face f of map m (page_mask.h) says that a receiver lies in that cell; valid until the next.
    View<const uint32_t> projectionMaps() const;
    /// Returns the inputs of the last frame's rays, on the host, for the error analysis; valid
    /// until the next.
    /// @param options as the frame used
    RayInputs rayInputs(const RayOptions& options) const;
    /// Returns the bytes of the DAG that rays of this backend read: the words, or the wide form if
    /// rays use that (dag.h).
    uint64_t dagBytes() const;
    /// Returns the bytes that exact rays read besides the DAG: the triangles and what is built over
    /// them; 0 before the first frame that asks triangles.
    uint64_t exactBytes() const;
    /// Returns the bytes of the beams that exact rays keep.
    uint64_t beamBytes() const;
    /// Returns the bytes of Embree's structures for rays by it (TriangleRays::kEmbree); 0 until
    /// they are prepared.
    uint64_t embreeBytes() const;

private:
    struct State;
    explicit FrameRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Renders a frame that begins as options.start says, whatever was rendered before, and returns it.
/// A warm frame is rendered once before; with beams up to 8 times, until all are made. Throws as
/// FrameRenderer::render.
FrameResult renderFrom(FrameRenderer& renderer, const Camera& camera, const CostModel& model,
                       const FrameOptions& options, const std::function<void()>& beforeStage = {});

} // namespace shadowdag
