// SPDX-License-Identifier: Apache-2.0
// Who draws shadow maps elsewhere: ShadowMaps then decides what is needed, where it lies and what
// is drawn into it, and has neither a pool of its own nor a rasterizer.
#pragma once

#include "shadowmap/rasterize.h"
#include "shadowmap/shadow_maps.h"

namespace shadowdag {

/// Pages that were given memory and that lost it.
struct PageCommits {
    uint64_t committedCount = 0, freedCount = 0;
};

/// What stands between the passes of ShadowMaps::build and a pool of pages that they do not reach.
/// Calls come in the order of the functions here, each once a build; all views are the host's.
class MapDrawer {
public:
    virtual ~MapDrawer() = default;

    /// The pool holds so many pages from now on. @param keeps whether pages below keep their texels
    virtual void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) = 0;

    /// Gives the pages of `pageTable` memory, those and no others. Returns true and what that came
    /// to where memory is had from the driver; false where the pool has it.
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
