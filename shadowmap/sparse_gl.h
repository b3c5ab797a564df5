// SPDX-License-Identifier: Apache-2.0
// Shadow maps in sparse textures, as the paper has them: a layer a face, drawn by layered
// rendering, with memory that the driver commits page by page where the page masks ask for it.
// Where a device was seen to draw into such layers wrongly, fragments write them by atomics
// instead.
//
// Faces stand in arrays of textures by size, a power of two, so that little address space is
// wasted; an array has at most kMaxArrayBytes of it. A face keeps its layer while pages of it are
// kept from build to build.
#pragma once

#include "gl/sparse_texture.h"
#include "shadowmap/rasterize_gl.h"

namespace shadowdag {

constexpr uint32_t kMaxSparseArrays = 16; ///< what texture units every stage has
constexpr uint64_t kMaxArrayBytes = uint64_t(1) << 30;

class GlSparseDrawer final : public GlMapDrawer {
public:
    /// @param memory kDense with pages of kDensePageTexels: for tests, where there are no sparse
    /// textures
    GlSparseDrawer(const GlContext& context, GlGeometry& geometry,
                   GlSparseArray::Memory memory = GlSparseArray::kSparse);
    static constexpr uint32_t kDensePageTexels = 128;

    void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) override;
    /// Throws Error kResource when faces need more layers than kMaxSparseArrays hold.
    bool commit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                View<const uint32_t> pageTable, PageCommits& commits) override;
    void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) override;
    void draw(const RasterView& view, View<const uint32_t> pageTable) override;
    std::vector<uint32_t> downloadDepths() override;

private:
    /// Where a page of the pool lies; gather_pages.comp takes it apart.
    struct Place {
        uint32_t pool, array, layer, x, y;
    };
    struct Array {
        std::unique_ptr<GlSparseArray> texture;
        std::vector<uint8_t> isUsed;      ///< by layer
        std::vector<uint8_t> isCommitted; ///< by layer, row and column of pages
        std::vector<uint8_t> isNeeded;    ///< the same, in this build
        uint32_t pagesPerSide() const;
        uint32_t side = 0, pageTexels = 0;
    };
    struct Layer {
        uint32_t array, layer;
    };

    uint32_t sideOf(uint32_t faceTexels) const;
    /// @param wantedCount how many layers of that side are still to be taken in this build
    Layer takeLayer(uint32_t side, uint32_t wantedCount);
    void commitNeeded(PageCommits& commits);
    void bindDepths(const GlProgram& program) override;
    size_t pageIndex(const Array& array, uint32_t layer, uint32_t x, uint32_t y) const;

    const GlSparseArray::Memory memory_;
    const bool isLayered_;
    GlProgram gather_, clearPages_;
    GlNoTarget target_;
    GlBuffer places_{"gl sparse pages"}, depths_{"gl gathered pages"};
    std::vector<Array> arrays_;
    std::vector<Place> place_; ///< by page of the pool; array kNoPage: nowhere
    std::vector<GlMap> drawn_; ///< the maps with their layers
};

} // namespace shadowdag
