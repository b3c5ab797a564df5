// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/kept_pages_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void carryPages(const CarryPages& items) {
    parallelFor<CpuTag>(items.pageTable.count / 32, items);
}
void markUnder(const MarkUnder& items) {
    parallelFor<CpuTag>(items.maps.count * items.boxesWorld.count, items);
}
void sortOutPages(const SortOutPages& items) {
    parallelFor<CpuTag>(items.pageTable.count / 32, items);
}
void numberPages(const NumberPages& items) {
    parallelFor<CpuTag>(items.order.count, items);
}
void assignPages(const AssignPages& items) {
    parallelFor<CpuTag>(items.needed.count, items);
}
void clearPages(const ClearPages& items, size_t pageCount) {
    parallelFor<CpuTag>(pageCount << items.runsLog2(), items);
}
void emptySlots(const EmptySlots& items) {
    parallelFor<CpuTag>(items.freshSlots.count * kCellsPerMap, items, kCellsPerMap);
}
void resetCells(const ResetCells& items, size_t pageCount) {
    parallelFor<CpuTag>(pageCount, items);
}
void prepareBlocks(const PrepareBlock& items) {
    parallelFor<CpuTag>(items.openBlocks.count, items);
}
void lowerCells(const LowerCells& items) {
    parallelFor<CpuTag>(items.maps.count * items.boxesWorld.count, items);
}
void listOpenPages(const ListOpenPages& items) {
    parallelFor<CpuTag>(items.openTable.count / 32, items, 64);
}
void raiseDrawn(const RaiseDrawn& items) {
    parallelFor<CpuTag>(items.cells.count / kProjectionMapSize, items);
}

} // namespace shadowdag::cpu
