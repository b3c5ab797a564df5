// SPDX-License-Identifier: Apache-2.0
// Shading on CUDA: a thread takes a sample. Kernels are compiled for what the pairs of a frame need
// (PairNeeds): one with the code of all methods takes the registers of the largest of them, which
// leaves few warps to hide latency, even where no pair uses it.
#include "hybrid/frame/shade_pass.h"

#include "cuda/launch.h"

#include <utility>

namespace shadowdag {

namespace {

/// In the order in which they are tried; the last covers all.
constexpr PairNeeds kKernels[] = {
    // rays, maps, directional, {voxels, levels, triangles, movers}
    {true, false, false, {true, false, false, false}},  // voxel rays of one level
    {true, false, false, {true, false, false, true}},   // and what moves
    {true, false, false, {false, false, true, false}},  // rays against triangles
    {true, false, false, {false, false, true, true}},   // and what moves
    {false, true, false, {false, false, false, false}}, // cube maps
    {true, true, false, {true, false, false, true}},    // both, by voxels of one level
    {true, true, false, {false, false, true, true}},    // both, by triangles
    {},
};

/// Blocks that a multiprocessor shall hold at least: what limits a kernel's registers.
constexpr int kLeastBlocks[] = {8, 4, 5, 4, 8, 3, 4, 2};
static_assert(std::size(kLeastBlocks) == std::size(kKernels));

// nvcc 13 does not compile kernels whose template arguments are structures.
template <size_t kKernel>
__global__ void __launch_bounds__(kBlockThreads, kLeastBlocks[kKernel])
    shadeKernel(ShadeSamples work) {
    const size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x;
    if (i < work.clusters.samples.count)
        work.shadeSample<kKernels[kKernel]>(i);
}

template <size_t... kIndices>
void launchCovering(const ShadeSamples& work, size_t blockCount, std::index_sequence<kIndices...>) {
    bool isLaunched = false;
    (((!isLaunched && kKernels[kIndices].cover(work.needs))
          ? (launch(shadeKernel<kIndices>, blockCount, work), isLaunched = true)
          : false),
     ...);
}

} // namespace

void launchPass(CudaTag, const ShadeLights& pass) {
    const size_t count = pass.itemCount();
    launchCovering(pass.work, (count + kBlockThreads - 1) / kBlockThreads,
                   std::make_index_sequence<std::size(kKernels)>{});
}

} // namespace shadowdag
