// SPDX-License-Identifier: Apache-2.0
// An external drawer of shadow maps. ShadowMaps then decides which pages are needed, where they are
// and what is drawn into them, but has neither a pool nor a rasterizer.
#pragma once

#include "shadowmap/rasterize.h"
#include "shadowmap/shadow_maps.h"

namespace shadowdag {

/// Pages that were allocated and freed.
struct PageCommits {
    uint64_t committedCount = 0, freedCount = 0;
};

/// The interface between the passes of ShadowMaps::build and a pool of pages that they cannot
/// access. The functions are called in the order of declaration, each once per build; all views are
/// the host's.
class MapDrawer {
public:
    virtual ~MapDrawer() = default;

    /// The pool has so many pages from now on. @param keeps whether existing pages keep their
    /// texels
    virtual void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) = 0;

    /// Allocates exactly the pages of `pageTable`. Returns true and the counts if the driver
    /// allocates memory; false if the pool has it.
    /// @param freshEntries entries whose texels are not those of an earlier build
    virtual bool commit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                        View<const uint32_t> pageTable, PageCommits& commits) = 0;

    /// Empties the pages of freshEntries.
    virtual void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) = 0;

    /// Draws, as rasterizeTriangles does; returns when it is done.
    /// @param view without depths @param pageTable of all pages, not only of those that are drawn
    /// into
    virtual void draw(const RasterView& view, View<const uint32_t> pageTable) = 0;
};

} // namespace shadowdag
