// SPDX-License-Identifier: Apache-2.0
// Plain differences of display images.
#pragma once

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// Returns the root of the mean squared difference over pixels and channels of two display images;
/// 0 for empty ones. Throws Error kUsage when their sizes differ.
double computeRmse(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);

/// Returns how differently two sequences of pictures change from one frame to the next: the mean
/// over pixels and channels of |(after - before) - (trueAfter - trueBefore)| of display images, 0
/// to 2; 0 for empty ones. An error that stays where it is gives 0, however large; one that comes
/// or goes, its size; one that moves, twice that. All four need one size and one exposure. Throws
/// Error kUsage when their sizes differ.
double computeFrameDifferenceError(const std::vector<glm::vec3>& before,
                                   const std::vector<glm::vec3>& after,
                                   const std::vector<glm::vec3>& trueBefore,
                                   const std::vector<glm::vec3>& trueAfter);

} // namespace shadowdag
