// SPDX-License-Identifier: Apache-2.0
// Scenes in one binary file, whose lengths mutations keep right. Source: Khronos, glTF 2.0
// specification, sec. 4.4.
#include "tests/fuzz/scene_reading.h"

#include <cstring>

namespace shadowdag::fuzz::glb {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    readScene("scene.glb", data, size);
}

std::vector<std::string> seeds() {
    return {test::triangleFile().glb(), everythingFile().glb(), test::skinnedFile().glb(),
            test::morphedFile().glb()};
}

/// Sets the length of the file, and that of the text's chunk to where its braces end.
std::string pack(const std::string& content) {
    std::string file = content;
    const auto put = [&](size_t at, size_t value) {
        const uint32_t word = uint32_t(value);
        if (at + 4 <= file.size())
            std::memcpy(file.data() + at, &word, 4);
    };
    put(8, file.size());
    const size_t second = file.find(std::string("BIN\0", 4));
    if (second == std::string::npos) {
        put(12, file.size() - std::min<size_t>(file.size(), 20));
    } else if (second >= 24) {
        put(12, second - 4 - 20);
        put(second - 4, file.size() - second - 4);
    }
    return file;
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "glb", .maxBytes = 16384, .fuzzOne = fuzzOne, .seeds = seeds, .pack = pack});

} // namespace

} // namespace shadowdag::fuzz::glb
