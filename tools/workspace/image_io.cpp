// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/image_io.h"

#include "cuda/error.h"
#include "cuda/macros.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "scenes/warning.h"
#include "scenes/write_remedy.h"
#include "tools/workspace/png_memory.h"

#include <OpenEXR/IexErrnoExc.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#define STBIW_MALLOC(bytes) shadowdag::reallocateOrThrow(nullptr, bytes)
#define STBIW_REALLOC(old, bytes) shadowdag::reallocateOrThrow(old, bytes)
#define STBIW_FREE(data) std::free(data)
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace shadowdag {

namespace {

constexpr float kLargestHalf = 65504.0f;

/// Returns the Imf type of a channel.
Imf::PixelType imfType(ExrChannel::Type type) {
    return type == ExrChannel::Type::kHalf ? Imf::HALF : Imf::FLOAT;
}

/// Returns the values rounded to halves. Those beyond the largest half become that, with its sign,
/// and are counted: a half would make them infinite, which spreads over a picture that is scaled.
std::vector<Imath::half> halvesOf(const std::vector<float>& values, uint64_t& beyondCount) {
    std::vector<Imath::half> halves;
    halves.reserve(values.size());
    for (const float value : values) {
        const bool isBeyond = std::fabs(value) > kLargestHalf; // false for what is not a number
        halves.emplace_back(isBeyond ? std::copysign(kLargestHalf, value) : value);
        beyondCount += isBeyond;
    }
    return halves;
}

/// Writes three bytes a pixel.
void writeRgb(const std::string& path, uint32_t width, uint32_t height,
              const std::vector<uint8_t>& bytes) {
    OutputFile file(path);
    const auto append = [](void* context, void* data, int size) {
        static_cast<std::string*>(context)->append(static_cast<const char*>(data), size_t(size));
    };
    std::string encoded;
    if (!stbi_write_png_to_func(append, &encoded, int(width), int(height), 3, bytes.data(),
                                int(width) * 3))
        throw Error(ErrorKind::kResource, path + ": not enough memory to encode the picture");
    file.write(encoded);
    file.commit();
}

} // namespace

void addColorChannels(std::vector<ExrChannel>& channels, const std::string& prefix,
                      ExrChannel::Type type, const std::vector<glm::vec3>& pixels) {
    for (int c = 0; c < 3; ++c) {
        ExrChannel channel{prefix + "RGB" [c], type, {}};
        channel.values.reserve(pixels.size());
        for (const glm::vec3& pixel : pixels)
            channel.values.push_back(pixel[c]);
        channels.push_back(std::move(channel));
    }
}

std::vector<std::pair<std::string, std::string>> exrAttributes(const Json& values) {
    std::vector<std::pair<std::string, std::string>> attributes;
    for (const auto& [key, value] : values.items())
        attributes.emplace_back(
            key, value.is_string() ? value.get<std::string>()
                                   : value.dump(-1, ' ', false, Json::error_handler_t::replace));
    return attributes;
}

void writeExr(const std::string& path, uint32_t width, uint32_t height,
              const std::vector<ExrChannel>& channels,
              const std::vector<std::pair<std::string, std::string>>& attributes) {
    OutputFile file(path);
    uint64_t beyondCount = 0;
    try {
        Imf::Header header{int(width), int(height)};
        header.compression() = Imf::ZIP_COMPRESSION;
        for (const auto& [name, text] : attributes)
            header.insert(name, Imf::StringAttribute(text));
        Imf::FrameBuffer frameBuffer;
        std::vector<std::vector<Imath::half>> halves(channels.size());
        for (size_t i = 0; i < channels.size(); ++i) {
            const ExrChannel& channel = channels[i];
            SDAG_ASSERT(channel.values.size() == size_t(width) * height);
            header.channels().insert(channel.name, Imf::Channel(imfType(channel.type)));
            char* data = nullptr;
            size_t size = sizeof(float);
            if (channel.type == ExrChannel::Type::kHalf) {
                halves[i] = halvesOf(channel.values, beyondCount);
                data = reinterpret_cast<char*>(halves[i].data());
                size = sizeof(Imath::half);
            } else {
                data = const_cast<char*>(
                    reinterpret_cast<const char*>(channel.values.data())); // only read
            }
            frameBuffer.insert(channel.name,
                               Imf::Slice(imfType(channel.type), data, size, size * width));
        }
        Imf::OutputFile exr(file.temporaryPath().c_str(), header);
        exr.setFrameBuffer(frameBuffer);
        exr.writePixels(int(height));
    } catch (const std::exception& error) {
        if (dynamic_cast<const Iex::EmfileExc*>(&error))
            refuseTooManyFiles(path, EMFILE);
        std::string reason = error.what(); // OpenEXR's message contains the temporary file's name
        if (const size_t at = reason.find(file.temporaryPath()); at != std::string::npos)
            reason.replace(at, file.temporaryPath().size(), path);
        throw Error(ErrorKind::kResource,
                    path + ": cannot be written as EXR: " + reason + "; " +
                        writeRemedy(dynamic_cast<const Iex::EfbigExc*>(&error) ? EFBIG : 0));
    }
    file.commit();
    if (beyondCount > 0)
        warn(path + ": " + std::to_string(beyondCount) +
             " values are beyond the largest half float, 65504, and were lowered to it; render "
             "with --float to keep them");
}

void writePng(const std::string& path, uint32_t width, uint32_t height,
              const std::vector<glm::vec3>& display) {
    SDAG_ASSERT(display.size() == size_t(width) * height);
    std::vector<uint8_t> bytes;
    bytes.reserve(display.size() * 3);
    for (const glm::vec3& pixel : display)
        for (int c = 0; c < 3; ++c)
            bytes.push_back(uint8_t(std::clamp(pixel[c], 0.0f, 1.0f) * 255.0f + 0.5f));
    writeRgb(path, width, height, bytes);
}

bool isWholePng(const std::string& path) {
    // The last chunk, IEND, and its checksum. Source: PNG, sec. 11.2.5.
    constexpr std::array<char, 8> kEnd = {'I', 'E', 'N', 'D', '\xae', '\x42', '\x60', '\x82'};
    std::array<char, 8> last{};
    if (!whyNoInput(path, ~uint64_t(0)).empty())
        return false;
    std::ifstream file = openInput(path);
    file.seekg(-std::streamoff(last.size()), std::ios::end);
    file.read(last.data(), std::streamsize(last.size()));
    return file && last == kEnd;
}

void writePngBytes(const std::string& path, uint32_t width, uint32_t height,
                   const std::vector<uint8_t>& rgba) {
    SDAG_ASSERT(rgba.size() == 4 * size_t(width) * height);
    std::vector<uint8_t> bytes;
    bytes.reserve(rgba.size() / 4 * 3);
    for (size_t i = 0; i < rgba.size(); ++i)
        if (i % 4 != 3)
            bytes.push_back(rgba[i]);
    writeRgb(path, width, height, bytes);
}

} // namespace shadowdag
