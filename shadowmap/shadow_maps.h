// SPDX-License-Identifier: Apache-2.0
// Virtual cube shadow maps of one frame: which pages are needed, what memory they get, what is
// drawn into them. Source: Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual
// Shadow Maps for Many Lights, TVCG 2015, sec. IV and V.
#pragma once

#include "cuda/buffer.h"
#include "cuda/list_length.h"
#include "cuda/timer.h"
#include "scenes/batches.h"
#include "shadowmap/page_mask.h"
#include "shadowmap/shadow_map_lookup.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace shadowdag {

constexpr uint32_t kMaxFaceTexels = 8192;

/// One virtual cube map that is to be drawn, axis aligned with the world, centred at the light; or
/// one window of a sun.
struct MapRequest {
    glm::vec3 lightPositionWorld;
    float rangeWorld;
    uint32_t light;      ///< index into the world's lights
    uint32_t faceTexels; ///< allocated resolution of a face, 1..kMaxFaceTexels
    uint32_t octave =
        0; ///< MapQuantities::octave: with the light, who the map is from frame to frame
    SunWindow window = {}; ///< of a sun, whose receivers lie in it with their filters; position and
                           ///< range are then the sphere around the scene
    SpotCone cone = {};    ///< of a spot: only pages, faces and cells within it are needed
};

/// How maps are built. Results of lookups do not depend on the culling.
struct ShadowMapOptions {
    uint32_t pageTexels = 16;          ///< side of a page, a power of two, 16..256
    uint64_t poolBytes = 256ull << 20; ///< budget of the page pool
    uint32_t taps = 4;                 ///< 1, 4 or 9: which page borders the filter needs marked
    MapCulling culling = MapCulling::kCellDepth;
    /// Keeps maps from frame to frame and does not draw again what stood still and is there (SO).
    bool useStaticOptimization = true;
    /// With it: pages and maps that a frame does not need keep their texels while the pool has
    /// room, and give them up least recently needed first; false frees them at once, as the paper
    /// does.
    bool retainsPages = false;
    /// Polygon level of detail: of every instance the coarsest level is drawn whose error is below
    /// this many texels of the map (PolygonLevelsView); 0: full detail. Above 0 the batches must
    /// have levels. Lookups then answer for simplified surfaces, unlike with any other option here,
    /// and forgive by themselves what a receiver's own level may stand above it (lookupVisibility).
    float lodTexels = 0.0f;
    bool useAtomicRasterizer =
        false; ///< CPU only: draw by the one text instead of the CPU's own kernel (same bits)

    bool operator==(const ShadowMapOptions&) const = default;
};

/// The stages of ShadowMaps::build, in their order. "page masks": cluster boxes projected on faces,
/// for pages, projection maps and depths. "page commit": which map and page of the last frame is
/// which, and memory for what is new. "page clear": of that memory. "geometry copy": to the device,
/// CUDA only, and not of inputs that are there. "culling masks": depths of blocks of cells; with
/// static optimization also what is drawn already. "culling query": which batches each map reaches,
/// by the hierarchy. "culling tests": those against face masks, projection maps and depths, and the
/// list of draws. "rasterization": drawing it.
inline constexpr const char* kShadowMapStages[] = {
    "page masks",    "page commit",   "page clear",    "geometry copy",
    "culling masks", "culling query", "culling tests", "rasterization"};

/// Where the page tables of a frame's maps stand, one after the other.
struct MapLayout {
    std::vector<ShadowMapInfo> maps;
    uint64_t maskWordCount = 0; ///< 32 page-table entries a word; a word belongs to one map
};

/// Returns the maps of the requests, every face side divided by `divisor` >= 1 (1 texel at least).
/// Throws Error kResource when the page tables exceed what 32 bits index.
MapLayout layOutMaps(const std::vector<MapRequest>& requests, uint32_t pageTexels,
                     double divisor = 1.0);

/// What building the maps of a frame counted.
struct ShadowMapCounts {
    uint64_t pageCount = 0;        ///< pages with memory
    uint64_t pagesWantedCount = 0; ///< before degrading; more than fit means that the pool was full
    uint64_t pagesRefusedCount =
        0; ///< did not fit even at one texel a face: lookups there are dark and counted
    uint64_t texelCount = 0;     ///< pageCount * pageTexels^2
    uint64_t batchFaceCount = 0; ///< (batch, face) pairs drawn
    uint64_t batchFaceSphereCount =
        0; ///< the same by sphere x six faces, no masks: the baseline of culling
    uint64_t triangleDrawCount = 0;    ///< triangles of the pairs drawn
    uint64_t triangleSphereCount = 0;  ///< triangles of batches in the sphere times six faces
    uint64_t pagesCommittedCount = 0;  ///< got memory in this build
    uint64_t pagesFreedCount = 0;      ///< had memory after the last build, and no longer
    uint64_t pagesRetainedCount = 0;   ///< have memory but are not needed now
    uint64_t pagesClearedCount = 0;    ///< committed, or emptied because something moved there
    uint64_t keptMapCount = 0;         ///< requests answered by a map of an earlier build
    uint64_t batchFaceKeptCount = 0;   ///< (batch, face) pairs not drawn as they are there already
    uint64_t triangleKeptCount = 0;    ///< triangles of those pairs
    uint64_t mapBytes = 0;             ///< pool pages in use + tables
    uint64_t unsplitTriangleCount = 0; ///< large ones that found no room to be shared out
    uint64_t listRerunCount = 0;       ///< lists guessed too short, and made again (guessLengths)
    float degradeDivisor =
        1.0f; ///< > 1: the pool was full and every resolution was divided by this
};

class MapDrawer;

/// What maps are built from, on the backend: as ShadowMaps::build takes it on the host.
struct MapInputs {
    View<const Box> receiverBoxes;
    View<const MapReceiver> receivers; ///< indices within receiverBoxes and the requests
    TriangleView geometry;
    BatchView batches; ///< with their hierarchy
};

/// Builds and holds the shadow maps of one frame on one backend.
class ShadowMaps {
public:
    /// @param drawer draws and holds the pool in place of the passes of `backend`, which must be
    /// the CPU's; view() is then without depths. Outlives it; null: none
    explicit ShadowMaps(Backend backend, MapDrawer* drawer = nullptr);
    ~ShadowMaps();

    /// Marks pages, allocates them, culls batches and draws depth. All integers are deterministic;
    /// with static optimization they depend on the builds since the last forget() as well, but no
    /// lookup does: it answers as if everything had been redrawn.
    /// When the pool is too small, face resolutions are divided by a common divisor in steps of
    /// sqrt(2) until it fits, which counts() says; pages that do not fit even then get no memory
    /// and are counted. Replaces the maps of the last frame. Empty inputs are valid: no requests,
    /// receivers or geometry gives maps that hold nothing. Throws Error kUsage for a resolution,
    /// page size, range, position, light or receiver index out of bounds.
    /// @param requests the maps; @param receiverBoxes world boxes; @param receivers which box reads
    /// which map
    /// @param geometry,batches the same positions, on the host; the CPU reads them in place, CUDA
    /// copies them every time
    /// @param stages receives the times of kShadowMapStages
    /// @param movedBatches for static optimization: the batches whose vertices changed since the
    /// last build, in any order, repeated or not; those whose box changed need not be named
    ///
    /// Static optimization: a map is the same from build to build while light, position, range and
    /// face resolution are (the octave is not asked: what a light's map holds follows from these);
    /// all else it forgets: any option changed, another number of batches, a build without it, and
    /// a pool too small even at one texel a face. A pool that is full divides every resolution, so
    /// all maps are other ones whenever the divisor changes: a pool that hardly suffices saves
    /// little. Retained pages never cause that: they are given up first.
    void build(const std::vector<MapRequest>& requests, const std::vector<Box>& receiverBoxes,
               const std::vector<MapReceiver>& receivers, const TriangleView& geometry,
               const BatchView& batches, const ShadowMapOptions& options, StageTimes& stages,
               View<const uint32_t> movedBatches = {});

    /// The same of inputs that are on the backend already: nothing is copied there that did not
    /// change. @param hostBatches the same batches on the host, by which motion is noted
    /// @param stages on CUDA as yet unsettled (StageTimes)
    void build(const std::vector<MapRequest>& requests, const MapInputs& inputs,
               const BatchView& hostBatches, const ShadowMapOptions& options, StageTimes& stages,
               View<const uint32_t> movedBatches = {});

    /// Says whether builds guess the lengths of their lists by those of the build before, so that
    /// the host need not wait for them (list_length.h); at first on CUDA alone. What is built is
    /// the same. @param spare as LengthGuess::forget
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);

    /// Gives up what static optimization keeps, so that the next build depends on its inputs alone.
    /// Needed before another geometry is passed.
    void forget();

    /// Returns what lookups need; valid until the next build.
    ShadowMapView view() const;
    /// Returns the projection maps of the requests' maps, kProjectionWordsPerMap words each, as
    /// PageMaskView has them; valid until the next build.
    View<const uint32_t> projectionMaps() const;
    /// Returns what the last build counted. What culling counted is fetched from the backend when
    /// one of these three is first called: a round trip on CUDA, which frames leave to their
    /// reports.
    const ShadowMapCounts& counts() const;
    /// Returns pages with memory and triangles drawn of each request: what a cost model may learn
    /// from.
    const std::vector<uint32_t>& pagesPerMap() const;
    const std::vector<uint32_t>& trianglesPerMap() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
