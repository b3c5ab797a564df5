// SPDX-License-Identifier: Apache-2.0
// The shading pass.
#pragma once

#include "cuda/backend.h"
#include "hybrid/frame/shade.h"

namespace shadowdag {

namespace cpu {
void shadeUnlit(const ShadeSamples& work);
void shadeLights(const ShadeSamples& work);
} // namespace cpu
namespace cuda {
void shadeUnlit(const ShadeSamples& work);
void shadeLights(const ShadeSamples& work);
} // namespace cuda

/// Sets every pixel to what it sends without lights. All views of `work` live on the backend.
inline void shadeUnlit(Backend backend, const ShadeSamples& work) {
    SDAG_DISPATCH(backend, shadeUnlit, work);
}

/// Adds the lights of every cluster to its samples. Deterministic, floats included: a sample's
/// lights are added in ascending order.
inline void shadeLights(Backend backend, const ShadeSamples& work) {
    SDAG_DISPATCH(backend, shadeLights, work);
}

} // namespace shadowdag
