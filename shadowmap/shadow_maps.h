// SPDX-License-Identifier: Apache-2.0
// Virtual cube shadow maps of one frame: finds the needed pages, allocates them and draws into
// them. Source: Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual Shadow Maps
// for Many Lights, TVCG 2015, sec. IV and V.
#pragma once

#include "cuda/buffer.h"
#include "cuda/list_length.h"
#include "cuda/timer.h"
#include "scenes/batches.h"
#include "shadowmap/lookup_pages.h"
#include "shadowmap/page_mask.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace shadowdag {

constexpr uint32_t kMaxFaceTexels = 8192;

/// A request for one virtual cube map, axis aligned with the world, centred at the light, or for
/// one window of a directional light.
struct MapRequest {
    glm::vec3 lightPositionWorld;
    float rangeWorld;
    uint32_t light;      ///< index into the world's lights
    uint32_t faceTexels; ///< allocated resolution of a face, 1..kMaxFaceTexels
    uint32_t octave =
        0; ///< MapQuantities::octave: with the light, the map's identity between frames
    DirectionalWindow window =
        {}; ///< of a directional light, whose receivers lie in it with their filters; position and
            ///< range are then the sphere around the scene
    SpotCone cone = {}; ///< of a spot light: only pages, faces and cells within it are needed
};

/// How maps are built. Results of lookups do not depend on the culling.
struct ShadowMapOptions {
    uint32_t pageTexels = 16; ///< side of a page, a power of two, 16..256
    uint64_t poolBytes =
        256ull << 20;  ///< budget of the page pool; memory taken for a larger one is kept
    uint32_t taps = 4; ///< 1, 4 or 9: the filter, which decides what page borders are marked
    MapCulling culling = MapCulling::kCellDepth;
    /// Keeps maps from frame to frame and does not redraw static batches that are drawn already
    /// (SO).
    bool useStaticOptimization = true;
    /// With it: pages and maps that a frame does not need keep their texels while the pool has
    /// space, and are evicted least recently needed first; false frees them at once, as the paper
    /// does.
    bool retainsPages = false;
    /// Polygon level of detail: of every instance the coarsest level is drawn whose error is below
    /// this many texels of the map (PolygonLevelsView); 0: full detail. Above 0 the batches must
    /// have levels. Lookups then return the visibility of simplified surfaces, unlike with any
    /// other option here, and compensate for the distance of a receiver's own level from it
    /// (lookupVisibility).
    float lodTexels = 0.0f;
    bool useAtomicRasterizer =
        false; ///< CPU only: draw triangle by triangle instead of face by face (same bits)

    bool operator==(const ShadowMapOptions&) const = default;
};

/// The stages of ShadowMaps::build, in their order. "page masks": the pages that lookups read
/// (PageMarker), and cluster boxes projected on faces, for projection maps and depths. "page
/// commit": the correspondence of maps and pages to those of the last frame, and memory for new
/// pages. "page clear": of that memory, unless "rasterization" clears a face's new pages before it
/// draws there, as on the CPU. "geometry copy": to the device, CUDA only, and only of inputs that
/// are not there. "culling masks": depths of blocks of cells; with static optimization also the
/// drawn depths. "culling query": the batches that each map reaches, by the hierarchy; with guessed
/// lengths, unless levels of detail are drawn, before "page commit". "culling tests": those batches
/// against face masks, projection maps and depths, and the list of draws. "rasterization": drawing
/// it.
inline constexpr const char* kShadowMapStages[] = {
    "page masks",    "page commit",   "page clear",    "geometry copy",
    "culling masks", "culling query", "culling tests", "rasterization"};

/// The positions of the page tables of a frame's maps, one after the other.
struct MapLayout {
    std::vector<ShadowMapInfo> maps;
    uint64_t maskWordCount = 0; ///< 32 page-table entries a word; a word belongs to one map
};

/// Returns the maps of the requests, every face side divided by `divisor` >= 1 (1 texel at least).
/// Throws Error kResource when the page tables exceed what 32 bits index.
MapLayout layOutMaps(const std::vector<MapRequest>& requests, uint32_t pageTexels,
                     double divisor = 1.0);

/// Counts of building the maps of a frame. (*): with static optimization 0 before countSkipped.
struct ShadowMapCounts {
    uint64_t pageCount = 0;        ///< pages with memory
    uint64_t pagesWantedCount = 0; ///< before degrading; more than the pool holds if it was full
    uint64_t pagesRefusedCount =
        0; ///< did not fit even at one texel a face: lookups there are dark and counted
    uint64_t texelCount = 0;     ///< pageCount * pageTexels^2
    uint64_t batchFaceCount = 0; ///< (batch, face) pairs drawn
    uint64_t batchFaceSphereCount =
        0; ///< the same with six faces per sphere and no masks: the baseline of culling (*)
    uint64_t triangleDrawCount = 0;   ///< triangles of the pairs drawn
    uint64_t triangleSphereCount = 0; ///< triangles of batches in the sphere times six faces (*)
    uint64_t pagesCommittedCount = 0; ///< allocated in this build
    uint64_t pagesFreedCount = 0;     ///< freed in this build
    uint64_t pagesRetainedCount = 0;  ///< have memory but are not needed now
    uint64_t pagesClearedCount = 0;   ///< committed, or emptied because something moved there
    uint64_t keptMapCount = 0;        ///< requests fulfilled by a map of an earlier build
    uint64_t batchFaceKeptCount =
        0; ///< (batch, face) pairs not drawn because they are drawn already (*)
    uint64_t triangleKeptCount = 0;    ///< triangles of those pairs (*)
    uint64_t mapBytes = 0;             ///< pool pages in use + tables
    uint64_t unsplitTriangleCount = 0; ///< large triangles for which the list had no space
    uint64_t listRerunCount = 0;       ///< lists guessed too short and rebuilt (guessLengths)
    float degradeDivisor =
        1.0f; ///< > 1: the pool was full and every resolution was divided by this
};

class MapDrawer;

/// The input of the maps, on the backend: as ShadowMaps::build takes it on the host, and what
/// marks its pages.
struct MapInputs {
    View<const Box> receiverBoxes;
    View<const MapReceiver> receivers; ///< indices within receiverBoxes and the requests
    TriangleView geometry;
    BatchView batches;       ///< with their hierarchy
    const PageMarker& pages; ///< marks those of the receivers
    /// Whether build() is told of all moved batches; if not, it compares the boxes of all.
    bool areMovedNamed = false;
};

/// Builds and holds the shadow maps of one frame on one backend.
class ShadowMaps {
public:
    /// @param drawer draws and holds the pool instead of the passes of `backend`, which must be the
    /// CPU's; view() is then without depths. Outlives it; null: none
    explicit ShadowMaps(Backend backend, MapDrawer* drawer = nullptr);
    ~ShadowMaps();

    /// Marks the pages that the receivers' boxes cover (BoxPageMarker), allocates them, culls
    /// batches and draws depth. All integers are deterministic; with static optimization they
    /// depend on the builds since the last forget() as well, but no lookup does: its result is as
    /// if everything had been redrawn. If the pool is too small, face resolutions are divided by a
    /// common divisor in steps of sqrt(2) until it fits, and counts() reports it; pages that do not
    /// fit even then get no memory and are counted. Replaces the maps of the last frame. Empty
    /// inputs are valid: no requests, receivers or geometry gives empty maps. Throws Error kUsage
    /// for a resolution, page size, range, position, light or receiver index out of bounds.
    /// @param requests the maps; @param receiverBoxes world boxes; @param receivers pairs of a box
    /// and the map that it reads
    /// @param geometry,batches the same positions, on the host; the CPU reads them in place, CUDA
    /// copies them every time
    /// @param stages receives the times of kShadowMapStages
    /// @param movedBatches for static optimization: the batches whose vertices changed since the
    /// last build, in any order, repeated or not; those whose box changed need not be named
    ///
    /// Static optimization: a map is the same from build to build while light, position, range and
    /// face resolution are (the octave is not compared, because these determine the content). All
    /// maps are released by any changed option, another number of batches, a build without it, and
    /// a pool too small even at one texel per face. A full pool divides every resolution, so all
    /// maps change whenever the divisor changes: a pool that is almost too small saves little.
    /// Retained pages never cause that: they are evicted first.
    void build(const std::vector<MapRequest>& requests, const std::vector<Box>& receiverBoxes,
               const std::vector<MapReceiver>& receivers, const TriangleView& geometry,
               const BatchView& batches, const ShadowMapOptions& options, StageTimes& stages,
               View<const uint32_t> movedBatches = {});

    /// The same with inputs that are on the backend already: only changes are copied there. The
    /// pages are those of inputs.pages, which must lie within the receivers' boxes: culling keeps
    /// what boxes may need.
    /// @param hostBatches the same batches on the host
    /// @param stages on CUDA not yet settled (StageTimes)
    /// @param movedBatches as above; with inputs.areMovedNamed those whose box changed as well
    void build(const std::vector<MapRequest>& requests, const MapInputs& inputs,
               const BatchView& hostBatches, const ShadowMapOptions& options, StageTimes& stages,
               View<const uint32_t> movedBatches = {});

    /// Sets whether builds guess the lengths of their lists from the build before, so that the host
    /// need not wait for them (list_length.h); initially on CUDA alone. The maps are the same.
    /// @param spare as LengthGuess::forget
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);

    /// Releases what static optimization keeps, so that the next build depends on its inputs alone.
    /// Needed before another geometry is passed.
    void forget();

    /// Returns the input of lookups; valid until the next build or forget().
    ShadowMapView view() const;
    /// Returns the projection maps of the requests' maps, kProjectionWordsPerMap words each, as
    /// CullMaskView has them; valid until the next build.
    View<const uint32_t> projectionMaps() const;
    /// Returns the counts of the last build. Those of culling are fetched from the backend at the
    /// first call of one of these three: a round trip on CUDA, which frames leave to their reports.
    const ShadowMapCounts& counts() const;
    /// Adds to counts() what the last build left out: with static optimization culling tests
    /// nothing for faces that are complete, so these counts take its tests of everything once more.
    /// To be called before the inputs of that build change or the maps are forgotten.
    void countSkipped();
    /// Returns the pages with memory and the triangles drawn of each request, from which a cost
    /// model may learn.
    const std::vector<uint32_t>& pagesPerMap() const;
    const std::vector<uint32_t>& trianglesPerMap() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
