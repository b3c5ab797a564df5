// SPDX-License-Identifier: Apache-2.0
// FLIP for low dynamic range: how different two images look when one alternates between them.
#pragma once

#include <glm/glm.hpp>

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Viewing distance of all our reports: a 0.7 m wide 4K monitor seen from 0.7 m has 67 pixels a
/// degree.
constexpr double kFlipPixelsPerDegree = 67.0;

/// Returns the mean FLIP difference of two display images (sRGB in [0, 1], clamped) in [0, 1], 0
/// for equal ones, and, in `map` when not null, the value per pixel. Images are continued by their
/// border pixels. Symmetric in its arguments. Throws Error kUsage when a size differs from width *
/// height. Float results: equal to about 1e-5 between compilers. Source: Andersson, Nilsson,
/// Akenine-Moeller, Oskarsson, Astroem, Fairchild, FLIP: A Difference Evaluator for Alternating
/// Images, HPG 2020, sec. 4.
double computeFlip(const std::vector<glm::vec3>& reference, const std::vector<glm::vec3>& test,
                   uint32_t width, uint32_t height, std::vector<float>* map = nullptr);

} // namespace shadowdag
