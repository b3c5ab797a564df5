// SPDX-License-Identifier: Apache-2.0
// What the targets of .gltf and .glb files share: the reader, the soundness of its scenes, and a
// file with everything that is read.
#pragma once

#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/scenes/gltf_files.h"

#include <gtest/gtest.h>

#include <string>

namespace shadowdag::fuzz {

/// Reads a scene, checks it, and makes its world at two times.
inline void readScene(const std::string& name, const uint8_t* data, size_t size) {
    GTEST_FLAG_SET(throw_on_failure, true);
    const Scene scene = readGltf(fuzzFolder().write(name, data, size));
    test::expectSound(scene, name);
    World world(scene, {});
    world.setTime(0.5f);
}

/// Returns a file with indices, a sparse accessor, an animation, a light, a camera, materials with
/// a mask and a colour, and texture coordinates.
test::GltfParts everythingFile();

} // namespace shadowdag::fuzz
