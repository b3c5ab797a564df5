// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/probe_pass.h"

#include "cuda/pass_launch.h"

#include "cuda/warp.h"

SDAG_PASS(Probe)
SDAG_PASS(AddParts)
SDAG_PASS(VisitParts)
SDAG_CPU_PASS(SortLists)

#if defined(__CUDACC__)
namespace shadowdag {

// One warp per list.
__global__ void sortListsKernel(SortLists work) {
    const size_t i = warpOfGrid();
    if (i < work.start.count - 1)
        sortByWarp(work.numbers.data + work.start[i], work.start[i + 1] - work.start[i]);
}

void launchPass(CudaTag, const SortLists& work) {
    launch(sortListsKernel, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
#endif
