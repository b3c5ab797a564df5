// SPDX-License-Identifier: Apache-2.0
// The glTF reader against the shared collections: conformance files against their index, broken
// files, the real scenes. Skipped where they are absent.
#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/scenes/allocation_peak.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

namespace shadowdag {
namespace {

#define SKIP_WITHOUT_SHARED_SCENES()                                                               \
    if (test::sharedScenes().empty())                                                              \
    GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder"

// The world at rest pose, without skins and morph targets as the index has it, or nothing when the
// scene has no triangle.
std::optional<World> restWorld(Scene& scene) {
    scene.animations.clear();
    for (Node& node : scene.nodes) {
        node.skin = kNone;
        node.morphWeights.clear();
    }
    for (Mesh& mesh : scene.meshes)
        mesh.morphWeights.assign(mesh.morphTargets.size(), 0.0f);
    try {
        return World(scene, {});
    } catch (const Error& error) {
        EXPECT_THAT(error.what(),
                    testing::ContainsRegex("has no triangle|no triangle has an area"));
        return std::nullopt;
    }
}

std::vector<nlohmann::json> indexOf(const std::string& prefix) {
    std::vector<nlohmann::json> rows;
    std::ifstream file(test::sharedScenes() + "gltf_index.jsonl");
    for (std::string line; std::getline(file, line);) {
        nlohmann::json row = nlohmann::json::parse(line);
        if (row.at("path").get<std::string>().rfind(prefix, 0) == 0)
            rows.push_back(std::move(row));
    }
    return rows;
}

TEST(GltfCorpus, ConformanceFilesGiveTheTrianglesAndBoundsOfTheIndex) {
    SKIP_WITHOUT_SHARED_SCENES();
    // Refused for a reason that is not an extension; the index counts what its reader made of them.
    const std::map<std::string, std::string> refused = {
        {"conformance/asset-generator-0.6/Compatibility/Compatibility_04.gltf", "asset.minVersion"},
        {"conformance/draco/CubeScaledInstances/glTF/cube_att.gltf", "has another parent"},
        {"conformance/draco/ZeroLengthBufferView/ZeroLengthBufferView.gltf", "not within 1e9"},
        {"conformance/gltf-pipeline/extensions/EXT_meshopt_compression/meshopt-no-fallback/"
         "meshopt-no-fallback.gltf",
         "'uri' is missing"},
        {"conformance/fastgltf/empty_json.gltf", "not a readable glTF 2.0 file"},
        {"conformance/tinygltf/regression/unassigned-skeleton.gltf", "the bottom row of matrix 0"},
    };
    size_t loadedCount = 0, refusedCount = 0, packedCount = 0, deformedCount = 0;
    for (const nlohmann::json& row : indexOf("conformance/")) {
        const std::string path = row.at("path");
        SCOPED_TRACE(path);
        const nlohmann::json& expected = row.at("reader");
        Scene scene;
        try {
            scene = readGltf(test::sharedScenes() + path);
        } catch (const Error& error) {
            ++refusedCount;
            const auto known = refused.find(path);
            EXPECT_THAT(error.what(),
                        testing::HasSubstr(known != refused.end() ? known->second : "extension"));
            continue;
        }
        ++loadedCount;
        EXPECT_FALSE(refused.count(path)) << "is now read; take it off the list";
        test::expectSound(scene, path);
        deformedCount += std::any_of(scene.meshes.begin(), scene.meshes.end(),
                                     [](const Mesh& mesh) { return mesh.deforms(); });
        if (!scene.skins.empty())
            World(scene, {}).setTime(0.5f); // posed
        const std::optional<World> world = restWorld(scene);
        // The reader behind the index unpacks no compressed geometry; the validator counts it.
        const bool isPacked = expected.contains("error");
        ASSERT_TRUE(isPacked || expected.contains("tris")) << "its index says " << expected.dump();
        const nlohmann::json& tris = (isPacked ? row.at("info") : expected).at("tris");
        packedCount += isPacked;
        EXPECT_EQ(world ? world->triangles().count() : 0, tris.get<size_t>());
        if (!world || !expected.contains("bbox"))
            continue;
        // Some files have quaternions that are short of unit length by a few 1e-7, which we
        // normalise and the reader behind the index did not.
        float scale = 0.0f;
        for (int end = 0; end < 2; ++end)
            for (int axis = 0; axis < 3; ++axis)
                scale = std::max(scale, std::fabs(expected.at("bbox")[end][axis].get<float>()));
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(world->boundsWorld().min[axis], expected.at("bbox")[0][axis].get<float>(),
                        1e-6f * scale);
            EXPECT_NEAR(world->boundsWorld().max[axis], expected.at("bbox")[1][axis].get<float>(),
                        1e-6f * scale);
        }
    }
    EXPECT_GE(loadedCount, 352u);
    EXPECT_GE(deformedCount, 18u);
    EXPECT_EQ(packedCount, 8u); // compressed ones, whose reader in the index fails
    EXPECT_EQ(loadedCount + refusedCount, 360u);
}

// Bounds at time 0 as a program of a few lines of numpy computes them by the formula of the
// specification.
TEST(GltfCorpus, SkinsOfTheAssetGeneratorPoseTheirMeshes) {
    SKIP_WITHOUT_SHARED_SCENES();
    const struct {
        const char* file;
        glm::vec3 min, max;
    } posed[] = {
        {"Animation_Skin/Animation_Skin_00", {-0.25f, -0.2f, -0.1f}, {0.25f, 0.17321f, 0}},
        {"Animation_Skin/Animation_Skin_03", {-0.25f, -0.2f, -0.1f}, {0.25f, 0.17321f, 0}},
        {"Animation_Skin/Animation_Skin_05", {-0.25f, -0.2f, 0}, {0.25f, 0.2f, 0.2f}},
        {"Animation_Skin/Animation_Skin_06", {-0.25f, -0.2f, -0.1f}, {0.85f, 0.17321f, 0}},
        {"Animation_Skin/Animation_Skin_09", {-0.25f, -0.4f, -0.20313f}, {0.25f, 0.35811f, 0}},
        {"Animation_Skin/Animation_Skin_11", {-0.375f, -0.25f, -0.1897f}, {0.375f, 0.45799f, 0}},
        {"Animation_SkinType/Animation_SkinType_03", {-0.25f, -0.2f, -0.1f}, {0.25f, 0.17321f, 0}},
    };
    for (const auto& expected : posed) {
        SCOPED_TRACE(expected.file);
        const Scene scene = readGltf(test::sharedScenes() + "conformance/asset-generator-0.6/" +
                                     expected.file + ".gltf");
        const World world(scene, {});
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(world.boundsWorld().min[axis], expected.min[axis], 1e-5f);
            EXPECT_NEAR(world.boundsWorld().max[axis], expected.max[axis], 1e-5f);
        }
    }
}

TEST(GltfCorpus, BrokenFilesAreRefusedOrSound) {
    SKIP_WITHOUT_SHARED_SCENES();
    size_t fileCount = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(test::sharedScenes() + "invalid")) {
        const std::string extension = entry.path().extension().string();
        if (!entry.is_regular_file() || (extension != ".gltf" && extension != ".glb"))
            continue;
        ++fileCount;
        const std::string path = entry.path().string();
        SCOPED_TRACE(path);
        test::resetAllocationPeak();
        try {
            Scene scene = readGltf(path);
            test::expectSound(scene, path);
            if (restWorld(scene)) {
                scene = readGltf(path);
                World(scene, {}).setTime(0.5f);
            }
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(), testing::HasSubstr(entry.path().stem().string()));
        }
        // The JSON as a tree is the most there is; none of these files has large buffers.
        EXPECT_LE(test::allocationPeakBytes(), 200 * entry.file_size() + (2u << 20));
    }
    EXPECT_GE(fileCount, 300u);
}

TEST(GltfCorpus, RealScenesHaveTheirTrianglesLightsAndBounds) {
    SKIP_WITHOUT_SHARED_SCENES();
    std::ifstream table(test::sharedScenes() + "scenes.tsv");
    std::string line;
    std::getline(table, line); // the header
    size_t sceneCount = 0;
    while (std::getline(table, line)) {
        std::vector<std::string> fields;
        std::istringstream stream(line);
        for (std::string field; std::getline(stream, field, '\t');)
            fields.push_back(field);
        ASSERT_GT(fields.size(), 8u);
        SCOPED_TRACE(fields[0]);
        ++sceneCount;
        Scene scene = readGltf(test::sharedScenes() + fields[0]);
        const std::optional<World> world = restWorld(scene);
        ASSERT_TRUE(world.has_value());
        EXPECT_EQ(world->triangles().count(), std::stoul(fields[4]));
        const size_t slash = fields[5].find('/');
        size_t pointCount = 0, spotCount = 0; // the table does not count directional lights
        for (const Light& light : world->lights()) {
            pointCount += light.kind == Light::kPoint;
            spotCount += light.kind == Light::kSpot;
            EXPECT_GT(light.rangeWorld, 0.0f);
        }
        EXPECT_EQ(pointCount, std::stoul(fields[5].substr(0, slash)));
        EXPECT_EQ(spotCount, std::stoul(fields[5].substr(slash + 1)));
        const nlohmann::json bounds = nlohmann::json::parse(fields[8]);
        for (int axis = 0; axis < 3; ++axis) { // the table has three decimals
            EXPECT_NEAR(world->boundsWorld().min[axis], bounds[0][axis].get<float>(), 6e-4f);
            EXPECT_NEAR(world->boundsWorld().max[axis], bounds[1][axis].get<float>(), 6e-4f);
        }
    }
    EXPECT_GE(sceneCount, 40u);
}

} // namespace
} // namespace shadowdag
