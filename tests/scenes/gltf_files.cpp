// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/gltf_files.h"

#include "scenes/gltf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace shadowdag::test {

TemporaryFolder::TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "sdag-test-XXXXXX").string();
    if (!mkdtemp(pattern.data()))
        throw std::runtime_error("cannot make a folder in " + pattern);
    path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryFolder::write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
}

std::string GltfParts::json() const {
    std::string text = "{";
    for (const auto& [key, value] : members)
        if (!value.empty())
            text += (text.size() > 1 ? ",\"" : "\"") + key + "\":" + value;
    return text + "}";
}

std::string GltfParts::glb() const {
    std::string text = json(), bytes = binary;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    const auto word = [](size_t value) {
        const uint32_t v = uint32_t(value);
        return std::string(reinterpret_cast<const char*>(&v), 4);
    };
    std::string out =
        "glTF" + word(2) + word(20 + text.size() + (bytes.empty() ? 0 : 8 + bytes.size()));
    out += word(text.size()) + "JSON" + text;
    if (!bytes.empty())
        out += word(bytes.size()) + std::string("BIN\0", 4) + bytes;
    return out;
}

GltfParts triangleFile() {
    GltfParts parts;
    parts.append<float>({0, 0, 0, 2, 0, 0, 0, 1, 0}).append<uint16_t>({0, 1, 2, 0});
    parts.members = {
        {"asset", R"({"version":"2.0"})"},
        {"buffers", R"([{"byteLength":44}])"},
        {"bufferViews",
         R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}])"},
        {"accessors",
         R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,1,0]},)"
         R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])"},
        {"nodes", R"([{"mesh":0}])"},
        {"scenes", R"([{"nodes":[0]}])"},
    };
    return parts;
}

GltfParts skinnedFile() {
    GltfParts parts = triangleFile();
    parts.binary.resize(44);
    parts.append<uint8_t>({0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}); // at 44
    parts.append<uint8_t>({255, 0, 0, 0, 255, 0, 0, 0, 191, 64, 0, 0});
    parts.append<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    parts.append<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1});
    parts.append<float>({0, 2}); // at 196
    parts.append<float>({0, 5, 0, 0, 13, 0});
    parts.set("buffers", R"([{"byteLength":228}])")
        .set("bufferViews", R"([{"buffer":0,"byteLength":36},)"
                            R"({"buffer":0,"byteOffset":36,"byteLength":6},)"
                            R"({"buffer":0,"byteOffset":44,"byteLength":24},)"
                            R"({"buffer":0,"byteOffset":68,"byteLength":128},)"
                            R"({"buffer":0,"byteOffset":196,"byteLength":32}])")
        .set(
            "accessors",
            R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
            R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
            R"({"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},)"
            R"({"bufferView":2,"byteOffset":12,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},)"
            R"({"bufferView":3,"componentType":5126,"count":2,"type":"MAT4"},)"
            R"({"bufferView":4,"componentType":5126,"count":2,"type":"SCALAR"},)"
            R"({"bufferView":4,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC3"}])")
        .set(
            "meshes",
            R"([{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"indices":1}]}])")
        .set("skins", R"([{"joints":[1,2],"inverseBindMatrices":4}])")
        .set("nodes", R"([{"mesh":0,"skin":0,"scale":[1,-7,1]},)"
                      R"({"translation":[10,0,0],"children":[2]},{"translation":[0,5,0]}])")
        .set("scenes", R"([{"nodes":[0,1]}])")
        .set("animations",
             R"([{"channels":[{"sampler":0,"target":{"node":2,"path":"translation"}}],)"
             R"("samplers":[{"input":5,"output":6}]}])");
    return parts;
}

GltfParts morphedFile() {
    GltfParts parts = triangleFile();
    parts.binary.resize(44);
    parts.append<float>({0, 0, 0, 0, 0, 4, 0, 0, 0}); // at 44
    parts.append<float>({8, 0, 0, 8, 0, 0, 8, 0, 0});
    parts.append<float>({0, 2, 0, 1, 1, 0.5f}); // at 116
    parts.set("buffers", R"([{"byteLength":140}])")
        .set("bufferViews", R"([{"buffer":0,"byteLength":36},)"
                            R"({"buffer":0,"byteOffset":36,"byteLength":6},)"
                            R"({"buffer":0,"byteOffset":44,"byteLength":36},)"
                            R"({"buffer":0,"byteOffset":80,"byteLength":36},)"
                            R"({"buffer":0,"byteOffset":116,"byteLength":24}])")
        .set("accessors",
             R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
             R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
             R"({"bufferView":2,"componentType":5126,"count":3,"type":"VEC3"},)"
             R"({"bufferView":3,"componentType":5126,"count":3,"type":"VEC3"},)"
             R"({"bufferView":4,"componentType":5126,"count":2,"type":"SCALAR"},)"
             R"({"bufferView":4,"byteOffset":8,"componentType":5126,"count":4,"type":"SCALAR"}])")
        .set("meshes", R"([{"weights":[0.5,0],"primitives":[{"attributes":{"POSITION":0},)"
                       R"("targets":[{"POSITION":2},{"POSITION":3}],"indices":1}]}])")
        .set("nodes", R"([{"mesh":0},{"mesh":0,"weights":[0,0.25]},)"
                      R"({"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,3,0,1]}])")
        .set("scenes", R"([{"nodes":[0,1,2]}])")
        .set("animations", R"([{"channels":[{"sampler":0,"target":{"node":2,"path":"weights"}}],)"
                           R"("samplers":[{"input":4,"output":5}]}])");
    return parts;
}

Scene readParts(const GltfParts& parts) {
    const TemporaryFolder folder;
    Scene scene = readGltf(folder.write("t.glb", parts.glb()));
    expectSound(scene, "t.glb");
    return scene;
}

std::string maskOf(const Scene& scene, size_t material) {
    const int index = scene.materials.at(material).alphaMask;
    if (index == kNone)
        return "opaque";
    const AlphaMask& mask = scene.alphaMasks.at(size_t(index));
    std::string text;
    for (uint32_t y = 0; y < mask.height; ++y) {
        text += y ? "/" : "";
        for (uint32_t x = 0; x < mask.width; ++x)
            text += mask.isOpaque(x, y) ? '#' : '.';
    }
    return text;
}

void expectSound(const Scene& scene, const std::string& name) {
    SCOPED_TRACE(name);
    const auto isFinite = [](const glm::vec3& v) {
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    };
    ASSERT_FALSE(scene.materials.empty());
    for (const Mesh& mesh : scene.meshes) {
        ASSERT_EQ(mesh.triangles.size(), mesh.triangleMaterial.size());
        for (const glm::vec3& p : mesh.positions)
            ASSERT_TRUE(isFinite(p));
        for (const glm::uvec3& t : mesh.triangles)
            ASSERT_TRUE(t.x < mesh.positions.size() && t.y < mesh.positions.size() &&
                        t.z < mesh.positions.size());
        for (uint32_t material : mesh.triangleMaterial)
            ASSERT_LT(material, scene.materials.size());
        ASSERT_EQ(mesh.jointWeights.size(), mesh.jointsPerVertex * mesh.positions.size());
        for (const JointWeight& joint : mesh.jointWeights)
            ASSERT_TRUE(joint.weight >= 0.0f && std::isfinite(joint.weight));
        ASSERT_EQ(mesh.morphWeights.size(), mesh.morphTargets.size());
        for (const std::vector<glm::vec3>& target : mesh.morphTargets) {
            ASSERT_EQ(target.size(), mesh.positions.size());
            for (const glm::vec3& displacement : target)
                ASSERT_TRUE(isFinite(displacement));
        }
    }
    const auto inRange = [](int i, size_t count) {
        return i == kNone || (i >= 0 && size_t(i) < count);
    };
    std::vector<int> parents(scene.nodes.size(), kNone);
    for (size_t i = 0; i < scene.nodes.size(); ++i) {
        const Node& node = scene.nodes[i];
        ASSERT_TRUE(inRange(node.mesh, scene.meshes.size()));
        ASSERT_TRUE(inRange(node.light, scene.lights.size()));
        ASSERT_TRUE(inRange(node.camera, scene.cameras.size()));
        ASSERT_TRUE(inRange(node.skin, scene.skins.size()));
        ASSERT_TRUE(node.morphWeights.empty() ||
                    node.morphWeights.size() ==
                        scene.meshes[size_t(node.mesh)].morphTargets.size());
        if (node.skin != kNone) {
            const Skin& skin = scene.skins[size_t(node.skin)];
            ASSERT_EQ(skin.jointFromMesh.size(), skin.joints.size());
            for (const int joint : skin.joints)
                ASSERT_TRUE(joint != kNone && inRange(joint, scene.nodes.size()));
            for (const JointWeight& joint : scene.meshes[size_t(node.mesh)].jointWeights)
                ASSERT_LT(joint.joint, skin.joints.size());
        }
        for (int child : node.children) {
            ASSERT_TRUE(child != kNone && inRange(child, scene.nodes.size()));
            ASSERT_EQ(parents[size_t(child)], kNone);
            parents[size_t(child)] = int(i);
        }
    }
    for (size_t i = 0; i < scene.nodes.size(); ++i) {
        ASSERT_EQ(parents[i], scene.nodes[i].parent);
        size_t steps = 0;
        for (int n = int(i); n != kNone; n = parents[size_t(n)])
            ASSERT_LE(++steps, scene.nodes.size()) << "loop at node " << i;
    }
    for (int root : scene.roots) {
        ASSERT_TRUE(root != kNone && inRange(root, scene.nodes.size()));
        ASSERT_EQ(parents[size_t(root)], kNone);
    }
    for (const Animation& animation : scene.animations)
        for (const AnimationChannel& channel : animation.channels) {
            ASSERT_TRUE(channel.node != kNone && inRange(channel.node, scene.nodes.size()));
            const bool isCubic =
                channel.interpolation == AnimationChannel::Interpolation::kCubicSpline;
            ASSERT_FALSE(channel.times.empty());
            ASSERT_EQ(channel.values.size(), channel.times.size() * (isCubic ? 3 : 1));
        }
}

std::string sharedScenes() {
    const char* named = std::getenv("SDAG_SHARED_SCENES");
    const std::string folder = named ? named : std::string(SDAG_SOURCE_DIR) + "/../shared/scenes";
    return std::filesystem::is_directory(folder) ? folder + "/" : "";
}

} // namespace shadowdag::test
