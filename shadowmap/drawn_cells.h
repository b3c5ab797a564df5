// SPDX-License-Identifier: Apache-2.0
// The depth to which each projection-map cell of a kept map has been drawn, which decides which
// batches need not be drawn again. Source: Olsson et al. 2015, sec. V-D (static optimization).
// There a batch is tested against the last frame's projection map and a clear mask; here both are
// one depth per cell, which also covers frames before the last.
//
// V(c), the drawn depth of cell c: every static batch over the cell that is no deeper than V(c) has
// been drawn into all texels of the cell that have memory. N(c), the needed depth: the depth that
// receivers under the cell need this frame. A batch at depth d that did not move is drawn into a
// face iff one of its cells has V(c) < d <= N(c); one that moved iff one has d <= N(c). It is drawn
// into the open pages: those with a cell that has V(c) < N(c), or under something that moved.
// A face without a cell that has V(c) < N(c) is closed: nothing but what moved is drawn into it.
// Drawing is idempotent, so afterwards V(c) is the greater of both in every cell. V(c) becomes 0 if
// a page gets memory; it falls below a batch's depth if the batch moved over the cell and was not
// drawn. The six conditions of the paper: (1) a change of the light or (6) of the resolution makes
// another map; (2) moved batches ignore V; (3) V records what was drawn; (4) pages under the old
// place of a moved batch release their memory (kept_pages.h) and (5) pages with new memory reset V.
#pragma once

#include "cuda/pass.h"
#include "shadowmap/kept_pages.h"

namespace shadowdag {

/// The drawn depths of kept maps. A slot belongs to a map for as long as it is kept.
/// cells: kCellsPerMap a slot, depthBits, 0 for nothing; depths: kFaceCount a slot, the greatest
/// that a face was ever drawn to.
struct DrawnView {
    View<uint32_t> cells;
    View<uint32_t> depths;
    View<const uint32_t> slots; ///< mapCount
};

/// Returns needed depth `bits` for a cell of a batch, rounded up to the next eighth of an octave
/// when it exceeds the drawn depth. A camera that moves backwards slowly then redraws a batch once
/// in a while, not in every frame.
SDAG_HD inline uint32_t roundedNeed(uint32_t bits, uint32_t drawn) {
    constexpr uint32_t kStep = 1u << 20;
    return bits <= drawn ? bits : (bits + (kStep - 1)) & ~(kStep - 1);
}

/// Empties cell i % kCellsPerMap of fresh slot i / kCellsPerMap.
struct EmptySlots {
    View<const uint32_t> freshSlots;
    DrawnView drawn;

    size_t itemCount() const { return freshSlots.count * kCellsPerMap; }
    size_t grain() const { return kCellsPerMap; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t slot = freshSlots[i / kCellsPerMap], cell = uint32_t(i % kCellsPerMap);
        drawn.cells[slot * kCellsPerMap + cell] = 0;
        if (cell < kFaceCount)
            drawn.depths[slot * kFaceCount + cell] = 0;
    }
};

/// Returns the cells that hold the centre of a texel of a page: rectangles of boxes and rays
/// through texel centres agree on these.
SDAG_HD inline CellRect cellsOfPage(const ShadowMapInfo& map, uint32_t x, uint32_t y,
                                    uint32_t pageTexelsLog2) {
    const auto cellOf = [&](uint32_t texel) {
        return faceCell(faceCellCentre(int32_t(texel), map.faceTexels), kProjectionMapSize);
    };
    const auto last = [&](uint32_t page) {
        return glm::min((page + 1) << pageTexelsLog2, map.faceTexels) - 1;
    };
    return {cellOf(x << pageTexelsLog2), cellOf(last(x)), cellOf(y << pageTexelsLog2),
            cellOf(last(y))};
}

/// A page of a map: its face, and its cells.
struct PageOfMap {
    uint32_t face;
    CellRect cells;

    /// @param entry of the page table
    SDAG_HD PageOfMap(const ShadowMapInfo& map, uint32_t entry, uint32_t pageTexelsLog2) {
        const uint32_t inMap = entry - map.pageTableStart;
        face = inMap / map.facePages / map.facePages;
        cells = cellsOfPage(map, inMap % map.facePages, inMap / map.facePages % map.facePages,
                            pageTexelsLog2);
    }
};

/// Resets the drawn depth of the cells of fresh page i.
struct ResetCells {
    View<const ShadowMapInfo> maps;
    FreshPages fresh;
    DrawnView drawn;
    uint32_t pageTexelsLog2;

    size_t itemCount() const { return fresh.count(); }
    SDAG_HD void operator()(size_t i) const { reset(i, 0, kProjectionMapSize); }
    /// Resets the cells of rows [row, rowEnd) of those that fresh page i has.
    SDAG_HD void reset(size_t i, uint32_t row, uint32_t rowEnd) const {
        const uint32_t entry = fresh.entries[i];
        const uint32_t mapIndex = mapOfWord(maps, entry / 32);
        const PageOfMap page(maps[mapIndex], entry, pageTexelsLog2);
        const uint32_t end = glm::min(page.cells.v0 + rowEnd, page.cells.v1 + 1);
        for (uint32_t v = page.cells.v0 + row; v < end; ++v)
            for (uint32_t u = page.cells.u0; u <= page.cells.u1; ++u)
                atomicMinRelaxed(&drawn.cells[cellIndex(drawn.slots[mapIndex], page.face, u, v)],
                                 0u);
    }
};

void launchPass(CudaTag, const ResetCells& work); ///< by ResetRow

/// The same by row and page, as a page may have a thousand cells: lanes take neighbouring pages and
/// one row.
struct ResetRow {
    ResetCells work;

    SDAG_HD size_t itemCount() const { return work.fresh.count() * kProjectionMapSize; }
    SDAG_HD void operator()(size_t i) const {
        const size_t count = work.fresh.count();
        const uint32_t row = uint32_t(i / count);
        work.reset(i % count, row, row + 1);
    }
};

/// Writes the needed depths of block i's cells, rounded up, and the greatest need of its cells,
/// with and without those that are drawn, and marks its face if there are such.
struct PrepareBlock {
    CullMaskView masks; ///< cells and blocks are read with kCellDepth and written always
    MapCulling culling;
    DrawnView drawn;
    View<uint32_t> openBlocks; ///< greatest need of cells that are not drawn as deep
    View<uint32_t> openFaces;  ///< per map, starts at 0: bit f, face f has such cells

    size_t itemCount() const { return openBlocks.count; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t face = uint32_t(i) / kBlocksPerFace, block = uint32_t(i) % kBlocksPerFace;
        const uint32_t mapIndex = face / kFaceCount;
        const uint32_t u0 = (block % kBlocksPerSide) << kBlockCellsLog2;
        const uint32_t v0 = (block / kBlocksPerSide) << kBlockCellsLog2;
        const uint32_t least = culling >= MapCulling::kCellDepth ? masks.blocks[i] : 0;
        uint32_t greatest = 0, open = 0;
        for (uint32_t v = v0; v < v0 + (1u << kBlockCellsLog2); ++v)
            for (uint32_t u = u0; u < u0 + (1u << kBlockCellsLog2); ++u) {
                uint32_t& cell = masks.cells[cellIndex(0, face, u, v)];
                const uint32_t before =
                    drawn.cells[cellIndex(drawn.slots[mapIndex], face % kFaceCount, u, v)];
                cell = roundedNeed(needOf(mapIndex, face, u, v, glm::max(cell, least)), before);
                greatest = glm::max(greatest, cell);
                if (cell > before)
                    open = glm::max(open, cell);
            }
        masks.blocks[i] = greatest;
        openBlocks[i] = open;
        if (open != 0)
            atomicOrRelaxed(&openFaces[mapIndex], 1u << face % kFaceCount);
    }

private:
    /// The depth of a cell that coarser kinds of culling need.
    SDAG_HD uint32_t needOf(uint32_t mapIndex, uint32_t face, uint32_t u, uint32_t v,
                            uint32_t cell) const {
        constexpr uint32_t kEverything = 0x7f700000u;
        if (culling >= MapCulling::kCellDepth)
            return cell;
        if (culling == MapCulling::kSphere)
            return kEverything;
        if (!(masks.faces[mapIndex] >> face % kFaceCount & 1u))
            return 0;
        if (culling == MapCulling::kFaceMask)
            return kEverything;
        if (!(masks.projection[face * kProjectionMapSize + v] >> u & 1u))
            return 0;
        return culling == MapCulling::kProjectionMap ? kEverything
                                                     : depthBits(bitsFloat(masks.depths[face]));
    }
};

/// Lowers the drawn depth of the cells under the new place of box i % boxes.count in map i /
/// boxes.count, unless it is drawn there this frame.
struct LowerCells {
    View<const ShadowMapInfo> maps;
    View<const Box> boxesWorld; ///< of moved batches, at their new place
    CellDepthView needed;       ///< of the first maps; the others need nothing
    DrawnView drawn;

    size_t itemCount() const { return maps.count * boxesWorld.count; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t mapIndex = uint32_t(i / boxesWorld.count);
        const ShadowMapInfo& map = maps[mapIndex];
        const Box& box = boxesWorld[i % boxesWorld.count];
        if (!reachesMap(map, box))
            return;
        const uint32_t slot = drawn.slots[mapIndex];
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            FaceRect rect;
            if (!projectOnMap(map, box, face, 0.0f, rect))
                continue;
            const uint32_t bits = depthBits(rect.depthMin);
            const CellRect cells = cellsOf(rect);
            if (bits > drawn.depths[slot * kFaceCount + face] ||
                ((mapIndex + 1) * size_t(kCellsPerMap) <= needed.cells.count &&
                 needed.reaches(mapIndex, face, cells, bits)))
                continue;
            for (uint32_t v = cells.v0; v <= cells.v1; ++v)
                for (uint32_t u = cells.u0; u <= cells.u1; ++u)
                    atomicMinRelaxed(&drawn.cells[cellIndex(slot, face, u, v)], bits - 1);
        }
    }
};

/// Writes row i of the cells that are open, of all maps: bit u is set where cell u is needed deeper
/// than it has been drawn.
struct ListOpenCells {
    View<const uint32_t> cells; ///< needed, rounded
    DrawnView drawn;
    View<uint32_t> openRows; ///< kProjectionWordsPerMap a map

    size_t itemCount() const { return openRows.count; }
    size_t grain() const { return 256; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t row = 0;
        for (uint32_t u = 0; u < kProjectionMapSize; ++u)
            row |= uint32_t(isOpen(i, u)) << u;
        openRows[i] = row;
    }
    SDAG_HD bool isOpen(size_t i, uint32_t u) const {
        const size_t face = i / kProjectionMapSize;
        const size_t inMap = i * kProjectionMapSize % kCellsPerMap + u;
        return cells[i * kProjectionMapSize + u] >
               drawn.cells[drawn.slots[face / kFaceCount] * size_t(kCellsPerMap) + inMap];
    }
};
void launchPass(CudaTag, const ListOpenCells& work); ///< by warps

struct ListOpenPage;

/// Writes word i of the page table for the rasterizer: without the pages that are complete.
struct ListOpenPages {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> openRows;  ///< of ListOpenCells
    View<const uint32_t> marked;    ///< bits: pages under moved batches; empty: none
    View<const uint32_t> openFaces; ///< of PrepareBlock, where nothing moved; else empty
    View<const uint32_t> pageTable;
    View<uint32_t> openTable;
    uint32_t pageTexelsLog2;

    size_t itemCount() const { return openTable.count / 32; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t mapIndex = mapOfWord(maps, i);
        if (isClosed(mapIndex)) {
            for (uint32_t bit = 0; bit < 32; ++bit)
                openTable[i * 32 + bit] = kNoPage;
            return;
        }
        for (uint32_t bit = 0; bit < 32; ++bit)
            list(mapIndex, i * 32 + bit);
    }
    /// CUDA processes them entry by entry.
    ListOpenPage shortItems() const;
    SDAG_HD void list(uint32_t mapIndex, size_t entry) const {
        const uint32_t page = pageTable[entry];
        const bool isOpen = page != kNoPage && !isClosed(mapIndex) &&
                            ((!marked.empty() && (marked[entry / 32] >> entry % 32 & 1u)) ||
                             hasOpenCell(mapIndex, uint32_t(entry)));
        openTable[entry] = isOpen ? page : kNoPage;
    }

private:
    /// Returns whether it is certain that no page of a map is open.
    SDAG_HD bool isClosed(uint32_t mapIndex) const {
        return !openFaces.empty() && openFaces[mapIndex] == 0 && marked.empty();
    }
    SDAG_HD bool hasOpenCell(uint32_t mapIndex, uint32_t entry) const {
        const PageOfMap page(maps[mapIndex], entry, pageTexelsLog2);
        const uint32_t columns = (~0u >> (31 - page.cells.u1)) & (~0u << page.cells.u0);
        const uint32_t first = mapIndex * kProjectionWordsPerMap + page.face * kProjectionMapSize;
        for (uint32_t v = page.cells.v0; v <= page.cells.v1; ++v)
            if (openRows[first + v] & columns)
                return true;
        return false;
    }
};

/// The same by entry.
struct ListOpenPage {
    ListOpenPages work;

    size_t itemCount() const { return work.openTable.count; }
    SDAG_HD void operator()(size_t i) const { work.list(mapOfWord(work.maps, i / 32), i); }
};
inline ListOpenPage ListOpenPages::shortItems() const {
    return {*this};
}

/// Raises the drawn depths of row i of all needed cells to the depths just drawn.
struct RaiseDrawn {
    View<const uint32_t> cells; ///< needed, rounded
    DrawnView drawn;

    size_t itemCount() const { return cells.count / kProjectionMapSize; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t greatest = 0;
        for (uint32_t u = 0; u < kProjectionMapSize; ++u)
            greatest = glm::max(greatest, raise(i, u));
        if (greatest)
            noteGreatest(i, greatest);
    }
    /// Raises cell u of row i; returns the depth to which it is needed.
    SDAG_HD uint32_t raise(size_t i, uint32_t u) const {
        const size_t from = i * kProjectionMapSize + u;
        uint32_t& cell = drawn.cells[slotOf(i) * size_t(kCellsPerMap) + from % kCellsPerMap];
        cell = glm::max(cell, cells[from]);
        return cells[from];
    }
    /// Raises the depth to which the face of row i was drawn.
    SDAG_HD void noteGreatest(size_t i, uint32_t greatest) const {
        const size_t face = i / kProjectionMapSize % kFaceCount;
        atomicMaxRelaxed(&drawn.depths[slotOf(i) * kFaceCount + face], greatest);
    }

private:
    SDAG_HD uint32_t slotOf(size_t i) const { return drawn.slots[i / kProjectionWordsPerMap]; }
};
void launchPass(CudaTag, const RaiseDrawn& work); ///< by warps

} // namespace shadowdag
