// SPDX-License-Identifier: Apache-2.0
// Who draws shadow maps elsewhere: ShadowMaps then decides what is needed, where it lies and what
// is drawn into it, and has neither a pool of its own nor a rasterizer.
#pragma once

#include "shadowmap/rasterize.h"
#include "shadowmap/shadow_maps.h"

namespace shadowdag {

/// What stands between the passes of ShadowMaps::build and a pool of pages that they do not reach.
/// Calls come in the order of the functions here, each once a build.
class MapDrawer {
public:
    virtual ~MapDrawer() = default;

    /// The pool holds so many pages from now on. @param keeps whether pages below keep their texels
    virtual void makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) = 0;

    /// Empties pages. @param freshEntries entries of `pageTable`, on the host
    virtual void clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) = 0;

    /// Draws, as rasterizeTriangles does; returns when it is done.
    /// @param view without depths, its views on the host @param pageTable of all pages, not only of
    /// those that are drawn into
    virtual void draw(const RasterView& view, View<const uint32_t> pageTable) = 0;
};

} // namespace shadowdag
