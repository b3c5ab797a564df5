// SPDX-License-Identifier: Apache-2.0
// The parts of a binary glTF file that is being written. The JSON is written by hand: tinygltf's
// writer rounds numbers and keeps a second copy of everything. Source: Khronos, glTF 2.0
// specification, sec. 4.4; KHR_materials_emissive_strength.
#pragma once

#include <glm/glm.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag::glb {

/// Types of an accessor's components.
enum ComponentType { kFloat = 5126, kUint32 = 5125 };

/// Returns the shortest text that reads back as the same float.
std::string number(float value);

/// Returns a JSON list of the first `count` components.
template <class Vector> std::string numbers(const Vector& v, int count) {
    std::string text = "[";
    for (int i = 0; i < count; ++i)
        text += (i ? "," : "") + number(v[i]);
    return text + "]";
}

/// Returns a JSON string.
std::string quoted(const std::string& s);
/// Returns the member "name" with a comma, or "" for an empty name.
std::string nameMember(const std::string& name);
/// Returns an object without the comma behind its last member: "{a,b," to "{a,b}".
std::string closed(std::string object);

/// A JSON array that is left out when empty, as glTF demands.
class JsonArray {
public:
    explicit JsonArray(const char* key) : key_(key) {}
    /// Returns the element's index.
    size_t add(const std::string& element) {
        text_ += (count_ ? "," : "") + element;
        return count_++;
    }
    bool empty() const { return count_ == 0; }
    /// Returns `,"KEY":[...]`, or "".
    std::string member() const {
        return count_ ? ",\"" + std::string(key_) + "\":[" + text_ + "]" : std::string();
    }

private:
    const char* key_;
    std::string text_;
    size_t count_ = 0;
};

/// The lists of a file and its binary chunk.
struct Parts {
    std::vector<char> binary;
    JsonArray views{"bufferViews"}, accessors{"accessors"}, images{"images"}, samplers{"samplers"},
        textures{"textures"}, materials{"materials"}, meshes{"meshes"}, nodes{"nodes"},
        cameras{"cameras"}, animations{"animations"}, lights{"lights"};
    bool hasEmissiveStrength = false;
    bool hasTextureTransform = false;

    /// Appends bytes to the binary chunk, padded to four. Returns the index of their buffer view.
    /// @param target 0: none is stated
    size_t addView(const void* data, size_t byteCount, int target = 0);
    /// Appends count * componentCount words of four bytes. Returns the index of their accessor.
    /// @param bounds members of the accessor that state them, each after a comma, or ""
    size_t addAccessor(const void* data, size_t count, int componentCount, ComponentType type,
                       int target, const std::string& bounds);
    /// Returns the members of a material that state its emission, each with a comma.
    std::string emissionMembers(const glm::vec3& emission);

    /// Returns the file up to the content of its binary chunk: header, JSON, and that chunk's
    /// header if it is not empty.
    /// @param roots indices of the nodes of the only scene, with commas between
    std::string head(const std::string& sceneName, const std::string& roots) const;
};

/// No binary glTF file is larger.
constexpr uint64_t kMaxGlbBytes = 0xffffffffu;

} // namespace shadowdag::glb
