// SPDX-License-Identifier: Apache-2.0
// Shadow maps in OpenGL: drawn by the hardware's rasterizer, one multi-draw-indirect call of all
// faces of all maps, into a pool of pages like the processor's (an atlas by page table): a fragment
// finds the page of its virtual texel and keeps the greatest depth there.
//
// Coverage is the hardware's: corners snap to 1/256 texel and an edge's texel centre belongs to one
// side, where the processor counts it to both; depths are the processor's own formula (double), so
// a texel that the same triangle wins has the same bits.
#pragma once

#include "gl/context.h"
#include "gl/draw.h"
#include "scenes/geometry_gl.h"
#include "shadowmap/map_drawer.h"

#include <memory>

namespace shadowdag {

/// The texts of this room.
GlslTexts shadowmapGlsl();

/// A map as shadowmap/cube_face.glsl takes it apart.
struct alignas(32) GlMap {
    glm::vec3 lightPositionWorld;
    float rangeWorld;
    uint32_t faceTexels, facePages, pageTableStart, isSun;
    uint32_t layers[4] = {}, spare[4] = {};
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

/// Draws and keeps the pool. The context is current in every call, the destructor too.
class GlMapDrawer : public MapDrawer {
public:
    /// @param geometry what is drawn; outlives it
    explicit GlMapDrawer(const GlContext& context, GlGeometry& geometry);

    void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) override;
    void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) override;
    void draw(const RasterView& view, View<const uint32_t> pageTable) override;

    /// Binds maps, page table and pool for lookups (shadowmap/lookup.glsl with the bindings of
    /// lookupDefines) and sets its uniforms.
    void bindLookup(const GlProgram& program, const ShadowMapBias& bias);
    /// Returns the pool's depths, as ShadowMapView has them.
    std::vector<uint32_t> downloadDepths() const { return depths_.download<uint32_t>(); }

    /// Bindings of bindLookup.
    static constexpr uint32_t kMapsBinding = 1, kPageTableBinding = 5, kDepthsBinding = 6;

private:
    const GlContext& context_;
    GlGeometry& geometry_;
    GlProgram rasterize_, clearPages_;
    GlCommands commands_{"gl shadow map"};
    GlNoTarget target_;
    GlBuffer maps_{"gl shadow maps"}, pageTable_{"gl page table"}, openTable_{"gl open page table"},
        depths_{"gl page pool"}, targets_{"gl draw targets"}, pages_{"gl fresh pages"};
    uint32_t pageTexelsLog2_ = 0;
};

/// Returns the definitions that lookup.glsl is compiled with to read what GlMapDrawer binds.
GlDefines lookupDefines();

/// Returns the definitions of gl/numerics.glsl for a device.
GlDefines numericDefines(const GlInfo& info);

} // namespace shadowdag
