// SPDX-License-Identifier: Apache-2.0
// The kernel of SortLists on CUDA: one warp per list.
#include "cuda/warp.h"
#include "tests/cuda/probe_pass.h"

namespace shadowdag {

namespace {

__global__ void sortListsKernel(SortLists work) {
    const size_t i = warpOfGrid();
    if (i < work.start.count - 1)
        sortByWarp(work.numbers.data + work.start[i], work.start[i + 1] - work.start[i]);
}

} // namespace

void launchPass(CudaTag, const SortLists& work) {
    launch(sortListsKernel, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
