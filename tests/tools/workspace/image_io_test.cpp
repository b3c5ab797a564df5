// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/image_io.h"

#include "cuda/error.h"
#include "scenes/warning.h"
#include "tests/tools/temporary_directory.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <gtest/gtest.h>
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function" // stb's, not all are called
#include <stb_image.h>
#pragma GCC diagnostic pop

#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <limits>

namespace shadowdag {

TEST(ImageIo, AFullDiskIsReportedWithThePictureAndLeavesNoFile) {
    const TemporaryDirectory directory;
    const std::string path = directory / "a.exr";
    std::vector<float> noise(256 * 256);
    uint32_t state = 1;
    for (float& value : noise)
        value = float(state = state * 1664525u + 1013904223u);
    // A limit on the size of files stands for the full disk.
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{4096, old.rlim_max};
    const auto oldHandler = std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    std::string message;
    try {
        writeExr(path, 256, 256, {{"Z", ExrChannel::Type::kFloat, noise}}, {});
    } catch (const Error& error) {
        message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, oldHandler);
    EXPECT_NE(message.find(path), std::string::npos) << message;
    EXPECT_EQ(message.find(".tmp-"), std::string::npos) << message;
    EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST(ImageIo, ExrKeepsEveryChannelBitForBit) {
    const TemporaryDirectory directory;
    constexpr uint32_t kWidth = 5, kHeight = 3;
    std::vector<float> ramp, halves;
    for (int i = 0; i < 15; ++i) {
        ramp.push_back(1.0f / 3.0f * float(i) - 1e-20f);
        halves.push_back(0.25f * float(i)); // exact in half
    }
    const std::string path = directory / "a.exr";
    writeExr(path, kWidth, kHeight,
             {{"Z", ExrChannel::Type::kFloat, ramp},
              {"visibility.mean", ExrChannel::Type::kHalf, halves}},
             {{"scene", "x"}});

    Imf::InputFile file(path.c_str());
    ASSERT_EQ(file.header().dataWindow().max.x, 4);
    ASSERT_EQ(file.header().dataWindow().max.y, 2);
    EXPECT_EQ(file.header().channels().findChannel("Z")->type, Imf::FLOAT);
    EXPECT_EQ(file.header().channels().findChannel("visibility.mean")->type, Imf::HALF);
    std::vector<float> z(15), mean(15);
    Imf::FrameBuffer frame;
    frame.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(z.data()), 4, 4 * kWidth));
    frame.insert("visibility.mean",
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(mean.data()), 4, 4 * kWidth));
    file.setFrameBuffer(frame);
    file.readPixels(0, 2);
    EXPECT_EQ(z, ramp);
    EXPECT_EQ(mean, halves);
}

std::vector<std::string> exrWarnings; // heard while pictures are written

// Near a light the radiance of a frame has no bound.
TEST(ImageIo, HalvesOfAnExrAreFinite) {
    const TemporaryDirectory directory;
    const std::string path = directory / "a.exr";
    const float infinity = std::numeric_limits<float>::infinity();
    // 65519 rounds to 65504 by itself, 65520 to infinity.
    const std::vector<float> values = {65504.0f, 65519.0f, 65520.0f, 1e30f, infinity, -1e9f, 3.0f};
    exrWarnings.clear();
    setWarningListener([](const std::string& text) { exrWarnings.push_back(text); });
    writeExr(path, 7, 1,
             {{"R", ExrChannel::Type::kHalf, values},
              {"G", ExrChannel::Type::kHalf, values},
              {"Z", ExrChannel::Type::kFloat, values}});
    ASSERT_EQ(exrWarnings.size(), 1u);
    EXPECT_EQ(exrWarnings[0].find(path + ": 10 values are beyond the largest half"), 0u)
        << exrWarnings[0];
    writeExr(path, 7, 1, {{"Z", ExrChannel::Type::kFloat, values}});
    writeExr(path, 1, 1, {{"R", ExrChannel::Type::kHalf, {65504.0f}}});
    EXPECT_EQ(exrWarnings.size(), 1u) << "nothing was lowered";
    writeExr(path, 7, 1, {{"R", ExrChannel::Type::kHalf, values}});
    setWarningListener(nullptr);

    std::vector<float> red(7);
    Imf::InputFile file(path.c_str());
    Imf::FrameBuffer frame;
    frame.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(red.data()), 4, 28));
    file.setFrameBuffer(frame);
    file.readPixels(0, 0);
    EXPECT_EQ(red, (std::vector<float>{65504, 65504, 65504, 65504, 65504, -65504, 3}));
}

TEST(ImageIo, PngRoundsAndClamps) {
    const TemporaryDirectory directory;
    const std::string path = directory / "a.png";
    writePng(path, 2, 1, {{0.0f, 0.5f, 1.0f}, {-1.0f, 2.0f, 0.25f}});
    int width = 0, height = 0, channels = 0;
    stbi_uc* pixels = stbi_load(path.c_str(), &width, &height, &channels, 3);
    ASSERT_NE(pixels, nullptr);
    EXPECT_EQ(width, 2);
    EXPECT_EQ(height, 1);
    EXPECT_EQ(std::vector<int>(pixels, pixels + 6), (std::vector<int>{0, 128, 255, 0, 255, 64}));
    stbi_image_free(pixels);
}

TEST(ImageIo, ABadDirectoryIsReportedByName) {
    for (const bool isExr : {true, false})
        try {
            isExr ? writeExr("/nowhere/at/all.exr", 1, 1, {{"Z", ExrChannel::Type::kFloat, {0}}})
                  : writePng("/nowhere/at/all.png", 1, 1, {{0, 0, 0}});
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_NE(std::string(error.what()).find("/nowhere/at/all"), std::string::npos)
                << error.what();
        }
}

} // namespace shadowdag
