// SPDX-License-Identifier: Apache-2.0
// PNG and JPEG images as masks and base colours; a PNG's checksums are kept right.
#include "scenes/color_image.h"
#include "scenes/png_alpha.h"
#include "tests/fuzz/fuzz_target.h"

#include <stb_image_write.h>

#include <array>

namespace shadowdag::fuzz::image {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    if (isPng(data, size)) {
        const AlphaImage mask = readPngAlpha(data, size, "image");
        fuzzCheck(mask.alpha.size() == size_t(mask.width) * mask.height, "a mask has its texels");
    }
    const ColorImage image = readColorImage(data, size, "image");
    fuzzCheck(image.rgb.size() == size_t(3) * image.width * image.height,
              "an image has its texels");
}

void append(void* out, void* data, int byteCount) {
    static_cast<std::string*>(out)->append(static_cast<const char*>(data), size_t(byteCount));
}

std::vector<std::string> seeds() {
    constexpr int kSide = 8;
    std::vector<std::string> files(5);
    std::array<uint8_t, size_t(4) * kSide * kSide> pixels{};
    for (size_t i = 0; i < pixels.size(); ++i)
        pixels[i] = uint8_t(37 * i);
    for (int channels = 1; channels <= 4; ++channels)
        stbi_write_png_to_func(append, &files[size_t(channels) - 1], kSide, kSide, channels,
                               pixels.data(), channels * kSide);
    stbi_write_jpg_to_func(append, &files[4], kSide, kSide, 3, pixels.data(), 90);
    return files;
}

/// The checksum of chunks. Source: PNG specification, annex D.
uint32_t checksumOf(const std::string& bytes, size_t begin, size_t end) {
    uint32_t sum = ~0u;
    for (size_t i = begin; i < end; ++i) {
        sum ^= uint8_t(bytes[i]);
        for (int bit = 0; bit < 8; ++bit)
            sum = sum & 1u ? 0xedb88320u ^ sum >> 1 : sum >> 1;
    }
    return ~sum;
}

std::string pack(const std::string& content) {
    std::string file = content;
    if (!isPng(reinterpret_cast<const uint8_t*>(file.data()), file.size()))
        return file;
    for (size_t at = 8; at + 12 <= file.size();) {
        uint32_t length = 0;
        for (size_t i = 0; i < 4; ++i)
            length = length << 8 | uint8_t(file[at + i]);
        if (length > file.size() - at - 12)
            break;
        const uint32_t sum = checksumOf(file, at + 4, at + 8 + length);
        for (size_t i = 0; i < 4; ++i)
            file[at + 8 + length + i] = char(sum >> (24 - 8 * i));
        at += size_t(length) + 12;
    }
    return file;
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "image",
                   .maxBytes = 4096,
                   .fuzzOne = fuzzOne,
                   .seeds = seeds,
                   .pack = pack,
                   .words = {"IHDR", "IDAT", "PLTE", "tRNS", "IEND", "CgBI", "\xff\xd8", "\xff\xc2",
                             "\xff\xda", "\xff\xdb", "\xff\xc4", "\xff\xdd", "\xff\xd9"},
                   .memory = {}});

} // namespace

} // namespace shadowdag::fuzz::image
