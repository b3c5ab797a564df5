// SPDX-License-Identifier: Apache-2.0
// The macros that register passes (pass.h). Only for passes.cpp of each folder, which
// sdag_add_passes compiles twice: as C++ for the CPU, and by nvcc for CUDA.
#pragma once

#include "cuda/parallel_for.h"
#include "cuda/pass.h"
#include "cuda/split_work.h"

namespace shadowdag {

#if defined(__CUDACC__)
using PassTag = CudaTag;
#else
using PassTag = CpuTag;
#endif

/// The launcher of this compilation; the other processor's is only declared.
template <class F> void launchPass(PassTag tag, const F& work) {
    if constexpr (requires { work.parts; })
        parallelForParts<PassTag>(work.parts, work);
    else if constexpr (std::is_same_v<PassTag, CudaTag> && requires { work.shortItems(); })
        launchPass(tag, work.shortItems());
    else if constexpr (requires { work.grain(); })
        parallelFor<PassTag>(work.itemCount(), work, work.grain());
    else
        parallelFor<PassTag>(work.itemCount(), work);
}

} // namespace shadowdag

/// Registers a pass of namespace shadowdag for one processor, or for both.
#if defined(__CUDACC__)
#define SDAG_CPU_PASS(Work)
#define SDAG_CUDA_PASS(Work)                                                                       \
    template void shadowdag::launchPass<shadowdag::Work>(shadowdag::CudaTag,                       \
                                                         const shadowdag::Work&);
#else
#define SDAG_CPU_PASS(Work)                                                                        \
    template void shadowdag::launchPass<shadowdag::Work>(shadowdag::CpuTag, const shadowdag::Work&);
#define SDAG_CUDA_PASS(Work)
#endif
#define SDAG_PASS(Work) SDAG_CPU_PASS(Work) SDAG_CUDA_PASS(Work)
