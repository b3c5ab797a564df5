// SPDX-License-Identifier: Apache-2.0
// Shading on the CPU: a thread takes a cluster at a time and goes through it light by light.
#include "hybrid/shade_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void shadeUnlit(const ShadeSamples& work) {
    parallelFor<CpuTag>(
        work.gbuffer.count(), [&work](size_t i) { work.shadeUnlit(i); }, 4096);
}

void shadeLights(const ShadeSamples& work) {
    parallelFor<CpuTag>(
        work.clusters.count(), [&work](size_t c) { work.shadeCluster(c); }, 1);
}

} // namespace shadowdag::cpu
