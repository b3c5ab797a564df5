// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/kept_pages_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void carryPages(const CarryPages& items) {
    parallelFor<CudaTag>(items.pageTable.count / 32, items);
}
void markUnder(const MarkUnder& items) {
    parallelFor<CudaTag>(items.maps.count * items.boxesWorld.count, items);
}
void sortOutPages(const SortOutPages& items) {
    parallelFor<CudaTag>(items.pageTable.count / 32, items);
}
void numberPages(const NumberPages& items) {
    parallelFor<CudaTag>(items.order.count, items);
}
void assignPages(const AssignPages& items) {
    parallelFor<CudaTag>(items.needed.count, items);
}
void clearPages(const ClearPages& items, size_t pageCount) {
    parallelFor<CudaTag>(pageCount << items.runsLog2(), items);
}
void emptySlots(const EmptySlots& items) {
    parallelFor<CudaTag>(items.freshSlots.count * kCellsPerMap, items, kCellsPerMap);
}
void resetCells(const ResetCells& items, size_t pageCount) {
    parallelFor<CudaTag>(pageCount, items);
}
void prepareBlocks(const PrepareBlock& items) {
    parallelFor<CudaTag>(items.openBlocks.count, items);
}
void lowerCells(const LowerCells& items) {
    parallelFor<CudaTag>(items.maps.count * items.boxesWorld.count, items);
}
void listOpenPages(const ListOpenPages& items) {
    parallelFor<CudaTag>(items.openTable.count / 32, items, 64);
}
void raiseDrawn(const RaiseDrawn& items) {
    parallelFor<CudaTag>(items.cells.count / kProjectionMapSize, items);
}

} // namespace shadowdag::cuda
