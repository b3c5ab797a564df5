// SPDX-License-Identifier: Apache-2.0
// Shading on CUDA: a thread a sample, in cluster order.
#include "hybrid/frame/shade_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

namespace {

struct ShadeUnlit {
    ShadeSamples work;
    SDAG_HD void operator()(size_t i) const { work.shadeUnlit(i); }
};
struct ShadeSample {
    ShadeSamples work;
    SDAG_HD void operator()(size_t i) const { work.shadeSample(i); }
};

} // namespace

void shadeUnlit(const ShadeSamples& work) {
    parallelFor<CudaTag>(work.gbuffer.count(), ShadeUnlit{work});
}

void shadeLights(const ShadeSamples& work) {
    parallelFor<CudaTag>(work.clusters.samples.count, ShadeSample{work});
}

} // namespace shadowdag::cuda
