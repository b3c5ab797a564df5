// SPDX-License-Identifier: Apache-2.0
// The shading passes.
#pragma once

#include "cuda/pass.h"
#include "hybrid/frame/shade.h"

namespace shadowdag {

/// Sets pixel i to its radiance without lights.
struct ShadeUnlit {
    ShadeSamples work;

    size_t itemCount() const { return work.gbuffer.count(); }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const { work.shadeUnlit(i); }
};

/// Adds its lights to sample i, in cluster order. The CPU takes a cluster at a time instead:
/// shade_cpu.cpp.
struct ShadeLights {
    ShadeSamples work;

    size_t itemCount() const { return work.clusters.samples.count; }
    SDAG_HD void operator()(size_t i) const { work.shadeSample(i); }
};
void launchPass(CpuTag, const ShadeLights& pass);
void launchPass(CudaTag, const ShadeLights& pass); ///< by kernels for what the pairs need

/// Sets every pixel to its radiance without lights. All views of `work` are on the backend.
inline void shadeUnlit(Backend backend, const ShadeSamples& work) {
    runPass(backend, ShadeUnlit{work});
}

/// Adds the lights of every cluster to its samples. Deterministic, floats included: a sample's
/// lights are added in ascending order.
inline void shadeLights(Backend backend, const ShadeSamples& work) {
    runPass(backend, ShadeLights{work});
}

} // namespace shadowdag
