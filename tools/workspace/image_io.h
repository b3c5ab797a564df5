// SPDX-License-Identifier: Apache-2.0
// Writes pictures: EXR with named channels, PNG for screens. Files are complete or absent.
#pragma once

#include "tools/settings/json.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// One channel of an EXR file.
struct ExrChannel {
    enum class Type { kHalf, kFloat };
    std::string name; ///< as in "R", "visibility.mean"; unique
    Type type = Type::kHalf;
    std::vector<float> values; ///< width * height, scanlines from the top; half rounds to nearest
                               ///< and is at most 65504
};

/// Adds three channels `prefix` + R, G, B.
void addColorChannels(std::vector<ExrChannel>& channels, const std::string& prefix,
                      ExrChannel::Type type, const std::vector<glm::vec3>& pixels);

/// Returns the values of an object as attributes of an EXR: texts as they are, all else as JSON.
std::vector<std::pair<std::string, std::string>> exrAttributes(const Json& values);

/// Writes an EXR (zip compressed). `attributes` are name and text pairs of its header. Values of
/// half channels beyond 65504, infinite ones included, are lowered to it, with one warning a file.
/// Throws Error kResource when the disk refuses.
void writeExr(const std::string& path, uint32_t width, uint32_t height,
              const std::vector<ExrChannel>& channels,
              const std::vector<std::pair<std::string, std::string>>& attributes = {});

/// Writes an 8-bit RGB PNG of display values in [0, 1] (clamped, rounded to nearest).
/// Throws Error kResource when the disk refuses.
void writePng(const std::string& path, uint32_t width, uint32_t height,
              const std::vector<glm::vec3>& display);
/// Returns whether a file can be read and ends as a PNG does, so that it is not cut off.
bool isWholePng(const std::string& path);
/// Writes the first three of four bytes a pixel as they are.
void writePngBytes(const std::string& path, uint32_t width, uint32_t height,
                   const std::vector<uint8_t>& rgba);

} // namespace shadowdag
