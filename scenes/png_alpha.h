// SPDX-License-Identifier: Apache-2.0
// Reads PNG images, and writes alpha masks as such; the only user of stb in scenes/. Not a general
// image reader: it reads what masks and base colour textures need and rejects damaged images.
// Source: W3C, Portable Network Graphics (PNG) Specification, second edition.
#pragma once

#include "scenes/alpha_mask.h"
#include "scenes/color_image.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// Opacity of an image, row by row from the top; 255 is opaque.
struct AlphaImage {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> alpha; ///< width * height
};

/// Returns whether bytes begin as every PNG does.
bool isPng(const uint8_t* data, size_t byteCount);

/// Returns whether the header of a PNG allows for alpha, other than of one transparent colour.
bool mayHaveAlpha(const uint8_t* data, size_t byteCount);

/// Returns the alpha of a PNG of any kind, 16 bits cut to the upper 8; 255 without alpha. Throws
/// Error kInput, "PLACE: problem", for a file that is truncated, fails a checksum, declares more
/// pixels than its data can hold or than masks may have (kMaxMaskSide, kMaxMaskTexels). Needs five
/// temporary bytes per pixel.
AlphaImage readPngAlpha(const uint8_t* data, size_t byteCount, const std::string& place);

/// Returns the colours of a PNG, under the same terms.
ColorImage readPngColor(const uint8_t* data, size_t byteCount, const std::string& place);

/// Returns a mask as a PNG of grey and alpha: white, alpha 255 where it is opaque and 0 elsewhere.
/// The same bytes for the same mask.
std::vector<uint8_t> writePngMask(const AlphaMask& mask);

} // namespace shadowdag
