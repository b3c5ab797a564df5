// SPDX-License-Identifier: Apache-2.0
// The passes over pages and cells that outlive a frame; see kept_pages.h and drawn_cells.h for what
// an item does. All views live on the backend.
#pragma once

#include "cuda/backend.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/kept_pages.h"

namespace shadowdag {

namespace cpu {
void carryPages(const CarryPages& items);
void markUnder(const MarkUnder& items);
void sortOutPages(const SortOutPages& items);
void numberPages(const NumberPages& items);
void assignPages(const AssignPages& items);
void clearPages(const ClearPages& items, size_t pageCount);
void emptySlots(const EmptySlots& items);
void resetCells(const ResetCells& items, size_t pageCount);
void prepareBlocks(const PrepareBlock& items);
void lowerCells(const LowerCells& items);
void listOpenPages(const ListOpenPages& items);
void raiseDrawn(const RaiseDrawn& items);
} // namespace cpu

namespace cuda {
void carryPages(const CarryPages& items);
void markUnder(const MarkUnder& items);
void sortOutPages(const SortOutPages& items);
void numberPages(const NumberPages& items);
void assignPages(const AssignPages& items);
void clearPages(const ClearPages& items, size_t pageCount);
void emptySlots(const EmptySlots& items);
void resetCells(const ResetCells& items, size_t pageCount);
void prepareBlocks(const PrepareBlock& items);
void lowerCells(const LowerCells& items);
void listOpenPages(const ListOpenPages& items);
void raiseDrawn(const RaiseDrawn& items);
} // namespace cuda

/// Writes the page table from the one before.
inline void carryPages(Backend backend, const CarryPages& items) {
    SDAG_DISPATCH(backend, carryPages, items);
}
/// Marks the pages under boxes, in every map.
inline void markUnder(Backend backend, const MarkUnder& items) {
    SDAG_DISPATCH(backend, markUnder, items);
}
/// Decides what every carried page is good for.
inline void sortOutPages(Backend backend, const SortOutPages& items) {
    SDAG_DISPATCH(backend, sortOutPages, items);
}
/// Writes the numbers of all pages.
inline void numberPages(Backend backend, const NumberPages& items) {
    SDAG_DISPATCH(backend, numberPages, items);
}
/// Gives needed pages memory.
inline void assignPages(Backend backend, const AssignPages& items) {
    SDAG_DISPATCH(backend, assignPages, items);
}
/// Clears the first `pageCount` pages that got memory.
inline void clearPages(Backend backend, const ClearPages& items, size_t pageCount) {
    SDAG_DISPATCH(backend, clearPages, items, pageCount);
}
/// Empties the slots of maps that are new.
inline void emptySlots(Backend backend, const EmptySlots& items) {
    SDAG_DISPATCH(backend, emptySlots, items);
}
/// Takes the drawn depth from the cells of the first `pageCount` pages that got memory.
inline void resetCells(Backend backend, const ResetCells& items, size_t pageCount) {
    SDAG_DISPATCH(backend, resetCells, items, pageCount);
}
/// Writes what cells and blocks need.
inline void prepareBlocks(Backend backend, const PrepareBlock& items) {
    SDAG_DISPATCH(backend, prepareBlocks, items);
}
/// Lowers drawn depths under the new places of what moved.
inline void lowerCells(Backend backend, const LowerCells& items) {
    SDAG_DISPATCH(backend, lowerCells, items);
}
/// Writes the page table of what is drawn into.
inline void listOpenPages(Backend backend, const ListOpenPages& items) {
    SDAG_DISPATCH(backend, listOpenPages, items);
}
/// Raises drawn depths to what was drawn.
inline void raiseDrawn(Backend backend, const RaiseDrawn& items) {
    SDAG_DISPATCH(backend, raiseDrawn, items);
}

} // namespace shadowdag
