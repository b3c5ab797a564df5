// SPDX-License-Identifier: Apache-2.0
// Scenes as text, their buffers within.
#include "tests/fuzz/scene_reading.h"

namespace shadowdag::fuzz::gltf {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    readScene("scene.gltf", data, size);
}

std::string base64(const std::string& bytes) {
    constexpr const char* kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t group = 0;
        for (size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
    }
    return text;
}

std::vector<std::string> seeds() {
    std::vector<std::string> texts;
    for (test::GltfParts parts :
         {test::triangleFile(), everythingFile(), test::skinnedFile(), test::morphedFile()}) {
        const std::string bytes = std::to_string(parts.binary.size());
        parts.set("buffers", "[{\"byteLength\":" + bytes +
                                 ",\"uri\":\"data:application/octet-stream;base64," +
                                 base64(parts.binary) + "\"}]");
        texts.push_back(parts.json());
    }
    return texts;
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "gltf", .maxBytes = 16384, .fuzzOne = fuzzOne, .seeds = seeds});

} // namespace

} // namespace shadowdag::fuzz::gltf
