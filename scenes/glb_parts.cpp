// SPDX-License-Identifier: Apache-2.0
#include "scenes/glb_parts.h"

#include <algorithm>
#include <charconv>

namespace shadowdag::glb {

std::string number(float value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value).ptr;
    return std::string(text, end);
}

std::string quoted(const std::string& s) {
    std::string text = "\"";
    for (const char c : s) {
        if (c == '"' || c == '\\') {
            text += '\\';
            text += c;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            constexpr char kHex[] = "0123456789abcdef";
            text += "\\u00";
            text += kHex[c >> 4];
            text += kHex[c & 15];
        } else {
            text += c;
        }
    }
    return text + "\"";
}

std::string nameMember(const std::string& name) {
    return name.empty() ? "" : "\"name\":" + quoted(name) + ",";
}

std::string closed(std::string object) {
    if (object.back() == ',')
        object.pop_back();
    return object + "}";
}

size_t Parts::addView(const void* data, size_t byteCount, int target) {
    const size_t view =
        views.add("{\"buffer\":0,\"byteOffset\":" + std::to_string(binary.size()) +
                  ",\"byteLength\":" + std::to_string(byteCount) +
                  (target ? ",\"target\":" + std::to_string(target) : std::string()) + "}");
    const auto* begin = static_cast<const char*>(data);
    binary.insert(binary.end(), begin, begin + byteCount);
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    return view;
}

size_t Parts::addAccessor(const void* data, size_t count, int componentCount, ComponentType type,
                          int target, const std::string& bounds) {
    static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const size_t view = addView(data, count * size_t(componentCount) * 4, target);
    return accessors.add("{\"bufferView\":" + std::to_string(view) + ",\"componentType\":" +
                         std::to_string(type) + ",\"count\":" + std::to_string(count) +
                         ",\"type\":\"" + kTypes[componentCount] + "\"" + bounds + "}");
}

std::string Parts::emissionMembers(const glm::vec3& emission) {
    const float strongest = std::max({emission.x, emission.y, emission.z});
    if (strongest <= 0.0f)
        return "";
    if (strongest <= 1.0f)
        return "\"emissiveFactor\":" + numbers(emission, 3) + ",";
    float strength = 1.0f; // factors end at 1; a power of two divides without rounding
    while (strength < strongest && strength < 0x1p127f) // what is beyond, the reader refuses
        strength *= 2.0f;
    hasEmissiveStrength = true;
    return "\"emissiveFactor\":" + numbers(emission / strength, 3) +
           ",\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":" +
           number(strength) + "}},";
}

std::string Parts::head(const std::string& sceneName, const std::string& roots) const {
    std::string used, extensions;
    const auto use = [&](const char* name) {
        used += (used.empty() ? "\"" : ",\"") + std::string(name) + "\"";
    };
    if (!lights.empty()) {
        use("KHR_lights_punctual");
        extensions =
            ",\"extensions\":{\"KHR_lights_punctual\":{" + lights.member().substr(1) + "}}";
    }
    if (hasEmissiveStrength)
        use("KHR_materials_emissive_strength");
    if (hasTextureTransform)
        use("KHR_texture_transform");
    std::string json = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"ShadowDAG\"}";
    if (!used.empty())
        json += ",\"extensionsUsed\":[" + used + "]";
    json +=
        ",\"scene\":0,\"scenes\":[" +
        closed("{" + nameMember(sceneName) + (roots.empty() ? "" : "\"nodes\":[" + roots + "]")) +
        "]";
    json += nodes.member() + meshes.member() + materials.member() + textures.member() +
            samplers.member() + images.member() + cameras.member() + animations.member() +
            accessors.member() + views.member();
    if (!binary.empty())
        json += ",\"buffers\":[{\"byteLength\":" + std::to_string(binary.size()) + "}]";
    json += extensions + "}";
    json.resize((json.size() + 3) / 4 * 4, ' ');

    const auto word = [](uint64_t value) {
        return std::string{char(value), char(value >> 8), char(value >> 16), char(value >> 24)};
    };
    const uint64_t total = 12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
    std::string head = "glTF" + word(2) + word(total) + word(json.size()) + "JSON" + json;
    if (!binary.empty())
        head += word(binary.size()) + std::string("BIN\0", 4);
    return head;
}

} // namespace shadowdag::glb
