// SPDX-License-Identifier: Apache-2.0
// The allocated resolutions of shadow maps, and hysteresis for a request that varies between two of
// them.
#pragma once

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Steps of 2^(1/4): a map has up to 41 % more texels than requested, 20 % on average. (Steps of
/// sqrt(2) would have 100 % and 44 %; finer steps cause more redraws, which hysteresis reduces.)
constexpr uint32_t kStepsPerOctave = 4;

/// A map shrinks only when it needs less than this part of the lower step: its request may vary by
/// 10 % without changing it.
constexpr double kShrinkBelow = 0.9;

/// Returns the face resolutions, ascending integers from 1 to `maxFaceTexels` inclusive: 2^(k / 4)
/// rounded to nearest, computed with integers, each once.
std::vector<uint32_t> makeResolutionSteps(uint32_t maxFaceTexels);

/// Returns the same steps up to 2^18: the resolutions of a directional light's lattice, which count
/// texels over the whole scene.
std::vector<uint32_t> makeDirectionalResolutionSteps();

/// Returns the step to allocate for a request of `resolutionSquared` texels^2: the least step that
/// is enough, within [minFaceTexels, the last step]; the previous one if that is enough and not too
/// large (kShrinkBelow). Compares squares, so no root decides.
/// @param steps from makeResolutionSteps
/// @param previousFaceTexels resolution in the last frame; 0 for none
uint32_t allocateResolution(const std::vector<uint32_t>& steps, double resolutionSquared,
                            uint32_t minFaceTexels, uint32_t previousFaceTexels);

} // namespace shadowdag
