// SPDX-License-Identifier: Apache-2.0
// Images with colours, as base colour textures need them: PNG and JPEG, of which damaged files are
// rejected. libjpeg is used in color_image.cpp only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// The colours of an image, row by row from the top, 8 bits a channel, sRGB.
struct ColorImage {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgb; ///< 3 * width * height
};

/// Returns whether bytes begin as every JPEG does.
bool isJpeg(const uint8_t* data, size_t byteCount);

/// Returns the colours of a PNG or JPEG, told apart by content: 16 bits cut to the upper 8, greys
/// as equal channels, alpha ignored, colour profiles ignored as glTF demands. Throws Error kInput,
/// "PLACE: problem", for another format, which it names if it is KTX2, WebP or DDS, and for a file
/// that is truncated or damaged, has four inks, or declares more pixels than its data can hold or
/// than masks may have (kMaxMaskSide, kMaxMaskTexels). Needs five temporary bytes per pixel, and
/// nine for a progressive JPEG.
ColorImage readColorImage(const uint8_t* data, size_t byteCount, const std::string& place);

} // namespace shadowdag
