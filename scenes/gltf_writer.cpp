// SPDX-License-Identifier: Apache-2.0
// A Scene as one .glb. The JSON is written by hand: tinygltf's writer rounds numbers and keeps a
// second copy of everything. Source: Khronos, glTF 2.0 specification, sec. 4.4;
// KHR_lights_punctual; KHR_materials_emissive_strength.
#include "scenes/gltf.h"

#include "cuda/error.h"
#include "scenes/output_file.h"
#include "scenes/png_alpha.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>

namespace shadowdag {

namespace {

enum ComponentType { kFloat = 5126, kUint32 = 5125 };

std::string number(float value) {
    char text[32];
    // The shortest text that reads back as the same float.
    const auto end = std::to_chars(text, text + sizeof text, value).ptr;
    return std::string(text, end);
}

template <class Vector> std::string numbers(const Vector& v, int count) {
    std::string text = "[";
    for (int i = 0; i < count; ++i)
        text += (i ? "," : "") + number(v[i]);
    return text + "]";
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

// A JSON array that is left out when empty, as glTF demands.
class JsonArray {
public:
    explicit JsonArray(const char* key) : key_(key) {}
    size_t add(const std::string& element) {
        text_ += (count_ ? "," : "") + element;
        return count_++;
    }
    bool empty() const { return count_ == 0; }
    std::string member() const {
        return count_ ? ",\"" + std::string(key_) + "\":[" + text_ + "]" : std::string();
    }

private:
    const char* key_;
    std::string text_;
    size_t count_ = 0;
};

std::string strip(std::string object) { // "{a,b,}" to "{a,b}"
    if (object.back() == ',')
        object.pop_back();
    return object + "}";
}

class GlbWriter {
public:
    explicit GlbWriter(const Scene& scene) : scene_(scene) {}

    void write(const std::string& path) {
        writeMasks();
        writeMaterials();
        writeMeshes();
        writeLightsAndCameras();
        writeNodes();
        writeAnimations();
        save(path);
    }

private:
    size_t addAccessor(const void* data, size_t count, int componentCount, ComponentType type,
                       int target, const std::string& bounds) {
        static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
        const size_t bytes = count * size_t(componentCount) * 4;
        const size_t view =
            views_.add("{\"buffer\":0,\"byteOffset\":" + std::to_string(binary_.size()) +
                       ",\"byteLength\":" + std::to_string(bytes) +
                       (target ? ",\"target\":" + std::to_string(target) : std::string()) + "}");
        const auto* begin = static_cast<const char*>(data);
        binary_.insert(binary_.end(), begin,
                       begin + bytes); // all elements are multiples of 4 bytes
        return accessors_.add("{\"bufferView\":" + std::to_string(view) + ",\"componentType\":" +
                              std::to_string(type) + ",\"count\":" + std::to_string(count) +
                              ",\"type\":\"" + kTypes[componentCount] + "\"" + bounds + "}");
    }
    size_t addVectors(const std::vector<glm::vec4>& values, int componentCount) {
        std::vector<float> flat;
        flat.reserve(values.size() * size_t(componentCount));
        for (const glm::vec4& v : values)
            for (int c = 0; c < componentCount; ++c)
                flat.push_back(v[c]);
        return addAccessor(flat.data(), values.size(), componentCount, kFloat, 0, "");
    }

    void writeMasks();
    void writeMaterials();
    void writeMeshes();
    void writeLightsAndCameras();
    void writeNodes();
    void writeAnimations();
    void save(const std::string& path);

    const Scene& scene_;
    std::vector<char> binary_;
    JsonArray views_{"bufferViews"}, accessors_{"accessors"}, images_{"images"},
        samplers_{"samplers"}, textures_{"textures"}, materials_{"materials"}, meshes_{"meshes"},
        nodes_{"nodes"}, cameras_{"cameras"}, animations_{"animations"}, lights_{"lights"};
    std::vector<int> materialOf_; // kNone: written as the absence of a material
    std::vector<int> meshOf_;     // kNone: an empty mesh, which glTF cannot hold
    bool hasEmissiveStrength_ = false;
};

// Texture i holds mask i.
void GlbWriter::writeMasks() {
    static constexpr int kModes[] = {10497, 33648, 33071}; // repeat, mirrored repeat, clamp to edge
    for (const AlphaMask& mask : scene_.alphaMasks) {
        const std::vector<uint8_t> png = writePngMask(mask);
        const size_t view =
            views_.add("{\"buffer\":0,\"byteOffset\":" + std::to_string(binary_.size()) +
                       ",\"byteLength\":" + std::to_string(png.size()) + "}");
        binary_.insert(binary_.end(), png.begin(), png.end());
        binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
        const size_t image =
            images_.add("{\"mimeType\":\"image/png\",\"bufferView\":" + std::to_string(view) + "}");
        const size_t sampler =
            samplers_.add("{\"magFilter\":9728,\"minFilter\":9728,\"wrapS\":" + // nearest
                          std::to_string(kModes[uint32_t(mask.wrapU)]) +
                          ",\"wrapT\":" + std::to_string(kModes[uint32_t(mask.wrapV)]) + "}");
        textures_.add("{\"sampler\":" + std::to_string(sampler) +
                      ",\"source\":" + std::to_string(image) + "}");
    }
}

void GlbWriter::writeMaterials() {
    const Material standard;
    for (const Material& m : scene_.materials) {
        if (materialOf_.empty() && m.name.empty() && m.baseColor == standard.baseColor &&
            m.emission == standard.emission && m.alphaMask == kNone) {
            materialOf_.push_back(kNone);
            continue;
        }
        std::string text =
            "{" + nameMember(m.name) + "\"pbrMetallicRoughness\":{\"baseColorFactor\":" +
            numbers(glm::vec4(m.baseColor, 1.0f), 4) +
            (m.alphaMask == kNone
                 ? std::string()
                 : ",\"baseColorTexture\":{\"index\":" + std::to_string(m.alphaMask) + "}") +
            ",\"metallicFactor\":0,\"roughnessFactor\":1},\"doubleSided\":true,";
        if (m.alphaMask != kNone)
            text += "\"alphaMode\":\"MASK\",\"alphaCutoff\":0.5,";
        const float strongest = std::max({m.emission.x, m.emission.y, m.emission.z});
        if (strongest > 1.0f) { // factors end at 1; a power of two divides without rounding
            float strength = 1.0f;
            while (strength < strongest)
                strength *= 2.0f;
            hasEmissiveStrength_ = true;
            text += "\"emissiveFactor\":" + numbers(m.emission / strength, 3) +
                    ",\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":" +
                    number(strength) + "}},";
        } else if (strongest > 0.0f) {
            text += "\"emissiveFactor\":" + numbers(m.emission, 3) + ",";
        }
        materialOf_.push_back(int(materials_.add(strip(text))));
    }
}

void GlbWriter::writeMeshes() {
    for (const Mesh& mesh : scene_.meshes) {
        if (mesh.triangles.empty()) {
            meshOf_.push_back(kNone);
            continue;
        }
        Box bounds;
        for (const glm::vec3& p : mesh.positions)
            bounds.add(p);
        const size_t positions = addAccessor(
            mesh.positions.data(), mesh.positions.size(), 3, kFloat, 34962,
            ",\"min\":" + numbers(bounds.min, 3) + ",\"max\":" + numbers(bounds.max, 3));
        const size_t uv =
            mesh.uv.empty() ? 0 : addAccessor(mesh.uv.data(), mesh.uv.size(), 2, kFloat, 34962, "");
        // One primitive a run of equal materials: the order of triangles is kept.
        JsonArray primitives("primitives");
        for (size_t first = 0, end; first < mesh.triangles.size(); first = end) {
            const uint32_t material = mesh.triangleMaterial[first];
            for (end = first;
                 end < mesh.triangles.size() && mesh.triangleMaterial[end] == material;)
                ++end;
            const size_t indices =
                addAccessor(&mesh.triangles[first], 3 * (end - first), 1, kUint32, 34963, "");
            const bool hasUv = !mesh.uv.empty() && scene_.materials[material].alphaMask != kNone;
            primitives.add("{\"attributes\":{\"POSITION\":" + std::to_string(positions) +
                           (hasUv ? ",\"TEXCOORD_0\":" + std::to_string(uv) : std::string()) +
                           "},\"indices\":" + std::to_string(indices) +
                           (materialOf_[material] == kNone
                                ? std::string()
                                : ",\"material\":" + std::to_string(materialOf_[material])) +
                           "}");
        }
        meshOf_.push_back(
            int(meshes_.add(strip("{" + nameMember(mesh.name) + primitives.member().substr(1)))));
    }
}

void GlbWriter::writeLightsAndCameras() {
    for (const LightSource& light : scene_.lights) {
        std::string text = "{" + nameMember(light.name) + "\"color\":" + numbers(light.color, 3) +
                           ",\"intensity\":" + number(light.intensity) + ",";
        if (light.rangeWorld > 0.0f)
            text += "\"range\":" + number(light.rangeWorld) + ",";
        if (light.kind == Light::kSpot)
            text +=
                "\"type\":\"spot\",\"spot\":{\"innerConeAngle\":" + number(light.innerConeAngle) +
                ",\"outerConeAngle\":" + number(light.outerConeAngle) + "}";
        else
            text += light.kind == Light::kSun ? "\"type\":\"directional\"" : "\"type\":\"point\"";
        lights_.add(strip(text));
    }
    for (const CameraSource& camera : scene_.cameras)
        cameras_.add(
            "{" + nameMember(camera.name) + "\"type\":\"perspective\",\"perspective\":{\"yfov\":" +
            number(camera.yfov) + ",\"znear\":" + number(camera.znear) +
            (std::isfinite(camera.zfar) ? ",\"zfar\":" + number(camera.zfar) : std::string()) +
            "}}");
}

void GlbWriter::writeNodes() {
    for (const Node& node : scene_.nodes) {
        std::string text = "{" + nameMember(node.name);
        const LocalTransform& local = node.local;
        if (local.hasMatrix) {
            text += "\"matrix\":[";
            for (int m = 0; m < 16; ++m)
                text += (m ? "," : "") + number(local.matrix[m / 4][m % 4]);
            text += "],";
        } else {
            if (local.translation != glm::vec3(0.0f))
                text += "\"translation\":" + numbers(local.translation, 3) + ",";
            const glm::quat& q = local.rotation;
            if (q != glm::quat(1, 0, 0, 0))
                text += "\"rotation\":" + numbers(glm::vec4(q.x, q.y, q.z, q.w), 4) + ",";
            if (local.scale != glm::vec3(1.0f))
                text += "\"scale\":" + numbers(local.scale, 3) + ",";
        }
        if (node.mesh != kNone && meshOf_[size_t(node.mesh)] != kNone)
            text += "\"mesh\":" + std::to_string(meshOf_[size_t(node.mesh)]) + ",";
        if (node.camera != kNone)
            text += "\"camera\":" + std::to_string(node.camera) + ",";
        if (!node.children.empty()) {
            text += "\"children\":[";
            for (size_t i = 0; i < node.children.size(); ++i)
                text += (i ? "," : "") + std::to_string(node.children[i]);
            text += "],";
        }
        if (node.light != kNone)
            text +=
                "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" + std::to_string(node.light) +
                "}},";
        nodes_.add(strip(text));
    }
}

void GlbWriter::writeAnimations() {
    static constexpr const char* kPaths[] = {"translation", "rotation", "scale"};
    static constexpr const char* kInterpolations[] = {"STEP", "LINEAR", "CUBICSPLINE"};
    for (const Animation& animation : scene_.animations) {
        JsonArray samplers("samplers"), channels("channels");
        for (const AnimationChannel& channel : animation.channels) {
            const size_t input =
                addAccessor(channel.times.data(), channel.times.size(), 1, kFloat, 0,
                            ",\"min\":[" + number(channel.times.front()) + "],\"max\":[" +
                                number(channel.times.back()) + "]");
            const size_t output = addVectors(
                channel.values, channel.path == AnimationChannel::Path::kRotation ? 4 : 3);
            const size_t sampler = samplers.add(
                "{\"input\":" + std::to_string(input) + ",\"output\":" + std::to_string(output) +
                ",\"interpolation\":\"" + kInterpolations[int(channel.interpolation)] + "\"}");
            channels.add("{\"sampler\":" + std::to_string(sampler) +
                         ",\"target\":{\"node\":" + std::to_string(channel.node) + ",\"path\":\"" +
                         kPaths[int(channel.path)] + "\"}}");
        }
        if (!channels.empty())
            animations_.add("{" + nameMember(animation.name) + samplers.member().substr(1) +
                            channels.member() + "}");
    }
}

void GlbWriter::save(const std::string& path) {
    std::string used, extensions;
    if (!lights_.empty()) {
        used = "\"KHR_lights_punctual\"";
        extensions =
            ",\"extensions\":{\"KHR_lights_punctual\":{" + lights_.member().substr(1) + "}}";
    }
    if (hasEmissiveStrength_)
        used += (used.empty() ? "" : ",") + std::string("\"KHR_materials_emissive_strength\"");
    std::string json = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"ShadowDAG\"}";
    if (!used.empty())
        json += ",\"extensionsUsed\":[" + used + "]";
    std::string roots;
    for (size_t i = 0; i < scene_.roots.size(); ++i)
        roots += (i ? "," : "") + std::to_string(scene_.roots[i]);
    json +=
        ",\"scene\":0,\"scenes\":[" +
        strip("{" + nameMember(scene_.name) + (roots.empty() ? "" : "\"nodes\":[" + roots + "]")) +
        "]";
    json += nodes_.member() + meshes_.member() + materials_.member() + textures_.member() +
            samplers_.member() + images_.member() + cameras_.member() + animations_.member() +
            accessors_.member() + views_.member();
    if (!binary_.empty())
        json += ",\"buffers\":[{\"byteLength\":" + std::to_string(binary_.size()) + "}]";
    json += extensions + "}";
    json.resize((json.size() + 3) / 4 * 4, ' ');

    const uint64_t total = 12 + 8 + json.size() + (binary_.empty() ? 0 : 8 + binary_.size());
    if (total > 0xffffffffu)
        throw Error(ErrorKind::kResource,
                    path + ": " + std::to_string(total) +
                        " bytes; a .glb is limited to 4 GiB, write a smaller scene");
    OutputFile file(path);
    const auto word = [&](uint64_t value) {
        const unsigned char bytes[4] = {
            static_cast<unsigned char>(value), static_cast<unsigned char>(value >> 8),
            static_cast<unsigned char>(value >> 16), static_cast<unsigned char>(value >> 24)};
        file.write(bytes, 4);
    };
    file.write("glTF", 4);
    word(2);
    word(total);
    word(json.size());
    file.write("JSON", 4);
    file.write(json);
    if (!binary_.empty()) {
        word(binary_.size());
        file.write("BIN\0", 4);
        file.write(binary_.data(), binary_.size());
    }
    file.commit();
}

} // namespace

void writeGlb(const Scene& scene, const std::string& path) {
    if (!scene.textures.textures.empty())
        throw Error(ErrorKind::kUsage, "scene '" + scene.name +
                                           "' has base colour textures, which are not written; "
                                           "use the file that it was read from");
    GlbWriter(scene).write(path);
}

} // namespace shadowdag
