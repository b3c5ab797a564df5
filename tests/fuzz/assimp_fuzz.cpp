// SPDX-License-Identifier: Apache-2.0
// Scenes that Assimp reads, in a process of its own: what crashes there is a refusal here. The
// first byte chooses the kind.
#include "scenes/scene_file.h"
#include "scenes/world.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/scenes/cube_files.h"

#include <gtest/gtest.h>

#include <iterator>

namespace shadowdag::fuzz::assimp {

namespace {

constexpr const char* kExtensions[] = {".obj", ".ply", ".stl", ".fbx", ".dae"};

void fuzzOne(const uint8_t* data, size_t size) {
    if (size < 2)
        return;
    GTEST_FLAG_SET(throw_on_failure, true);
    const std::string name = std::string("scene") + kExtensions[data[0] % std::size(kExtensions)];
    const Scene scene = readSceneFile(fuzzFolder().write(name, data + 1, size - 1));
    test::expectSound(scene, name);
    World(scene, {});
}

std::vector<std::string> seeds() {
    std::vector<std::string> texts;
    for (const test::CubeFile& file : test::cubeFiles())
        for (size_t kind = 0; kind < std::size(kExtensions); ++kind)
            if (file.extension == kExtensions[kind])
                texts.push_back(char('A' + kind) + file.content); // 'A' chooses the first
    return texts;
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "assimp", .maxBytes = 8192, .fuzzOne = fuzzOne, .seeds = seeds, .replayCount = 300});

} // namespace

} // namespace shadowdag::fuzz::assimp
