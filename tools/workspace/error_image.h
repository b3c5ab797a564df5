// SPDX-License-Identifier: Apache-2.0
// Pictures about pairs: where a method is wrong, and the method of each pair. Colours are those of
// Okabe and Ito, safe for colour-blind readers: false shadow vermilion, false light blue; rays sky
// blue, maps orange.
#pragma once

#include "hybrid/frame.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace shadowdag {

// Display values. Source: Okabe, Ito, Color Universal Design, 2002.
inline constexpr glm::vec3 kVermilion(213 / 255.0f, 94 / 255.0f, 0.0f);
inline constexpr glm::vec3 kBlue(0.0f, 114 / 255.0f, 178 / 255.0f);
inline constexpr glm::vec3 kSkyBlue(86 / 255.0f, 180 / 255.0f, 233 / 255.0f);
inline constexpr glm::vec3 kOrange(230 / 255.0f, 159 / 255.0f, 0.0f);

/// The false pairs of every pixel.
struct PixelErrors {
    std::vector<float> pairCount;   ///< width * height
    std::vector<float> falseShadow; ///< count of pairs
    std::vector<float> falseLight;
};

/// Returns the false pairs of each pixel.
/// @param visibility,truth per pair
PixelErrors countPixelErrors(const PairList& pairs, const std::vector<uint8_t>& visibility,
                             const std::vector<uint8_t>& truth);

/// Returns the mean visibility of every pixel's pairs in [0, 1]; 1 where there are none.
std::vector<float> meanVisibility(const PairList& pairs, const std::vector<uint8_t>& visibility);

/// Returns the share of every pixel's pairs computed by rays in [0, 1]; 0 where there are none.
std::vector<float> rayShare(const PairList& pairs, const std::vector<Route>& routes);

/// Returns a display picture: the truth in dim grey, vermilion where pairs are falsely dark, blue
/// where falsely lit; the square root of the share of pairs gives the strength, so that one pair in
/// thirty is still visible.
std::vector<glm::vec3> errorPicture(const std::vector<glm::vec3>& truthDisplay,
                                    const PixelErrors& errors);

/// Returns where a point is in a picture, in pixels from its upper left corner, hidden or not, also
/// beyond its edges; none where it is not before the camera.
std::optional<glm::vec2> pixelOf(const glm::vec3& positionWorld, const Camera& camera,
                                 uint32_t width, uint32_t height);

/// Returns a display picture: the truth's brightness, tinted sky blue for rays and orange for maps;
/// one disc per light in use, if the camera sees its position (hidden or not), a 120th of the
/// picture's height in radius, 2.5 pixels at least.
/// @param scale of the picture relative to the displayed one, whose pixels are meant
std::vector<glm::vec3> methodPicture(const std::vector<glm::vec3>& truthDisplay,
                                     const std::vector<float>& rayShares,
                                     const std::vector<MapRecord>& maps,
                                     const std::vector<Light>& lights, const Camera& camera,
                                     uint32_t width, uint32_t height, float scale = 1.0f);

} // namespace shadowdag
