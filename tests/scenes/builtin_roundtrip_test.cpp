// SPDX-License-Identifier: Apache-2.0
// Built-in scenes are written as .glb files and read back without changes.
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace shadowdag {
namespace {

class BuiltinRoundTrip : public testing::TestWithParam<std::string> {};

TEST_P(BuiltinRoundTrip, KeepsGeometryLightsCameraAndMotion) {
    const test::TemporaryFolder folder;
    const Scene scene = makeBuiltin(GetParam());
    const std::string path = folder.path("scene.glb");
    writeGlb(scene, path);
    const Scene back = readGltf(path);
    EXPECT_TRUE(back.warnings.empty());
    EXPECT_EQ(back.durationSeconds(), scene.durationSeconds());

    World a(scene, {}), b(back, {});
    EXPECT_EQ(a.geometryHash(), b.geometryHash());
    for (const float time : {0.0f, 3.3f}) {
        SCOPED_TRACE(time);
        EXPECT_EQ(a.setTime(time), b.setTime(time));
        const TriangleView ta = a.triangles(), tb = b.triangles();
        ASSERT_EQ(ta.count(), tb.count());
        ASSERT_EQ(ta.positions.count, tb.positions.count);
        EXPECT_EQ(std::memcmp(ta.positions.data, tb.positions.data,
                              ta.positions.count * sizeof(glm::vec3)),
                  0);
        EXPECT_EQ(std::memcmp(ta.triangles.data, tb.triangles.data,
                              ta.triangles.count * sizeof(glm::uvec3)),
                  0);
        ASSERT_EQ(a.lights().size(), b.lights().size());
        for (size_t i = 0; i < a.lights().size(); ++i)
            EXPECT_EQ(std::memcmp(&a.lights()[i], &b.lights()[i], sizeof(Light)), 0)
                << "light " << i;
        ASSERT_EQ(a.cameras().size(), 1u);
        ASSERT_EQ(b.cameras().size(), 1u);
        EXPECT_EQ(std::memcmp(&a.cameras()[0], &b.cameras()[0], sizeof(Camera)), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, BuiltinRoundTrip,
                         testing::Values("atrium", "houses", "necropolis", "fail-alpha",
                                         "fail-mover", "fail-far-origin"),
                         [](const auto& info) {
                             std::string name = info.param;
                             for (char& c : name)
                                 if (c == '-')
                                     c = '_';
                             return name;
                         });

} // namespace
} // namespace shadowdag
