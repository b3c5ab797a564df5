// SPDX-License-Identifier: Apache-2.0
// PNG alpha: round trips, and refusal of every damaged byte.
#include "scenes/png_alpha.h"

#include "cuda/error.h"
#include "tests/scenes/allocation_peak.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb_image_write.h>

#include <cstdlib>
#include <memory>
#include <random>

// Of stb_image_write.h, which declares it beside its text alone.
extern "C" unsigned char* stbi_zlib_compress(unsigned char* data, int byteCount, int* packedBytes,
                                             int quality);

namespace shadowdag {
namespace {

AlphaMask randomMask(uint32_t width, uint32_t height, unsigned seed) {
    std::mt19937 random(seed);
    AlphaMask mask = makeAlphaMask(width, height);
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            if (random() & 1u)
                setOpaque(mask, x, y);
    return mask;
}

std::string messageOf(const std::vector<uint8_t>& bytes) {
    try {
        readPngAlpha(bytes.data(), bytes.size(), "leaf.png");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_THAT(error.what(), testing::StartsWith("leaf.png: "));
        return error.what();
    }
    return "no error";
}

TEST(PngAlpha, RoundTripIsExact) {
    for (const auto& [width, height] : {std::pair(1u, 1u), {3u, 70u}, {70u, 3u}, {64u, 64u}}) {
        const AlphaMask mask = randomMask(width, height, width);
        const std::vector<uint8_t> png = writePngMask(mask);
        EXPECT_EQ(png, writePngMask(mask));
        const AlphaImage image = readPngAlpha(png.data(), png.size(), "p");
        ASSERT_EQ(image.width, width);
        ASSERT_EQ(image.height, height);
        for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x)
                EXPECT_EQ(image.alpha[y * width + x], mask.isOpaque(x, y) ? 255 : 0);
    }
}

TEST(PngAlpha, EveryTruncationAndEveryFlippedBitIsRefused) {
    const std::vector<uint8_t> png = writePngMask(randomMask(9, 5, 1));
    for (size_t length = 0; length < png.size(); ++length)
        ASSERT_NE(messageOf({png.begin(), png.begin() + ptrdiff_t(length)}), "no error") << length;
    for (size_t bit = 0; bit < 8 * png.size(); ++bit) {
        std::vector<uint8_t> damaged = png;
        damaged[bit / 8] ^= uint8_t(1u << bit % 8);
        ASSERT_NE(messageOf(damaged), "no error") << "bit " << bit;
    }
}

// PNG specification, annex D, a bit at a time.
uint32_t slowChecksum(const uint8_t* data, size_t count) {
    uint32_t c = ~0u;
    for (size_t i = 0; i < 8 * count; ++i) {
        const uint32_t bit = (c ^ uint32_t(data[i / 8] >> i % 8)) & 1u;
        c = c >> 1 ^ (bit ? 0xedb88320u : 0u);
    }
    return ~c;
}

/// The same file with another size, or kind of pixels, in its header.
std::vector<uint8_t> withHeader(std::vector<uint8_t> png, uint32_t width, uint32_t height,
                                uint8_t depth = 8, uint8_t kind = 4) {
    const auto store = [&](size_t at, uint32_t value) {
        for (int i = 0; i < 4; ++i)
            png[at + size_t(i)] = uint8_t(value >> (24 - 8 * i));
    };
    store(16, width);
    store(20, height);
    png[24] = depth;
    png[25] = kind;
    store(29, slowChecksum(&png[12], 17));
    return png;
}

TEST(PngAlpha, ClaimsAreComparedWithTheDataBeforeMemoryIsAllocated) {
    const std::vector<uint8_t> png = writePngMask(randomMask(9, 5, 1));
    EXPECT_EQ(messageOf(withHeader(png, 9, 5)), "no error");
    test::resetAllocationPeak();
    EXPECT_THAT(messageOf(withHeader(png, 8192, 8192)), testing::HasSubstr("cannot hold"));
    EXPECT_THAT(messageOf(withHeader(png, 16384, 16384)), testing::HasSubstr("16384 x 16384"));
    EXPECT_THAT(messageOf(withHeader(png, 20000, 1)), testing::HasSubstr("16384 a side"));
    EXPECT_THAT(messageOf(withHeader(png, 0, 5)), testing::HasSubstr("0 x 5"));
    EXPECT_LE(test::allocationPeakBytes(), 1u << 20);
}

/// The same file with other data, in one chunk.
std::vector<uint8_t> withData(const std::vector<uint8_t>& png, const uint8_t* data, size_t count) {
    constexpr size_t kHeaderEnd = 8 + 25, kEndBytes = 12; // signature and IHDR; IEND
    std::vector<uint8_t> result(png.begin(), png.begin() + kHeaderEnd);
    const auto add = [&](uint32_t value) {
        for (int i = 3; i >= 0; --i)
            result.push_back(uint8_t(value >> 8 * i));
    };
    add(uint32_t(count));
    for (const char letter : {'I', 'D', 'A', 'T'})
        result.push_back(uint8_t(letter));
    result.insert(result.end(), data, data + count);
    add(slowChecksum(&result[kHeaderEnd + 4], count + 4));
    result.insert(result.end(), png.end() - kEndBytes, png.end());
    return result;
}

// A MiB of deflate may hold a GiB, of which stb would take all.
TEST(PngAlpha, DataOfMoreThanTheTexelsAreRefusedInLittleMemory) {
    std::vector<uint8_t> zeros(100u << 20);
    int packedBytes = 0;
    const std::unique_ptr<uint8_t, void (*)(void*)> packed(
        stbi_zlib_compress(zeros.data(), int(zeros.size()), &packedBytes, 8), std::free);
    ASSERT_GT(packedBytes, 64 << 10);
    zeros = {};
    const std::vector<uint8_t> png = writePngMask(randomMask(9, 5, 1));
    test::resetAllocationPeak();
    EXPECT_THAT(messageOf(withData(png, packed.get(), size_t(packedBytes))),
                testing::HasSubstr("bytes of data hold more than its texels"));
    EXPECT_LE(test::allocationPeakBytes(), 4u << 20);
}

TEST(PngAlpha, DecoderErrorsAreReported) {
    const std::vector<uint8_t> png = writePngMask(randomMask(9, 5, 1));
    EXPECT_THAT(messageOf(withHeader(png, 9, 5, 8, 7)), testing::HasSubstr("cannot be decoded"));
    EXPECT_THAT(messageOf(withHeader(png, 9, 6)), testing::HasSubstr("cannot be decoded"));
    EXPECT_THAT(messageOf({'G', 'I', 'F'}), testing::HasSubstr("is not a PNG"));
}

} // namespace
} // namespace shadowdag
