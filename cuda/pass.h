// SPDX-License-Identifier: Apache-2.0
// How a pass is run on the backend that is chosen at run time. A pass is a functor over plain
// views:
//
//     struct Work {
//         View<...> ...;
//         size_t itemCount() const;                   // how many items there are
//         size_t grain() const;                       // optional: parallelFor's
//         SDAG_HD void operator()(size_t item) const; // one item
//     };
//
// Its folder registers it in passes.cpp by SDAG_PASS(Work) (pass_launch.h), and callers write
// runPass(backend, Work{...}). A pass that is not registered does not link.
//
// Two other forms: with a member `SplitWorkView parts` the pass runs over the parts of a list
// (parallelForParts) and needs no itemCount; with a member function shortItems(), which returns a
// functor that does the same work in more and shorter items, CUDA runs that one.
//
// A pass with a faster kernel for one processor declares `void launchPass(CudaTag, const Work&)` or
// `void launchPass(CpuTag, const Work&)` beside its functor, defines it in x_cuda.cu or x_cpu.cpp,
// and registers the functor for the other processor by SDAG_CPU_PASS or SDAG_CUDA_PASS.
#pragma once

#include "cuda/backend.h"
#include "cuda/view.h"

namespace shadowdag {

/// Returns f(CpuTag{}) or f(CudaTag{}) according to `backend` (kGl: the CPU's): the one place that
/// chooses. Throws Error kDevice for CUDA in a program built without it.
template <class F> auto withBackend(Backend backend, const F& f) {
    if (backend == Backend::kCuda) {
#if defined(SDAG_WITH_CUDA)
        return f(CudaTag{});
#else
        throwBuiltWithoutCuda();
#endif
    }
    return f(CpuTag{});
}

/// Runs all items of `work` on one processor, under the terms of parallelFor. The tag is part of
/// the symbol: in a name that both processors share, the linker would keep one body, and the other
/// processor's work would not be done.
template <class F> void launchPass(CpuTag, const F& work);
template <class F> void launchPass(CudaTag, const F& work);

/// Runs all items of `work` on `backend`, where its views live (kGl: on the CPU). Returns when they
/// are done (CPU) or queued (CUDA). Throws Error kDevice for CUDA in a program built without it.
template <class F> void runPass(Backend backend, const F& work) {
    withBackend(backend, [&](auto tag) { launchPass(tag, work); });
}

} // namespace shadowdag
