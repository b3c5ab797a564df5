// SPDX-License-Identifier: Apache-2.0
// Plain differences of display images.
#pragma once

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// Returns the root of the mean squared difference over pixels and channels of two display images;
/// 0 for empty ones. Throws Error kUsage when their sizes differ.
double computeRmse(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);

} // namespace shadowdag
