// SPDX-License-Identifier: Apache-2.0
// Colours of PNG and JPEG images; damaged ones are refused, in little memory.
#include "scenes/color_image.h"

#include "cuda/error.h"
#include "tests/scenes/allocation_peak.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb_image_write.h>

#include <random>

namespace shadowdag {
namespace {

using testing::HasSubstr;

void append(void* out, void* data, int byteCount) {
    auto& bytes = *static_cast<std::vector<uint8_t>*>(out);
    const auto* begin = static_cast<const uint8_t*>(data);
    bytes.insert(bytes.end(), begin, begin + byteCount);
}

/// Left half red, right half blue, 16 x 16.
std::vector<uint8_t> pixels() {
    std::vector<uint8_t> rgb;
    for (int i = 0; i < 256; ++i)
        for (const int c : {i % 16 < 8 ? 200 : 10, 30, i % 16 < 8 ? 20 : 220})
            rgb.push_back(uint8_t(c));
    return rgb;
}

std::vector<uint8_t> png() {
    std::vector<uint8_t> bytes;
    stbi_write_png_to_func(append, &bytes, 16, 16, 3, pixels().data(), 48);
    return bytes;
}

std::vector<uint8_t> jpeg() {
    std::vector<uint8_t> bytes;
    stbi_write_jpg_to_func(append, &bytes, 16, 16, 3, pixels().data(), 100);
    return bytes;
}

std::string messageOf(const std::vector<uint8_t>& bytes) {
    test::resetAllocationPeak();
    std::string message = "no error";
    try {
        const ColorImage image = readColorImage(bytes.data(), bytes.size(), "images/7");
        EXPECT_EQ(image.rgb.size(), size_t(3) * image.width * image.height);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        message = error.what();
        EXPECT_THAT(message, HasSubstr("images/7: "));
    }
    EXPECT_LE(test::allocationPeakBytes(), 32u << 20);
    return message;
}

TEST(ColorImage, PngIsExactAndJpegNear) {
    const std::vector<uint8_t> expected = pixels();
    const ColorImage fromPng = readColorImage(png().data(), png().size(), "p");
    EXPECT_EQ(fromPng.rgb, expected);
    const ColorImage fromJpeg = readColorImage(jpeg().data(), jpeg().size(), "p");
    ASSERT_EQ(fromJpeg.rgb.size(), expected.size());
    EXPECT_EQ(fromJpeg.width, 16u);
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(fromJpeg.rgb[i], expected[i], 4) << i;
}

TEST(ColorImage, OtherFormatsAreNamed) {
    const auto of = [](const std::string& text) {
        return messageOf(std::vector<uint8_t>(text.begin(), text.end()));
    };
    EXPECT_THAT(of("\xabKTX 20\xbb\r\n\x1a\n"), HasSubstr("a KTX2 image, but only PNG and JPEG"));
    EXPECT_THAT(of("RIFF....WEBPVP8 "), HasSubstr("a WebP image"));
    EXPECT_THAT(of("DDS |..."), HasSubstr("a DDS image"));
    EXPECT_THAT(of(""), HasSubstr("neither PNG nor JPEG"));
}

TEST(ColorImage, EveryTruncationIsRefused) {
    for (const std::vector<uint8_t>& whole : {png(), jpeg()})
        for (size_t length = 0; length < whole.size(); ++length) {
            // Without the last bytes a JPEG may still have all its pixels; libjpeg warns all the
            // same.
            ASSERT_NE(messageOf({whole.begin(), whole.begin() + ptrdiff_t(length)}), "no error")
                << length << " of " << whole.size();
        }
}

// JPEG has no checksums: a flipped bit may be a colour.
TEST(ColorImage, FlippedBitsOfAJpegAreRefusedOrAnImage) {
    const std::vector<uint8_t> whole = jpeg();
    size_t refusedCount = 0;
    for (size_t bit = 0; bit < 8 * whole.size(); ++bit) {
        std::vector<uint8_t> damaged = whole;
        damaged[bit / 8] ^= uint8_t(1u << bit % 8);
        refusedCount += messageOf(damaged) != "no error";
        ASSERT_FALSE(HasFailure()) << "bit " << bit;
    }
    EXPECT_GT(refusedCount, 100u);
}

TEST(ColorImage, SizesThatTheDataCannotHoldAreRefused) {
    std::vector<uint8_t> bytes = jpeg();
    for (size_t i = 0; i + 9 < bytes.size(); ++i)
        if (bytes[i] == 0xff && bytes[i + 1] == 0xc0) {
            bytes[i + 5] = bytes[i + 7] = 0x30; // 12304 x 12304
            EXPECT_THAT(messageOf(bytes), HasSubstr("more than an image may have"));
            bytes[i + 5] = bytes[i + 7] = 0x1f; // 7952 x 7952
            EXPECT_THAT(messageOf(bytes), HasSubstr("which its data cannot hold"));
            return;
        }
    FAIL() << "no frame header";
}

} // namespace
} // namespace shadowdag
