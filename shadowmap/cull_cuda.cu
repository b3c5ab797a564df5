// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cull_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

namespace {

// A thread an entry: an item may have reached thousands.
struct TestEntry {
    CountDraws work;
    SDAG_HD void operator()(size_t at) const { work.testEntry(at); }
};

} // namespace

void gatherBlocks(const GatherBlock& items) {
    parallelFor<CudaTag>(items.blocks.count, items);
}
void countReached(const CountReached& items) {
    parallelFor<CudaTag>(items.reachedCounts.count, items);
}
void listReached(const ListReached& items) {
    parallelFor<CudaTag>(items.firstReached.count - 1, items);
}
void countDraws(const CountDraws& items) {
    parallelFor<CudaTag>(items.reached.count, TestEntry{items});
}
void listDraws(const ListDraws& items) {
    parallelFor<CudaTag>(items.reached.count, items);
}
void noteCullLengths(const NoteCullLengths& items) {
    parallelFor<CudaTag>(1, items);
}

} // namespace shadowdag::cuda
