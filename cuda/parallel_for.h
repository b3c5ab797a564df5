// SPDX-License-Identifier: Apache-2.0
// parallelFor<Tag>(n, functor): runs functor(i) for every i in [0, n) on one backend.
#pragma once

#include "cuda/backend.h"
#include "cuda/macros.h"

#include <cstddef>
#include <functional>
#include <type_traits>

#if defined(__CUDACC__)
#include "cuda/launch.h"
#endif

namespace shadowdag {

/// Runs body(begin, end) over disjoint ranges that cover [0, count), on the CPU threads. Ranges
/// hold at least `grain` items except the last, and depend on count and grain only, not on the
/// number of threads. Returns when all are done; one of the exceptions thrown by body is rethrown.
/// Non-template so that oneTBB is included by one file.
void cpuParallelRanges(size_t count, size_t grain,
                       const std::function<void(size_t begin, size_t end)>& body);

/// Runs both tasks on the CPU threads and returns when both are done; an exception is rethrown.
/// Tasks may call the parallel functions themselves.
void cpuParallelInvoke(const std::function<void()>& a, const std::function<void()>& b);

#if defined(__CUDACC__)
template <class Tag, class F> __global__ void parallelForKernel(size_t count, F functor) {
    static_assert(std::is_same_v<Tag, CudaTag>);
    const size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x;
    if (i < count)
        functor(i);
}
#endif

/// Runs functor(i) for every i in [0, count) in no stated order, concurrently, and returns when all
/// are done (CPU) or when the launch is queued on the default stream (CUDA). The functor is copied;
/// it writes through views only. What two items write to one place must be the same for any order:
/// use the atomics of cuda/atomics.h.
/// @param grain the least number of consecutive items a CPU thread takes; ignored by CUDA.
template <class Tag, class F> void parallelFor(size_t count, const F& functor, size_t grain = 256) {
    if (count == 0)
        return;
    if constexpr (std::is_same_v<Tag, CpuTag>) {
        cpuParallelRanges(count, grain, [&functor](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i)
                functor(i);
        });
    } else {
#if defined(__CUDACC__)
        launch(parallelForKernel<Tag, F>, (count + kBlockThreads - 1) / kBlockThreads, count,
               functor);
#else
        static_assert(std::is_same_v<Tag, CpuTag>,
                      "CUDA passes are instantiated in .cu files only");
#endif
    }
}

} // namespace shadowdag
