// SPDX-License-Identifier: Apache-2.0
// Shading on CUDA: a thread takes a sample. Kernels are compiled for what the pairs of a frame need
// (PairNeeds): one with the code of all methods takes the registers of the largest of them, which
// leaves few warps to hide latency, even where no pair uses it.
#include "hybrid/frame/shade_pass.h"

#include "cuda/launch.h"

#include <utility>

namespace shadowdag {

namespace {

/// A kernel: what its pairs may need, and how many of its blocks a multiprocessor shall hold at
/// least, which limits its registers. Other numbers were slower (tests/bench/results/gpu.json has
/// the chosen).
struct ShadeKernel {
    PairNeeds needs;
    int leastBlocks;
};

/// In the order in which they are tried. The last covers all: lights that are directional, levels
/// of detail, and voxels of which some are believed.
constexpr ShadeKernel kKernels[] = {
    // {rays, maps, directional, {voxels, levels, triangles, movers}, taps}
    {{true, false, false, {true, false, false, false}}, 8},     // voxel rays of one level
    {{true, false, false, {true, false, false, true}}, 4},      // and what moves
    {{true, false, false, {false, false, true, false}}, 5},     // rays against triangles
    {{true, false, false, {false, false, true, true}}, 4},      // and what moves
    {{false, true, false, {false, false, false, false}, 4}, 8}, // cube maps, the default filter
    {{false, true, false, {false, false, false, false}}, 8},    // cube maps
    {{true, true, false, {true, false, false, true}}, 3},       // both, by voxels of one level
    {{true, true, false, {false, false, true, true}}, 4},       // both, by triangles
    {{}, 2},
};

// nvcc 13 does not compile kernels whose template arguments are structures.
template <size_t kKernel>
__global__ void __launch_bounds__(kBlockThreads, kKernels[kKernel].leastBlocks)
    shadeKernel(ShadeSamples work) {
    const size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x;
    if (i < work.clusters.samples.count)
        work.shadeSample<kKernels[kKernel].needs>(i);
}

template <size_t... kIndices>
void launchCovering(const ShadeSamples& work, size_t blockCount, std::index_sequence<kIndices...>) {
    bool isLaunched = false;
    (((!isLaunched && kKernels[kIndices].needs.cover(work.needs))
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
