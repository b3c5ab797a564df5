// SPDX-License-Identifier: Apache-2.0
// A Scene as one .glb. Source: Khronos, glTF 2.0 specification; KHR_lights_punctual.
#include "scenes/gltf.h"

#include "cuda/error.h"
#include "scenes/glb_parts.h"
#include "scenes/output_file.h"
#include "scenes/png_alpha.h"

#include <algorithm>
#include <cmath>

namespace shadowdag::glb {

namespace {

class GlbWriter : private Parts {
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
    std::vector<int> materialOf_; // kNone: written as the absence of a material
    std::vector<int> meshOf_;     // kNone: an empty mesh, which glTF cannot hold
};

// Texture i holds mask i.
void GlbWriter::writeMasks() {
    static constexpr int kModes[] = {10497, 33648, 33071}; // repeat, mirrored repeat, clamp to edge
    for (const AlphaMask& mask : scene_.alphaMasks) {
        const std::vector<uint8_t> png = writePngMask(mask);
        const size_t view = addView(png.data(), png.size());
        const size_t image =
            images.add("{\"mimeType\":\"image/png\",\"bufferView\":" + std::to_string(view) + "}");
        const size_t sampler =
            samplers.add("{\"magFilter\":9728,\"minFilter\":9728,\"wrapS\":" + // nearest
                         std::to_string(kModes[uint32_t(mask.wrapU)]) +
                         ",\"wrapT\":" + std::to_string(kModes[uint32_t(mask.wrapV)]) + "}");
        textures.add("{\"sampler\":" + std::to_string(sampler) +
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
        text += emissionMembers(m.emission);
        materialOf_.push_back(int(materials.add(closed(text))));
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
            int(meshes.add(closed("{" + nameMember(mesh.name) + primitives.member().substr(1)))));
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
        lights.add(closed(text));
    }
    for (const CameraSource& camera : scene_.cameras)
        cameras.add(
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
        nodes.add(closed(text));
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
            animations.add("{" + nameMember(animation.name) + samplers.member().substr(1) +
                           channels.member() + "}");
    }
}

void GlbWriter::save(const std::string& path) {
    std::string roots;
    for (size_t i = 0; i < scene_.roots.size(); ++i)
        roots += (i ? "," : "") + std::to_string(scene_.roots[i]);
    const std::string begin = head(scene_.name, roots);
    if (begin.size() + binary.size() > kMaxGlbBytes)
        throw Error(ErrorKind::kResource,
                    path + ": " + std::to_string(begin.size() + binary.size()) +
                        " bytes; a .glb is limited to 4 GiB, write a smaller scene");
    OutputFile file(path);
    file.write(begin);
    file.write(binary.data(), binary.size());
    file.commit();
}

} // namespace

} // namespace shadowdag::glb

void shadowdag::writeGlb(const Scene& scene, const std::string& path) {
    if (std::any_of(scene.meshes.begin(), scene.meshes.end(),
                    [](const Mesh& mesh) { return mesh.deforms(); }))
        throw Error(ErrorKind::kUsage, "scene '" + scene.name +
                                           "' has skins or morph targets, which are not written; "
                                           "use the file that it was read from");
    if (!scene.textures.textures.empty())
        throw Error(ErrorKind::kUsage, "scene '" + scene.name +
                                           "' has base colour textures, which are not written; "
                                           "use the file that it was read from");
    glb::GlbWriter(scene).write(path);
}
