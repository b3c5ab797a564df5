// SPDX-License-Identifier: Apache-2.0
// The one function that starts kernels; included where the compiler is CUDA's only.
#pragma once

#include "cuda/cuda_check.h"

#include <cuda_runtime.h>

#include <cstddef>
#include <string>
#include <type_traits>

namespace shadowdag {

/// Threads of a block, of nearly all our kernels: four warps.
constexpr unsigned kBlockThreads = 128;

/// Queues a kernel of `blockCount` blocks of `threadCount` threads on the default stream, with
/// copies of the arguments; nothing for no blocks. Throws Error kResource for more blocks than a
/// device starts at once or no memory for its threads, kDevice if the runtime refuses the launch.
template <class... Parameters>
void launchBlocks(void (*kernel)(Parameters...), size_t blockCount, unsigned threadCount,
                  const std::type_identity_t<Parameters>&... arguments) {
    if (blockCount == 0)
        return;
    if (blockCount > 0x7fffffffu)
        throw Error(ErrorKind::kResource, std::to_string(blockCount) +
                                              " blocks of one pass exceed what a device starts "
                                              "at once; use fewer lights or a smaller image");
    cudaLaunchConfig_t config{};
    config.gridDim = dim3(unsigned(blockCount));
    config.blockDim = dim3(threadCount);
    config.stream = cudaStream_t(0);
    const cudaError_t launched = cudaLaunchKernelEx(&config, kernel, arguments...);
    if (launched == cudaErrorMemoryAllocation) // of what its threads spill
        detail::throwCudaError(launched, "cudaLaunchKernelEx", ErrorKind::kResource,
                               "no memory for a kernel's threads on the device; use a lower "
                               "resolution, a smaller pool of pages (--pool), or a device with "
                               "more memory");
    if (launched != cudaSuccess)
        detail::throwCudaError(launched, "cudaLaunchKernelEx");
}

/// The same for blocks of kBlockThreads.
template <class... Parameters>
void launch(void (*kernel)(Parameters...), size_t blockCount,
            const std::type_identity_t<Parameters>&... arguments) {
    launchBlocks(kernel, blockCount, kBlockThreads, arguments...);
}

/// Enough warps to hide latency; more would only queue.
constexpr unsigned kBlocksPerProcessor = 8;

/// Returns as many blocks as fill the device, for kernels that share items whose number the host
/// does not know.
inline size_t fillingBlocks() {
    int device = 0, processorCount = 0;
    CUDA_CHECK(cudaGetDevice(&device));
    CUDA_CHECK(cudaDeviceGetAttribute(&processorCount, cudaDevAttrMultiProcessorCount, device));
    return size_t(processorCount) * kBlocksPerProcessor;
}

} // namespace shadowdag
