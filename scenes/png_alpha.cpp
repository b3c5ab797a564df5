// SPDX-License-Identifier: Apache-2.0
#include "scenes/png_alpha.h"

#include "cuda/error.h"

#include <stb_image.h>
#include <stb_image_write.h>

#include <array>
#include <climits>
#include <cstring>
#include <memory>

namespace shadowdag {

namespace {

constexpr uint8_t kSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
// A byte of deflate's output costs at least 1/1032 of a byte. Source: zlib, Technical Details.
constexpr uint64_t kMostInflation = 1032;

uint32_t loadBigEndian(const uint8_t* p) {
    return uint32_t(p[0]) << 24 | uint32_t(p[1]) << 16 | uint32_t(p[2]) << 8 | uint32_t(p[3]);
}

// PNG specification, annex D.
uint32_t checksum(const uint8_t* data, size_t byteCount) {
    static const std::array<uint32_t, 256> kTable = [] {
        std::array<uint32_t, 256> table{};
        for (uint32_t n = 0; n < 256; ++n) {
            uint32_t c = n;
            for (int bit = 0; bit < 8; ++bit)
                c = c & 1u ? 0xedb88320u ^ c >> 1 : c >> 1;
            table[n] = c;
        }
        return table;
    }();
    uint32_t c = ~0u;
    for (size_t i = 0; i < byteCount; ++i)
        c = kTable[(c ^ data[i]) & 255u] ^ c >> 8;
    return ~c;
}

[[noreturn]] void fail(const std::string& place, const std::string& problem) {
    throw Error(ErrorKind::kInput, place + ": " + problem + "; export the image again");
}

struct PngSize {
    uint32_t width = 0, height = 0;
};

/// Throws for data that inflate to more than the rows of the image: stb would take up to 4 GiB for
/// a PNG of 4 MiB. Small data cannot, and are not inflated a second time.
void checkInflated(const std::vector<char>& packed, uint64_t rowBits, uint32_t height,
                   const std::string& place) {
    constexpr size_t kSmallBytes = 64 << 10; // at most 64 MiB
    if (packed.size() <= kSmallBytes || packed.size() > INT_MAX)
        return;
    // A byte of filter each; seven passes of an interlaced image have about twice as many rows.
    const uint64_t most = (rowBits / 8 + 1) * height + 4 * uint64_t(height) + 64;
    if (most > INT_MAX)
        return;
    std::vector<char> rows(most);
    if (stbi_zlib_decode_buffer(rows.data(), int(most), packed.data(), int(packed.size())) < 0)
        fail(place, "the PNG is damaged, or its " + std::to_string(packed.size()) +
                        " bytes of data hold more than its texels");
}

/// Verifies all chunks before the decoder sees them, and returns the size: stb checks neither
/// checksums nor the size of what it inflates.
PngSize checkChunks(const uint8_t* data, size_t byteCount, const std::string& place) {
    PngSize image;
    if (!isPng(data, byteCount))
        fail(place, "is not a PNG");
    uint64_t rowBits = 0;
    std::vector<char> packed; // the data of all its chunks
    bool isFirst = true;
    for (size_t at = sizeof kSignature;;) {
        if (byteCount - at < 12)
            fail(place, "the PNG is cut short after " + std::to_string(byteCount) + " bytes");
        const uint32_t length = loadBigEndian(data + at);
        if (length > byteCount - at - 12)
            fail(place, "the PNG is cut short after " + std::to_string(byteCount) +
                            " bytes, within a chunk of " + std::to_string(length));
        const uint8_t* const type = data + at + 4;
        const uint8_t* const content = type + 4;
        if (checksum(type, size_t(length) + 4) != loadBigEndian(content + length))
            fail(place, "the PNG is damaged: the checksum of its chunk at byte " +
                            std::to_string(at) + " is wrong");
        const auto is = [type](const char* name) { return std::memcmp(type, name, 4) == 0; };
        if (isFirst != is("IHDR") || (isFirst && length != 13))
            fail(place, "the PNG does not begin with one header");
        if (isFirst) {
            image.width = loadBigEndian(content);
            image.height = loadBigEndian(content + 4);
            if (image.width < 1 || image.height < 1 || image.width > kMaxMaskSide ||
                image.height > kMaxMaskSide ||
                uint64_t(image.width) * image.height > kMaxMaskTexels)
                fail(place, std::to_string(image.width) + " x " + std::to_string(image.height) +
                                " texels; images have 1 to " + std::to_string(kMaxMaskSide) +
                                " a side and " + std::to_string(kMaxMaskTexels) + " at most");
            static constexpr uint64_t kChannels[8] = {1, 0, 3, 1, 2, 0, 4, 0};
            const uint8_t kind = content[9];
            rowBits = uint64_t(image.width) * content[8] * kChannels[kind & 7u];
        }
        if (is("IDAT"))
            packed.insert(packed.end(), content, content + length);
        isFirst = false;
        at += size_t(length) + 12;
        if (is("IEND"))
            break;
    }
    if (rowBits / 8 * image.height > kMostInflation * packed.size())
        fail(place, "claims " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                        " texels, which its " + std::to_string(packed.size()) +
                        " bytes of data cannot hold");
    checkInflated(packed, rowBits, image.height, place);
    return image;
}

struct PngPixels {
    PngSize size;
    std::unique_ptr<stbi_uc, void (*)(void*)> rgba;
};

PngPixels decode(const uint8_t* data, size_t byteCount, const std::string& place) {
    const PngSize size = checkChunks(data, byteCount, place);
    if (byteCount > INT_MAX)
        fail(place, std::to_string(byteCount) + " bytes are too large");
    int width = 0, height = 0, channels = 0;
    PngPixels pixels{size,
                     {stbi_load_from_memory(data, int(byteCount), &width, &height, &channels, 4),
                      stbi_image_free}};
    if (!pixels.rgba || uint32_t(width) != size.width || uint32_t(height) != size.height)
        fail(place, std::string("the PNG cannot be decoded: ") +
                        (stbi_failure_reason() ? stbi_failure_reason() : "no reason is given"));
    return pixels;
}

void append(void* out, void* data, int byteCount) {
    auto& bytes = *static_cast<std::vector<uint8_t>*>(out);
    const auto* begin = static_cast<const uint8_t*>(data);
    bytes.insert(bytes.end(), begin, begin + byteCount);
}

} // namespace

bool isPng(const uint8_t* data, size_t byteCount) {
    return byteCount >= sizeof kSignature && std::memcmp(data, kSignature, sizeof kSignature) == 0;
}

bool mayHaveAlpha(const uint8_t* data, size_t byteCount) {
    constexpr size_t kColorType = 25; // 0 grey, 2 RGB, 3 palette, 4 and 6 with alpha
    return byteCount > kColorType && data[kColorType] != 0 && data[kColorType] != 2;
}

AlphaImage readPngAlpha(const uint8_t* data, size_t byteCount, const std::string& place) {
    const PngPixels pixels = decode(data, byteCount, place);
    AlphaImage image{pixels.size.width, pixels.size.height, {}};
    const size_t count = size_t(image.width) * image.height;
    image.alpha.resize(count);
    for (size_t i = 0; i < count; ++i)
        image.alpha[i] = pixels.rgba.get()[4 * i + 3];
    return image;
}

ColorImage readPngColor(const uint8_t* data, size_t byteCount, const std::string& place) {
    const PngPixels pixels = decode(data, byteCount, place);
    ColorImage image{pixels.size.width, pixels.size.height, {}};
    const size_t count = size_t(image.width) * image.height;
    image.rgb.resize(3 * count);
    for (size_t i = 0; i < count; ++i)
        for (size_t channel = 0; channel < 3; ++channel)
            image.rgb[3 * i + channel] = pixels.rgba.get()[4 * i + channel];
    return image;
}

std::vector<uint8_t> writePngMask(const AlphaMask& mask) {
    SDAG_ASSERT(mask.words.size() == size_t(maskRowWords(mask.width)) * mask.height);
    std::vector<uint8_t> pixels;
    pixels.reserve(2 * size_t(mask.width) * mask.height);
    for (uint32_t y = 0; y < mask.height; ++y)
        for (uint32_t x = 0; x < mask.width; ++x) {
            pixels.push_back(255);
            pixels.push_back(mask.isOpaque(x, y) ? 255 : 0);
        }
    std::vector<uint8_t> png;
    if (!stbi_write_png_to_func(append, &png, int(mask.width), int(mask.height), 2, pixels.data(),
                                int(2 * mask.width)))
        throw Error(ErrorKind::kResource, "not enough memory to write an alpha mask of " +
                                              std::to_string(mask.width) + " x " +
                                              std::to_string(mask.height) + " texels");
    return png;
}

} // namespace shadowdag
