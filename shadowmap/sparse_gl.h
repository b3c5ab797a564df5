// SPDX-License-Identifier: Apache-2.0
// Shadow maps in sparse textures, as in the paper: one layer per face, drawn by layered rendering,
// with memory that the driver commits page by page for the marked pages. On devices that were seen
// to draw into such layers wrongly, fragments write them by atomics instead.
//
// Faces are in arrays of textures by size, a power of two, so that little address space is wasted;
// an array has at most kMaxArrayBytes of it. A size has one array that grows, by half at least, and
// full ones before it; an array that was not used for a while is dropped. A face keeps its layer
// while pages of it are kept from build to build.
#pragma once

#include "gl/sparse_texture.h"
#include "shadowmap/rasterize_gl.h"

#include <map>

namespace shadowdag {

constexpr uint32_t kMaxSparseArrays = 16; ///< texture units that every stage has
constexpr uint64_t kMaxArrayBytes = uint64_t(1) << 30;

class GlSparseDrawer final : public GlMapDrawer {
public:
    /// @param pages kSparse or kDenseLayers
    GlSparseDrawer(GlPages pages, const GlContext& context, GlGeometry& geometry);

    void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) override;
    /// Throws Error kResource if faces need more layers than kMaxSparseArrays hold, or if the
    /// driver refuses memory; nothing is kept then.
    bool commit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                View<const uint32_t> pageTable, PageCommits& commits) override;
    void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) override;
    void draw(const RasterView& view, View<const uint32_t> pageTable) override;
    std::vector<uint32_t> downloadDepths() override;
    void warmUp() override;

    /// Returns how many textures there are.
    uint32_t textureCount() const { return uint32_t(arrays_.size()); }
    /// Number of consecutive builds without use after which an array is dropped: arrays that are
    /// used in some frames only are not recreated every time, and cost only addresses meanwhile.
    static constexpr uint32_t kIdleBuilds = 8;

private:
    /// The position of a page of the pool; gather_pages.comp reads it.
    struct Place {
        uint32_t pool, array, layer, x, y;
    };
    struct Array {
        std::unique_ptr<GlSparseArray> texture;
        std::vector<uint8_t> isUsed;      ///< by layer
        std::vector<uint8_t> isCommitted; ///< by layer, row and column of pages
        std::vector<uint8_t> isNeeded;    ///< the same, in this build
        uint32_t layerCount() const { return uint32_t(isUsed.size()); }
        uint32_t pagesPerSide() const;
        uint32_t side = 0, pageTexels = 0;
        uint32_t idleBuilds = 0; ///< consecutive builds without use
    };
    struct Layer {
        uint32_t array, layer;
    };

    void placeAndCommit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                        View<const uint32_t> pageTable, PageCommits& commits);
    uint32_t sideOf(uint32_t faceTexels) const;
    uint32_t mostLayers(uint32_t side) const;
    Array makeArray(uint32_t side, uint32_t layers) const;
    /// Keeps the part of place_ that this build keeps, pages of the table that are not fresh, and
    /// marks their layers, and no others, as used.
    void keepPlaces(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                    View<const uint32_t> pageTable);
    /// Removes array a; no page is kept there.
    void drop(uint32_t a, PageCommits& commits);
    /// Drops arrays that were not used for kIdleBuilds builds. @param wanted layers to be taken, by
    /// side
    void dropIdle(const std::map<uint32_t, uint32_t>& wanted, PageCommits& commits);
    /// Makes `wantedCount` layers of a side free. Arrays keep their positions, except those dropped
    /// to make space, of which none is `wanted`.
    void reserve(uint32_t side, uint32_t wantedCount, const std::map<uint32_t, uint32_t>& wanted,
                 PageCommits& commits);
    /// Replaces array a by one with more layers and the kept pages, which count as neither freed
    /// nor committed.
    void grow(uint32_t a, uint32_t layers, PageCommits& commits);
    Layer takeLayer(uint32_t side);
    void commitNeeded(PageCommits& commits);
    void bindDepths(const GlProgram& program) override;
    size_t pageIndex(const Array& array, uint32_t layer, uint32_t x, uint32_t y) const;

    const GlPages pages_;
    const bool isLayered_;
    GlProgram gather_, clearPages_;
    GlNoTarget target_;
    GlBuffer places_{"gl sparse pages"}, depths_{"gl gathered pages"};
    std::vector<Array> arrays_; ///< kMaxSparseArrays at most
    std::vector<Place> place_;  ///< by page of the pool; array kNoPage: nowhere
    std::vector<GlMap> drawn_;  ///< the maps with their layers
};

} // namespace shadowdag
