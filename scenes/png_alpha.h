// SPDX-License-Identifier: Apache-2.0
// Reads and writes the alpha channel of PNG images; the only user of stb in scenes/. Not a general
// image reader: it reads what alpha masks need and rejects damaged images.
// Source: W3C, Portable Network Graphics (PNG) Specification, second edition.
#pragma once

#include "scenes/alpha_mask.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// Opacity of an image, row by row from the top; 255 is opaque.
struct AlphaImage {
    uint32_t width = 0, height = 0;
    bool hasColor = false;      ///< the file holds more than greys
    std::vector<uint8_t> alpha; ///< width * height
};

/// Returns whether bytes begin as every PNG does.
bool isPng(const uint8_t* data, size_t byteCount);

/// Returns the alpha of a PNG of any kind, 16 bits cut to the upper 8; 255 without alpha. Throws
/// Error kInput, "PLACE: problem", for a file that is truncated, fails a checksum, declares more
/// pixels than its data can hold or than masks may have (kMaxMaskSide, kMaxMaskTexels). Needs five
/// temporary bytes per pixel.
AlphaImage readPngAlpha(const uint8_t* data, size_t byteCount, const std::string& place);

/// Returns a mask as a PNG of grey and alpha: white, alpha 255 where it is opaque and 0 elsewhere.
/// The same bytes for the same mask.
std::vector<uint8_t> writePngMask(const AlphaMask& mask);

} // namespace shadowdag
