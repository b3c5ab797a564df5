// SPDX-License-Identifier: Apache-2.0
// Converts linear radiance to display values.
#pragma once

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// Returns the sRGB encoding of a linear value in [0, 1]. Source: IEC 61966-2-1.
float srgbFromLinear(float linear);
/// Returns the linear value of an sRGB encoding in [0, 1].
float linearFromSrgb(float srgb);

/// Returns linear radiance as display sRGB in [0, 1]: exposure, then the filmic curve x (2.51 x +
/// 0.03) / (x (2.43 x + 0.59) + 0.14) per channel, clamped, then the sRGB transfer. NaN and
/// negative radiance give 0. Source of the curve: Narkowicz, ACES Filmic Tone Mapping Curve, 2016.
std::vector<glm::vec3> toneMap(const std::vector<glm::vec3>& linear, float exposure);

/// Returns the exposure that puts the median luminance of lit pixels at 0.18; 1 for a black image.
/// Lit are pixels that are brighter than kAmbientRadiance on white; where there are none, those of
/// any luminance. Such that are not finite do not count. The median, and not the logarithmic
/// average of Reinhard et al., Photographic Tone Reproduction for Digital Images, SIGGRAPH 2002,
/// eq. 1: in a frame that is mostly dark that average makes what is lit white.
float autoExposure(const std::vector<glm::vec3>& linear);

} // namespace shadowdag
