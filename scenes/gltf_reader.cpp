// SPDX-License-Identifier: Apache-2.0
// From a loaded glTF document to a Scene: materials, meshes, the node forest, lights, cameras,
// animations. Source: Khronos, glTF 2.0 specification; KHR_lights_punctual;
// KHR_materials_emissive_strength. Over 500 lines because the chapters share one state, what was
// ignored is counted over all of them, and half of it are messages.
#include "scenes/gltf_reader.h"

#include "cuda/error.h"
#include "scenes/camera.h"
#include "scenes/printable.h"
#include "scenes/scene_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <new>

namespace shadowdag {

namespace {

using gltf::AccessorReader;
using gltf::Document;
using gltf::fail;

constexpr double kMaxMagnitude = 1e30;  // as World; its square is a finite double
constexpr float kMaxRangeWorld = 1e18f; // its square is a finite float

std::string numbered(const char* kind, size_t index) {
    return kind + std::to_string(index);
}

// std::to_string would show a tiny number as 0, and a huge one with 309 digits.
std::string shortText(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

class SceneReader {
public:
    SceneReader(const std::string& path, GltfSource source)
        : document_(gltf::loadDocument(path, std::move(source.bytes))), accessors_(document_) {
        document_.opacityMaps = std::move(source.opacityMaps);
        scene_.warnings = std::move(source.warnings);
    }

    Scene read() {
        scene_.name = std::filesystem::path(document_.path).stem().string();
        readMaterials();
        for (size_t i = 0; i < model().meshes.size(); ++i)
            readMesh(i);
        scene_.skins = gltf::readSkins(document_, accessors_);
        readLights();
        readCameras();
        readNodes();
        readRoots();
        for (size_t i = 0; i < model().animations.size(); ++i)
            readAnimation(i);
        hideNodes(); // last: animations are checked against meshes
        writeWarnings();
        return std::move(scene_);
    }

private:
    const tinygltf::Model& model() const { return document_.model; }

    float checkedFloat(double value, const std::string& place) const {
        if (!(std::fabs(value) <= kMaxMagnitude))
            fail(document_, place, shortText(value) + " is not a number within 1e30");
        return float(value);
    }
    float checkedPositiveOrZero(double value, const std::string& place) const {
        if (value < 0.0)
            fail(document_, place, shortText(value) + " is negative");
        return checkedFloat(value, place);
    }
    /// Returns `fallback` for an absent array; throws when it has another length than N.
    template <int N>
    glm::vec<N, float> vectorOr(const std::vector<double>& values,
                                const glm::vec<N, float>& fallback,
                                const std::string& place) const {
        if (values.empty())
            return fallback;
        if (values.size() != size_t(N))
            fail(document_, place,
                 std::to_string(values.size()) + " numbers instead of " + std::to_string(N));
        glm::vec<N, float> v;
        for (int i = 0; i < N; ++i)
            v[i] = checkedFloat(values[size_t(i)], place);
        return v;
    }

    void readMaterials();
    int uvAccessorOf(const tinygltf::Primitive& primitive);
    const gltf::UvMapping* uvMappingOf(int material) const;
    void appendUv(int accessor, const gltf::UvMapping* mapping, size_t vertexCount,
                  const std::vector<uint32_t>& used, const std::string& place,
                  std::vector<glm::vec2>& uv);
    void readMesh(size_t index);
    void readDeformation(size_t node);
    void checkWeights(const std::vector<double>& weights, size_t targetCount,
                      const std::string& place, std::vector<float>& out) const;
    void readLights();
    void readCameras();
    void readNodes();
    void hideNodes();
    void readRoots();
    void readAnimation(size_t index);
    void writeWarnings();

    Document document_;
    AccessorReader accessors_;
    gltf::MaterialMasks masks_;
    gltf::MaterialTextures textures_;
    Scene scene_;
    std::vector<int> cameraOf_; // model camera to scene camera; kNone for orthographic ones
    std::vector<uint32_t> jointCountOf_; // by mesh: the joints that a skin of it needs

    // What was ignored.
    uint64_t orthographicCount_ = 0, lineAndPointCount_ = 0, noPositionCount_ = 0;
    uint64_t channelCount_ = 0, translucentCount_ = 0, instancingCount_ = 0;
    uint64_t incompleteCount_ = 0, noUvCount_ = 0, noTextureUvCount_ = 0, vertexAlphaCount_ = 0;
};

void SceneReader::readMaterials() {
    masks_ = gltf::readMaterialMasks(document_, accessors_, scene_.alphaMasks);
    textures_ = gltf::readBaseColorTextures(document_, accessors_, masks_, scene_.textures);
    for (const OpacityMap& map : document_.opacityMaps)
        if (map.texture >= 0 && size_t(map.texture) < textures_.isTextureUsed.size())
            textures_.isTextureUsed[size_t(map.texture)] = 1;
    scene_.materials.emplace_back(); // 0: primitives without a material
    for (size_t i = 0; i < model().materials.size(); ++i) {
        const tinygltf::Material& source = model().materials[i];
        const std::string place = numbered("materials/", i);
        Material material;
        material.name = source.name;
        material.baseColor = glm::vec3(vectorOr<4>(source.pbrMetallicRoughness.baseColorFactor,
                                                   glm::vec4(1.0f), place + "/baseColorFactor"));
        material.baseColor *= textures_.materials[i].color;
        material.baseColorTexture = textures_.materials[i].texture;
        material.emission =
            vectorOr<3>(source.emissiveFactor, glm::vec3(0.0f), place + "/emissiveFactor");
        const auto strength = source.extensions.find("KHR_materials_emissive_strength");
        if (strength != source.extensions.end() && strength->second.Has("emissiveStrength"))
            material.emission *=
                checkedPositiveOrZero(strength->second.Get("emissiveStrength").GetNumberAsDouble(),
                                      place + "/extensions/KHR_materials_emissive_strength");
        for (int c = 0; c < 3; ++c)
            if (!(std::fabs(material.emission[c]) <= float(kMaxMagnitude)))
                fail(document_, place,
                     "its emission is " + std::to_string(material.emission[c]) +
                         ", not within 1e30; lower it");
        material.alphaMask = masks_.materials[i].mask;
        const auto transmission = source.extensions.find("KHR_materials_transmission");
        translucentCount_ +=
            source.alphaMode == "BLEND" ||
            (transmission != source.extensions.end() &&
             transmission->second.Has("transmissionFactor") &&
             transmission->second.Get("transmissionFactor").GetNumberAsDouble() > 0);
        scene_.materials.push_back(std::move(material));
    }
}

// Returns how the texture coordinates of a material of the document are read; null if neither its
// mask nor its colour has a texture.
const gltf::UvMapping* SceneReader::uvMappingOf(int material) const {
    if (material == -1)
        return nullptr;
    const gltf::MaterialMask& mask = masks_.materials[size_t(material)];
    if (mask.mask != kNone && mask.needsUv)
        return &mask.uv;
    const gltf::MaterialTexture& texture = textures_.materials[size_t(material)];
    return texture.texture == kNone ? nullptr : &texture.uv;
}

// Returns the accessor with the texture coordinates of a primitive; kNone if its material needs
// none or the primitive has none.
int SceneReader::uvAccessorOf(const tinygltf::Primitive& primitive) {
    const bool isMasked =
        primitive.material != -1 && masks_.materials[size_t(primitive.material)].mask != kNone;
    if (isMasked)
        vertexAlphaCount_ += primitive.attributes.count("COLOR_0");
    const gltf::UvMapping* const mapping = uvMappingOf(primitive.material);
    if (mapping == nullptr)
        return kNone;
    const auto uv = primitive.attributes.find("TEXCOORD_" + std::to_string(mapping->texCoord));
    if (uv != primitive.attributes.end())
        return uv->second;
    ++(isMasked ? noUvCount_ : noTextureUvCount_);
    return kNone;
}

// Appends the triangles of one primitive to `out`, as indices into its POSITION accessor. Source:
// glTF 2.0, sec. 3.7.2.1, "Topology Types". An incomplete last triangle is left out.
void assembleTriangles(int mode, const std::vector<uint32_t>& v, std::vector<glm::uvec3>& out) {
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        for (size_t i = 0; i + 2 < v.size(); i += 3)
            out.emplace_back(v[i], v[i + 1], v[i + 2]);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
        for (size_t i = 0; i + 2 < v.size(); ++i)
            out.emplace_back(v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]);
    } else {
        for (size_t i = 0; i + 2 < v.size(); ++i)
            out.emplace_back(v[i + 1], v[i + 2], v[0]);
    }
}

// Appends the texture coordinates of the vertices in use; zeros without an accessor.
void SceneReader::appendUv(int accessor, const gltf::UvMapping* mapping, size_t vertexCount,
                           const std::vector<uint32_t>& used, const std::string& place,
                           std::vector<glm::vec2>& uv) {
    accessors_.charge(used.size() * sizeof(glm::vec2), place);
    if (accessor == kNone) {
        uv.resize(uv.size() + used.size(), glm::vec2(0.0f));
        return;
    }
    const std::vector<float>& authored = accessors_.sharedFloats(accessor, 2, place);
    if (authored.size() != 2 * vertexCount)
        fail(document_, place,
             std::to_string(authored.size() / 2) + " of them for " + std::to_string(vertexCount) +
                 " vertices");
    for (const uint32_t v : used) {
        const glm::dvec3 point(authored[2 * size_t(v)], authored[2 * size_t(v) + 1], 1.0);
        const glm::dvec3 mapped = mapping->uvFromAuthored * point;
        uv.emplace_back(checkedFloat(mapped.x, place), checkedFloat(mapped.y, place));
    }
}

void SceneReader::readMesh(size_t index) {
    const tinygltf::Mesh& source = model().meshes[index];
    Mesh mesh;
    mesh.name = source.name;

    // Primitives that share a POSITION accessor share its vertices, unless their materials have
    // different texture coordinates; only those in use are kept, because some exporters put a whole
    // scene into one accessor.
    struct Group {
        int accessor;
        int uvAccessor;                   // kNone: no material needs one yet
        const gltf::UvMapping* uvMapping; // of that material
        gltf::DeformAccessors deform;
        std::vector<glm::uvec3> triangles;
        std::vector<size_t> slots; // where each goes in the mesh
    };
    std::vector<Group> groups;
    bool isUvNeeded = false;
    for (size_t p = 0; p < source.primitives.size(); ++p) {
        const tinygltf::Primitive& primitive = source.primitives[p];
        const std::string place = numbered("meshes/", index) + numbered("/primitives/", p);
        if (primitive.mode < TINYGLTF_MODE_POINTS || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
            fail(document_, place, "mode " + std::to_string(primitive.mode) + " does not exist");
        if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
            ++lineAndPointCount_;
            continue;
        }
        const auto position = primitive.attributes.find("POSITION");
        if (position == primitive.attributes.end()) {
            ++noPositionCount_;
            continue;
        }
        int material = 0;
        if (primitive.material != -1) {
            if (primitive.material < 0 || size_t(primitive.material) >= model().materials.size())
                fail(document_, place,
                     "refers to material " + std::to_string(primitive.material) + " of " +
                         std::to_string(model().materials.size()));
            material = primitive.material + 1;
        }
        const size_t vertexCount =
            accessors_.readPositions(position->second, place + "/attributes/POSITION").size();
        if (vertexCount > std::numeric_limits<uint32_t>::max())
            fail(document_, place, std::to_string(vertexCount) + " vertices are too many");
        std::vector<uint32_t> corners;
        if (primitive.indices != -1) {
            corners = accessors_.readIndices(primitive.indices, place + "/indices");
            for (size_t i = 0; i < corners.size(); ++i)
                if (corners[i] >= vertexCount)
                    fail(document_, place,
                         "index " + std::to_string(i) + " is " + std::to_string(corners[i]) +
                             ", but there are " + std::to_string(vertexCount) + " vertices");
        } else {
            accessors_.charge(vertexCount * sizeof(uint32_t), place);
            corners.resize(vertexCount);
            for (size_t i = 0; i < vertexCount; ++i)
                corners[i] = uint32_t(i);
        }
        const bool isList = primitive.mode == TINYGLTF_MODE_TRIANGLES;
        if (corners.size() < 3 || (isList && corners.size() % 3 != 0))
            ++incompleteCount_;
        const int uv = uvAccessorOf(primitive);
        const gltf::UvMapping* mapping = uv == kNone ? nullptr : uvMappingOf(primitive.material);
        if (uv != kNone)
            isUvNeeded = true;
        const gltf::DeformAccessors deform = gltf::readDeformAccessors(document_, primitive, place);
        if (!groups.empty() && groups.front().deform.targets.size() != deform.targets.size())
            fail(document_, place,
                 "has " + std::to_string(deform.targets.size()) +
                     " morph targets, another primitive of its mesh has " +
                     std::to_string(groups.front().deform.targets.size()));
        if (!groups.empty() && groups.front().deform.joints.empty() != deform.joints.empty())
            fail(document_, place,
                 "only some primitives of its mesh have JOINTS_0; a skin needs it on every one");
        auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
            return g.accessor == position->second && g.deform == deform &&
                   (uv == kNone || g.uvAccessor == kNone ||
                    (g.uvAccessor == uv && g.uvMapping->uvFromAuthored == mapping->uvFromAuthored));
        });
        if (group == groups.end()) {
            groups.push_back({position->second, kNone, nullptr, deform, {}, {}});
            group = groups.end() - 1;
        }
        if (uv != kNone) {
            group->uvAccessor = uv;
            group->uvMapping = mapping;
        }
        // A triangle and its material, and a vertex that may be its own.
        accessors_.charge((isList ? corners.size() / 3 : corners.size()) * 28 + corners.size() * 12,
                          place);
        const size_t before = group->triangles.size();
        assembleTriangles(primitive.mode, corners, group->triangles);
        const size_t added = group->triangles.size() - before;
        for (size_t i = 0; i < added; ++i) {
            group->slots.push_back(mesh.triangleMaterial.size());
            mesh.triangleMaterial.push_back(uint32_t(material));
        }
    }

    for (const Group& group : groups) {
        mesh.jointsPerVertex =
            std::max(mesh.jointsPerVertex, uint32_t(4 * group.deform.joints.size()));
        mesh.morphTargets.resize(group.deform.targets.size());
    }
    mesh.morphWeights.assign(mesh.morphTargets.size(), 0.0f);
    checkWeights(source.weights, mesh.morphTargets.size(), numbered("meshes/", index) + "/weights",
                 mesh.morphWeights);
    mesh.triangles.resize(mesh.triangleMaterial.size());
    for (Group& group : groups) {
        const std::vector<glm::vec3>& positions =
            accessors_.readPositions(group.accessor, numbered("meshes/", index));
        std::vector<uint32_t> used;
        used.reserve(3 * group.triangles.size());
        for (const glm::uvec3& t : group.triangles)
            used.insert(used.end(), {t.x, t.y, t.z});
        std::sort(used.begin(), used.end());
        used.erase(std::unique(used.begin(), used.end()), used.end());
        const uint32_t first = uint32_t(mesh.positions.size());
        for (uint32_t v : used)
            mesh.positions.push_back(positions[v]);
        if (isUvNeeded)
            appendUv(group.uvAccessor, group.uvMapping, positions.size(), used,
                     numbered("meshes/", index) + " (texture coordinates)", mesh.uv);
        gltf::appendDeformation(document_, accessors_, group.deform, positions.size(), used,
                                numbered("meshes/", index), mesh);
        const bool areAllUsed = used.size() == positions.size();
        const auto compacted = [&](uint32_t v) {
            if (areAllUsed)
                return first + v;
            return first + uint32_t(std::lower_bound(used.begin(), used.end(), v) - used.begin());
        };
        for (size_t i = 0; i < group.triangles.size(); ++i) {
            const glm::uvec3& t = group.triangles[i];
            mesh.triangles[group.slots[i]] = {compacted(t.x), compacted(t.y), compacted(t.z)};
        }
    }
    uint32_t jointCount = 0;
    for (const JointWeight& joint : mesh.jointWeights)
        jointCount = std::max(jointCount, joint.joint + 1);
    jointCountOf_.push_back(jointCount);
    scene_.meshes.push_back(std::move(mesh));
}

// Sets weights of morph targets, if the file states them.
void SceneReader::checkWeights(const std::vector<double>& weights, size_t targetCount,
                               const std::string& place, std::vector<float>& out) const {
    if (weights.empty() || targetCount == 0)
        return;
    if (weights.size() != targetCount)
        fail(document_, place,
             std::to_string(weights.size()) + " weights for " + std::to_string(targetCount) +
                 " morph targets");
    out.clear();
    for (const double weight : weights)
        out.push_back(checkedFloat(weight, place));
}

// Reads what deforms the mesh of a node.
void SceneReader::readDeformation(size_t index) {
    const tinygltf::Node& source = model().nodes[index];
    const std::string place = numbered("nodes/", index);
    Node& node = scene_.nodes[index];
    if (node.mesh == kNone)
        return;
    const Mesh& mesh = scene_.meshes[size_t(node.mesh)];
    checkWeights(source.weights, mesh.morphTargets.size(), place + "/weights", node.morphWeights);
    if (source.skin == -1 || mesh.triangles.empty())
        return;
    if (source.skin < 0 || size_t(source.skin) >= scene_.skins.size())
        fail(document_, place + "/skin",
             "refers to skin " + std::to_string(source.skin) + " of " +
                 std::to_string(scene_.skins.size()));
    const size_t jointCount = scene_.skins[size_t(source.skin)].joints.size();
    if (mesh.jointsPerVertex == 0)
        fail(document_, place + "/skin",
             "mesh " + std::to_string(node.mesh) +
                 " has no JOINTS_0 and WEIGHTS_0, by which it would follow the joints; export it "
                 "with them, or without the skin");
    if (jointCountOf_[size_t(node.mesh)] > jointCount)
        fail(document_, place + "/skin",
             "mesh " + std::to_string(node.mesh) + " refers to joint " +
                 std::to_string(jointCountOf_[size_t(node.mesh)] - 1) + " of skin " +
                 std::to_string(source.skin) + ", which has " + std::to_string(jointCount));
    node.skin = source.skin;
}

void SceneReader::readLights() {
    for (size_t i = 0; i < model().lights.size(); ++i) {
        const tinygltf::Light& source = model().lights[i];
        const std::string place = numbered("KHR_lights_punctual/lights/", i);
        if (source.type != "point" && source.type != "spot" && source.type != "directional")
            fail(document_, place + "/type",
                 "'" + source.type.substr(0, 40) + "' is not a kind of light");
        LightSource light;
        light.name = source.name;
        light.color = vectorOr<3>(source.color, glm::vec3(1.0f), place + "/color");
        light.intensity = checkedPositiveOrZero(source.intensity, place + "/intensity");
        for (int c = 0; c < 3; ++c) {
            checkedPositiveOrZero(light.color[c], place + "/color");
            if (!(light.color[c] * light.intensity <= kMaxMagnitude))
                fail(document_, place, "color times intensity exceeds 1e30");
        }
        if (source.type == "directional")
            light.kind = Light::kSun; // the extension gives it no range
        else
            light.rangeWorld = checkedPositiveOrZero(source.range, place + "/range");
        if (light.rangeWorld > kMaxRangeWorld)
            fail(document_, place + "/range", shortText(source.range) + " exceeds 1e18 metres");
        if (source.type == "spot") {
            light.kind = Light::kSpot;
            const double inner = source.spot.innerConeAngle, outer = source.spot.outerConeAngle;
            // Exporters write a sharp cone as equal angles, and half a turn with the rounding of
            // float.
            if (!(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= 1.5708))
                fail(document_, place + "/spot",
                     "cone angles " + std::to_string(inner) + " and " + std::to_string(outer) +
                         "; needed: 0 <= inner < outer <= pi / 2");
            light.innerConeAngle = float(inner);
            light.outerConeAngle = float(outer);
        }
        scene_.lights.push_back(std::move(light));
    }
}

void SceneReader::readCameras() {
    for (size_t i = 0; i < model().cameras.size(); ++i) {
        const tinygltf::Camera& source = model().cameras[i];
        const std::string place = numbered("cameras/", i);
        if (source.type == "orthographic") {
            ++orthographicCount_;
            cameraOf_.push_back(kNone);
            continue;
        }
        if (source.type != "perspective")
            fail(document_, place + "/type",
                 "'" + source.type.substr(0, 40) + "' is not a kind of camera");
        CameraSource camera;
        camera.name = source.name;
        camera.yfov = checkedFloat(source.perspective.yfov, place + "/yfov");
        camera.znear = checkedFloat(source.perspective.znear, place + "/znear");
        camera.zfar = checkedFloat(source.perspective.zfar, place + "/zfar");
        if (!(camera.yfov > 0.0f && camera.yfov < 3.1415925f))
            fail(document_, place + "/yfov",
                 std::to_string(camera.yfov) + " is not within 0 and pi");
        const float yfov = std::clamp(camera.yfov, kMinFieldOfView, kMaxFieldOfView);
        if (yfov != camera.yfov)
            scene_.warnings.push_back(place + "/yfov: " + shortText(source.perspective.yfov) +
                                      " rad is " + (yfov > camera.yfov ? "widened" : "narrowed") +
                                      " to " + shortText(yfov) + ".");
        camera.yfov = yfov;
        if (!(camera.znear > 0.0f))
            fail(document_, place + "/znear", std::to_string(camera.znear) + " is not above 0");
        if (camera.zfar == 0.0f)
            camera.zfar = std::numeric_limits<float>::infinity(); // absent
        if (!(camera.zfar > camera.znear))
            fail(document_, place + "/zfar", std::to_string(camera.zfar) + " is not above znear");
        cameraOf_.push_back(int(scene_.cameras.size()));
        scene_.cameras.push_back(std::move(camera));
    }
}

void SceneReader::readNodes() {
    const auto& nodes = model().nodes;
    const auto checkIndex = [&](int index, size_t count, const std::string& place,
                                const char* kind) {
        if (index < 0 || size_t(index) >= count)
            fail(document_, place,
                 std::string("refers to ") + kind + " " + std::to_string(index) + " of " +
                     std::to_string(count));
        return index;
    };
    scene_.nodes.resize(nodes.size());
    for (size_t i = 0; i < nodes.size(); ++i) {
        const tinygltf::Node& source = nodes[i];
        const std::string place = numbered("nodes/", i);
        Node& node = scene_.nodes[i];
        node.name = source.name;

        LocalTransform& local = node.local;
        if (!source.matrix.empty()) {
            if (source.matrix.size() != 16)
                fail(document_, place + "/matrix",
                     std::to_string(source.matrix.size()) + " numbers instead of 16");
            local.hasMatrix = true;
            for (int m = 0; m < 16; ++m)
                local.matrix[m / 4][m % 4] =
                    checkedFloat(source.matrix[size_t(m)], place + "/matrix");
            for (int c = 0; c < 4; ++c) {
                const float expected = c == 3 ? 1.0f : 0.0f;
                if (std::fabs(local.matrix[c][3] - expected) > 1e-5f)
                    fail(document_, place + "/matrix",
                         "the bottom row holds " + std::to_string(local.matrix[c][3]) +
                             " instead of " + std::to_string(expected) +
                             "; projections cannot place nodes");
                local.matrix[c][3] = expected;
            }
        }
        local.translation =
            vectorOr<3>(source.translation, local.translation, place + "/translation");
        local.scale = vectorOr<3>(source.scale, local.scale, place + "/scale");
        const glm::vec4 q =
            vectorOr<4>(source.rotation, glm::vec4(0, 0, 0, 1), place + "/rotation");
        if (!(glm::dot(glm::dvec4(q), glm::dvec4(q)) > 1e-12))
            fail(document_, place + "/rotation", "the quaternion is zero");
        local.rotation = glm::quat(q.w, q.x, q.y, q.z);

        if (source.mesh != -1)
            node.mesh = checkIndex(source.mesh, model().meshes.size(), place + "/mesh", "mesh");
        readDeformation(i);
        if (source.camera != -1)
            node.camera = cameraOf_[size_t(
                checkIndex(source.camera, cameraOf_.size(), place + "/camera", "camera"))];
        const auto punctual = source.extensions.find("KHR_lights_punctual");
        if (punctual != source.extensions.end()) {
            const tinygltf::Value& light = punctual->second.Get("light");
            if (!light.IsInt())
                fail(document_, place + "/KHR_lights_punctual", "\"light\" is not an integer");
            node.light = checkIndex(light.GetNumberAsInt(), scene_.lights.size(),
                                    place + "/KHR_lights_punctual", "light");
        }
        if (source.extensions.count("EXT_mesh_gpu_instancing"))
            ++instancingCount_;
        for (int child : source.children) {
            checkIndex(child, nodes.size(), place + "/children", "node");
            if (scene_.nodes[size_t(child)].parent != kNone)
                fail(document_, place + "/children",
                     "node " + std::to_string(child) + " has another parent, node " +
                         std::to_string(scene_.nodes[size_t(child)].parent));
            scene_.nodes[size_t(child)].parent = int(i);
            node.children.push_back(child);
        }
    }
    // With one parent at most, a node that no parentless node reaches lies on or below a loop.
    std::vector<int> stack;
    for (size_t i = 0; i < nodes.size(); ++i)
        if (scene_.nodes[i].parent == kNone)
            stack.push_back(int(i));
    std::vector<bool> isReached(nodes.size());
    while (!stack.empty()) {
        const int node = stack.back();
        stack.pop_back();
        isReached[size_t(node)] = true;
        stack.insert(stack.end(), scene_.nodes[size_t(node)].children.begin(),
                     scene_.nodes[size_t(node)].children.end());
    }
    const auto lost = std::find(isReached.begin(), isReached.end(), false);
    if (lost != isReached.end())
        fail(document_, numbered("nodes/", size_t(lost - isReached.begin())),
             "lies on or below a loop of parents");
}

// Nodes that KHR_node_visibility makes invisible, and all below them, lose their meshes and lights.
void SceneReader::hideNodes() {
    const auto isInvisible = [&](size_t node) {
        const auto& extensions = model().nodes[node].extensions;
        const auto visibility = extensions.find("KHR_node_visibility");
        if (visibility == extensions.end() || !visibility->second.Has("visible"))
            return false;
        const tinygltf::Value& isVisible = visibility->second.Get("visible");
        if (!isVisible.IsBool())
            fail(document_, numbered("nodes/", node) + "/KHR_node_visibility",
                 "\"visible\" is neither true nor false");
        return !isVisible.Get<bool>();
    };
    std::vector<int> hidden;
    for (size_t i = 0; i < scene_.nodes.size(); ++i)
        if (isInvisible(i))
            hidden.push_back(int(i));
    std::vector<bool> isHidden(scene_.nodes.size());
    while (!hidden.empty()) {
        const size_t i = size_t(hidden.back());
        hidden.pop_back();
        if (isHidden[i])
            continue;
        isHidden[i] = true;
        Node& node = scene_.nodes[i];
        node.mesh = node.light = node.skin = kNone;
        node.morphWeights.clear();
        hidden.insert(hidden.end(), node.children.begin(), node.children.end());
    }
    for (Animation& animation : scene_.animations)
        std::erase_if(animation.channels, [&](const AnimationChannel& channel) {
            return channel.path == AnimationChannel::Path::kMorphWeight &&
                   isHidden[size_t(channel.node)];
        });
    std::erase_if(scene_.animations,
                  [](const Animation& animation) { return animation.channels.empty(); });
}

void SceneReader::readRoots() {
    const auto& scenes = model().scenes;
    if (scenes.empty()) {
        if (model().defaultScene != -1)
            fail(document_, "scene",
                 std::to_string(model().defaultScene) + ", but there are no scenes");
        // Without a default scene or a list of scenes, everything is shown.
        for (size_t i = 0; i < scene_.nodes.size(); ++i)
            if (scene_.nodes[i].parent == kNone)
                scene_.roots.push_back(int(i));
        return;
    }
    const int index = model().defaultScene == -1 ? 0 : model().defaultScene;
    if (index < 0 || size_t(index) >= scenes.size())
        fail(document_, "scene",
             std::to_string(index) + ", but there are " + std::to_string(scenes.size()) +
                 " scenes");
    const std::string place = numbered("scenes/", size_t(index)) + "/nodes";
    std::vector<bool> isTaken(scene_.nodes.size());
    for (int root : scenes[size_t(index)].nodes) {
        if (root < 0 || size_t(root) >= scene_.nodes.size())
            fail(document_, place,
                 "refers to node " + std::to_string(root) + " of " +
                     std::to_string(scene_.nodes.size()));
        if (scene_.nodes[size_t(root)].parent != kNone)
            fail(document_, place,
                 "node " + std::to_string(root) + " is no root: it has the parent " +
                     std::to_string(scene_.nodes[size_t(root)].parent));
        if (isTaken[size_t(root)])
            fail(document_, place, "node " + std::to_string(root) + " appears twice");
        isTaken[size_t(root)] = true;
        scene_.roots.push_back(root);
    }
}

void SceneReader::readAnimation(size_t index) {
    const tinygltf::Animation& source = model().animations[index];
    Animation animation;
    animation.name = source.name;
    for (size_t c = 0; c < source.channels.size(); ++c) {
        const tinygltf::AnimationChannel& from = source.channels[c];
        const std::string place = numbered("animations/", index) + numbered("/channels/", c);
        AnimationChannel channel;
        if (from.target_path == "translation") {
            channel.path = AnimationChannel::Path::kTranslation;
        } else if (from.target_path == "rotation") {
            channel.path = AnimationChannel::Path::kRotation;
        } else if (from.target_path == "scale") {
            channel.path = AnimationChannel::Path::kScale;
        } else if (from.target_path == "weights") {
            channel.path = AnimationChannel::Path::kMorphWeight;
        } else { // an extension's pointer
            ++channelCount_;
            continue;
        }
        if (from.target_node == -1) {
            ++channelCount_;
            continue;
        }
        if (from.target_node < 0 || size_t(from.target_node) >= scene_.nodes.size())
            fail(document_, place,
                 "refers to node " + std::to_string(from.target_node) + " of " +
                     std::to_string(scene_.nodes.size()));
        if (from.sampler < 0 || size_t(from.sampler) >= source.samplers.size())
            fail(document_, place,
                 "refers to sampler " + std::to_string(from.sampler) + " of " +
                     std::to_string(source.samplers.size()));
        const Node& node = scene_.nodes[size_t(from.target_node)];
        const bool isWeight = channel.path == AnimationChannel::Path::kMorphWeight;
        const size_t targetCount =
            node.mesh == kNone ? 0 : scene_.meshes[size_t(node.mesh)].morphTargets.size();
        if (isWeight && targetCount == 0) {
            ++channelCount_;
            continue;
        }
        if (node.local.hasMatrix && !isWeight)
            fail(
                document_, place,
                "moves node " + std::to_string(from.target_node) +
                    ", which is placed by a matrix; only translation, rotation and scale can move");
        const tinygltf::AnimationSampler& sampler = source.samplers[size_t(from.sampler)];
        channel.node = from.target_node;
        if (sampler.interpolation == "STEP")
            channel.interpolation = AnimationChannel::Interpolation::kStep;
        else if (sampler.interpolation == "CUBICSPLINE")
            channel.interpolation = AnimationChannel::Interpolation::kCubicSpline;
        else if (sampler.interpolation != "LINEAR" && !sampler.interpolation.empty())
            fail(document_, place,
                 "interpolation '" + sampler.interpolation.substr(0, 40) + "' does not exist");

        channel.times = accessors_.readFloats(sampler.input, 1, place + "/input");
        for (size_t i = 0; i < channel.times.size(); ++i)
            if (channel.times[i] < 0.0f || (i > 0 && !(channel.times[i] > channel.times[i - 1])))
                fail(document_, place + "/input",
                     "key " + std::to_string(i) + " at " + std::to_string(channel.times[i]) +
                         " s; times must ascend from 0 or later");
        const bool isRotation = channel.path == AnimationChannel::Path::kRotation;
        const int componentCount = isRotation ? 4 : isWeight ? 1 : 3;
        const std::vector<float> values =
            accessors_.readFloats(sampler.output, componentCount, place + "/output");
        const bool isCubic = channel.interpolation == AnimationChannel::Interpolation::kCubicSpline;
        const size_t expected =
            channel.times.size() * (isCubic ? 3 : 1) * (isWeight ? targetCount : 1);
        if (values.size() != expected * size_t(componentCount))
            fail(document_, place + "/output",
                 std::to_string(values.size() / size_t(componentCount)) + " values for " +
                     std::to_string(channel.times.size()) + " keys; " + std::to_string(expected) +
                     " are needed");
        accessors_.charge(expected * sizeof(glm::vec4), place);
        if (isWeight) { // of each key, or tangent of one, those of all targets
            for (size_t target = 0; target < targetCount; ++target) {
                accessors_.charge(channel.times.size() * sizeof(float), place);
                AnimationChannel& one = animation.channels.emplace_back(channel);
                one.morphTarget = uint32_t(target);
                for (size_t i = target; i < expected; i += targetCount)
                    one.values.emplace_back(checkedFloat(values[i], place + "/output"), 0, 0, 0);
            }
            continue;
        }
        channel.values.resize(expected);
        for (size_t i = 0; i < expected; ++i)
            for (int k = 0; k < componentCount; ++k)
                channel.values[i][k] =
                    checkedFloat(values[i * size_t(componentCount) + size_t(k)], place + "/output");
        animation.channels.push_back(std::move(channel));
    }
    if (!animation.channels.empty())
        scene_.animations.push_back(std::move(animation));
}

void SceneReader::writeWarnings() {
    const auto warn = [&](uint64_t count, const std::string& what) {
        if (count > 0)
            scene_.warnings.push_back(std::to_string(count) + " " + what);
    };
    warn(lineAndPointCount_, "primitives of points or lines ignored: they cast no shadow.");
    warn(noPositionCount_, "primitives without positions ignored.");
    warn(incompleteCount_, "primitives end in an incomplete triangle, which is left out.");
    warn(orthographicCount_, "orthographic cameras ignored: only perspective ones are supported.");
    warn(channelCount_,
         "animation channels ignored: only translation, rotation and scale of nodes move, and "
         "weights of morph targets.");
    warn(instancingCount_, "nodes with EXT_mesh_gpu_instancing show their mesh once only.");
    warn(translucentCount_, "translucent materials taken as opaque.");
    constexpr size_t kNamed = 8;
    const std::vector<std::string>& ignored = document_.ignoredExtensions;
    for (size_t i = 0; i < std::min(ignored.size(), kNamed); ++i)
        if (ignored[i] != "EXT_mesh_gpu_instancing") // has a warning with its count
            scene_.warnings.push_back("the extension '" + printable(ignored[i].substr(0, 60)) +
                                      "' is ignored: what it changes is not shown.");
    warn(ignored.size() - std::min(ignored.size(), kNamed), "further extensions ignored.");
    warn(masks_.unreadableCount,
         "masked materials taken as opaque: their textures are neither PNG nor JPEG.");
    warn(masks_.unusedAlphaCount,
         "materials taken as opaque although their colour images have transparent texels: the file "
         "does not say that these cut them out; name the image as their opacity map, too, or "
         "convert the scene to glTF with alphaMode MASK.");
    warn(noUvCount_, "primitives with a masked material have no texture coordinates: the texel at "
                     "(0, 0) is used for all of them.");
    warn(noTextureUvCount_, "primitives with a base colour texture have no texture coordinates: "
                            "its colour at (0, 0) is used for all of them.");
    warn(vertexAlphaCount_, "primitives with a masked material have vertex colours, whose alpha is "
                            "ignored.");
    warn(uint64_t(std::count(textures_.isTextureUsed.begin(), textures_.isTextureUsed.end(), 0)),
         "textures ignored: of textures, pictures show base colours alone.");
    scene_.warnings.insert(scene_.warnings.end(), textures_.warnings.begin(),
                           textures_.warnings.end());
    warn(document_.surplusBytes, "bytes after the length that the GLB header states are ignored: "
                                 "fetch or export the file again.");
    warn(document_.ignoredMaterialExtensionCount,
         "required extensions ignored that change colours only.");
}

} // namespace

Scene readGltf(const std::string& path) {
    return readGltf(path, {readSceneBytes(path), {}, {}});
}

Scene readGltf(const std::string& path, GltfSource source) {
    try {
        return SceneReader(path, std::move(source)).read();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, path + ": not enough memory to read the scene");
    }
}

} // namespace shadowdag
