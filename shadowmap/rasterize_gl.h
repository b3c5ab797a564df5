// SPDX-License-Identifier: Apache-2.0
// Shadow maps in OpenGL: drawn by the hardware's rasterizer, one multi-draw-indirect call for all
// faces of all maps, into a pool of pages like that of the CPU (an atlas by page table): a fragment
// finds the page of its virtual texel and keeps the greatest depth there.
//
// Coverage is the hardware's: corners snap to 1/256 texel, and a texel centre on an edge belongs to
// one side, while the CPU counts it to both. Depths use the CPU's formula (double), so a texel won
// by the same triangle has the same bits.
#pragma once

#include "gl/context.h"
#include "gl/draw.h"
#include "scenes/geometry_gl.h"
#include "shadowmap/gl_pages.h"
#include "shadowmap/map_drawer.h"

#include <memory>

namespace shadowdag {

/// The GLSL sources of this folder.
GlslTexts shadowmapGlsl();

/// A map in the format of shadowmap/cube_face.glsl.
struct alignas(32) GlMap {
    glm::vec3 lightPositionWorld;
    float rangeWorld;
    uint32_t faceTexels, facePages, pageTableStart, isDirectional;
    uint32_t faceLayer[kFaceCount] = {}; ///< sparse textures: array << 16 | layer, or kNoPage
    uint32_t spare[2] = {};
    glm::dvec3 u;
    double u0;
    glm::dvec3 v;
    double v0;
    glm::dvec3 w;
    double w0;
};
static_assert(sizeof(GlMap) == 160);

/// Returns a map for shaders.
GlMap glMap(const ShadowMapInfo& map);

/// Shared by OpenGL's drawers: the program, the commands, maps and page table for lookups. The
/// context is current in every call, the destructor too.
class GlMapDrawer : public MapDrawer {
public:
    /// Returns the drawer for a device. @param geometry to draw; outlives it
    static std::unique_ptr<GlMapDrawer> make(GlPages pages, const GlContext& context,
                                             GlGeometry& geometry);

    /// Runs every program once without work: drivers compile programs at first use, which would be
    /// in a frame's time.
    virtual void warmUp();

    /// Binds maps, page table and depths for lookups (shadowmap/lookup.glsl with lookupDefines)
    /// and sets its uniforms.
    void bindLookup(const GlProgram& program, const ShadowMapBias& bias);
    /// Returns the depths of all pages, as ShadowMapView has them.
    virtual std::vector<uint32_t> downloadDepths() = 0;

    /// Bindings of bindLookup.
    static constexpr uint32_t kMapsBinding = 1, kPageTableBinding = 5, kDepthsBinding = 6,
                              kMoreDepthsBinding = 11;

protected:
    GlMapDrawer(GlPages pages, const GlContext& context, GlGeometry& geometry);
    virtual void bindDepths(const GlProgram& program) = 0;
    /// Copies maps, page table, commands and their targets.
    void setMaps(const std::vector<GlMap>& maps, View<const uint32_t> pageTable);
    /// Lists commands and their targets, those of `isIn(map, face)`, after the ones before.
    template <class IsIn> void list(const RasterView& view, const IsIn& isIn) {
        for (const BatchDraw& draw : view.draws) {
            const Batch& batch = view.batches[draw.batch];
            for (uint32_t face = 0; face < kFaceCount; ++face) {
                if (!(draw.faces >> face & 1u) || !isIn(draw.map, face))
                    continue;
                listed_.push_back(
                    {3 * batch.count, 1, 3 * batch.first, uint32_t(listedTargets_.size())});
                listedTargets_.emplace_back(draw.map, face);
            }
        }
    }
    /// Binds everything except depths and sets uniforms for commands into a viewport.
    void prepare(uint32_t viewportTexels);
    /// Draws commands [begin, end), in pieces that GlSlices cuts.
    void drawCommands(uint32_t begin, uint32_t end) const;

    const GlContext& context_;
    GlGeometry& geometry_;
    GlProgram rasterize_;
    GlCommands commands_{"gl shadow map"};
    GlBuffer maps_{"gl shadow maps"}, pageTable_{"gl page table"}, targets_{"gl draw targets"};
    std::vector<GlCommand> listed_;
    std::vector<glm::uvec2> listedTargets_;
    uint32_t pageTexelsLog2_ = 0;
};

/// Keeps the pool as on the CPU: an atlas by page table. It consists of two buffers, because
/// shaders can access at most GlInfo::maxStorageBytes of one (128 MiB on Mesa's llvmpipe).
class GlAtlasDrawer final : public GlMapDrawer {
public:
    GlAtlasDrawer(const GlContext& context, GlGeometry& geometry);

    void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) override;
    bool commit(View<const ShadowMapInfo>, View<const uint32_t>, View<const uint32_t>,
                PageCommits&) override {
        return false;
    }
    void warmUp() override;
    void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) override;
    void draw(const RasterView& view, View<const uint32_t> pageTable) override;
    std::vector<uint32_t> downloadDepths() override;

private:
    void bindDepths(const GlProgram&) override;

    GlProgram clearPages_;
    GlNoTarget target_;
    GlBuffer openTable_{"gl open page table"}, depths_{"gl page pool"},
        moreDepths_{"gl page pool, second part"}, pages_{"gl fresh pages"};
};

/// Returns the definitions that lookup.glsl is compiled with to read what GlMapDrawer binds.
/// @param pages not kAuto
GlDefines lookupDefines(GlPages pages, const GlInfo& info);

/// Returns the number of texels in the first of GlAtlasDrawer's buffers: whole pages of any size.
uint64_t atlasChunkTexels(const GlInfo& info);

/// Returns the definitions of gl/numerics.glsl for a device.
GlDefines numericDefines(const GlInfo& info);

} // namespace shadowdag
