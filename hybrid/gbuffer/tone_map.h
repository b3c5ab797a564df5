// SPDX-License-Identifier: Apache-2.0
// From linear radiance to what a display shows.
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

/// Returns the exposure that puts the log-average luminance at 0.18; 1 for a black image. Pixels of
/// no luminance (background) and such that are not finite do not count. Source: Reinhard, Stark,
/// Shirley, Ferwerda, Photographic Tone Reproduction for Digital Images, SIGGRAPH 2002, eq. 1.
float autoExposure(const std::vector<glm::vec3>& linear);

} // namespace shadowdag
