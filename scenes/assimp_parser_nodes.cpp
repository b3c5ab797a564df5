// SPDX-License-Identifier: Apache-2.0
// Meshes, nodes, lights and cameras of Assimp's scene. A mesh is written once, however many nodes
// show it; nodes that show several show one that holds them all.
#include "scenes/assimp_parser.h"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>

namespace shadowdag::assimp {

namespace {

/// More than the largest scenes have; a loop of nodes ends here.
constexpr size_t kMaxNodeCount = 2'000'000;

glm::dvec3 vectorOf(const aiVector3D& v) {
    return {v.x, v.y, v.z};
}

bool isFinite(const glm::dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

glm::dvec3 unitOr(const glm::dvec3& v, const glm::dvec3& otherwise) {
    const double length = std::sqrt(glm::dot(v, v));
    return length > 0.0 && std::isfinite(length) ? v / length : otherwise;
}

/// Returns columns of a matrix whose -Z axis is `forward`.
glm::dmat4 frameOf(const glm::dvec3& position, const glm::dvec3& forward, const glm::dvec3& up) {
    const glm::dvec3 z = -forward;
    glm::dvec3 x = glm::cross(up, z);
    if (!(glm::dot(x, x) > 1e-12)) // of no up, or one along the view
        x = glm::cross(std::fabs(z.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0), z);
    x = unitOr(x, {1, 0, 0});
    return {glm::dvec4(x, 0), glm::dvec4(glm::cross(z, x), 0), glm::dvec4(z, 0),
            glm::dvec4(position, 1)};
}

/// A vertex: the bits of its position and of up to two pairs of texture coordinates.
using VertexBits = std::array<uint32_t, 7>;

struct VertexHash {
    size_t operator()(const VertexBits& bits) const {
        uint64_t hash = 0;
        for (const uint32_t word : bits)
            hash = (std::rotl(hash, 23) ^ word) * 0x9e3779b97f4a7c15u;
        return size_t(hash ^ hash >> 32);
    }
};

class NodeWriter {
public:
    NodeWriter(const aiScene& scene, const std::vector<UvSets>& uvSets, Conversion& conversion)
        : scene_(scene), uvSets_(uvSets), conversion_(conversion), parts_(conversion.parts) {}

    std::string write() {
        for (size_t i = 0; i < scene_.mNumMeshes; ++i)
            primitives_.push_back(primitiveOf(*scene_.mMeshes[i], i));
        collectNodes();
        writeLights();
        writeCameras();
        for (size_t i = 0; i < nodes_.size(); ++i)
            writeNode(i);
        for (const std::string& node : attached_)
            parts_.nodes.add(node);
        writeWarnings();
        return nodes_.empty() ? "" : "0";
    }

private:
    /// A node of Assimp's scene. Its index is that of the glTF node.
    struct Entry {
        const aiNode* node;
        double scale = 1.0;           ///< from its space to the world's; the mean of three axes
        std::vector<size_t> children; ///< glTF nodes
    };

    std::string primitiveOf(const aiMesh& mesh, size_t index);
    int meshOf(const aiNode& node);
    glm::mat4 rootMatrix() const;
    void collectNodes();
    size_t entryOf(const aiString& name) const;
    void attach(const aiString& nodeName, const glm::dmat4& frame, const std::string& members);
    void writeLights();
    void writeCameras();
    void writeNode(size_t index);
    void writeWarnings();

    const aiScene& scene_;
    const std::vector<UvSets>& uvSets_;
    Conversion& conversion_;
    glb::Parts& parts_;
    std::vector<std::string> primitives_; ///< one a mesh of Assimp's; "": no triangle
    std::map<std::vector<unsigned>, int> meshes_;
    std::vector<Entry> nodes_;
    std::unordered_map<std::string, size_t> nodeOfName_;
    std::vector<std::string> attached_; ///< nodes of lights and cameras, after those of nodes_

    std::vector<std::string> deformed_; ///< meshes that bones or morph targets would deform

    uint64_t lineAndPointCount_ = 0, otherLightCount_ = 0;
    uint64_t lightCount_ = 0, wideCount_ = 0, orthographicCount_ = 0, nearCount_ = 0;
};

// Returns a primitive with the triangles of a mesh in their order.
std::string NodeWriter::primitiveOf(const aiMesh& mesh, size_t index) {
    const std::string place = placeOf("mesh", index, mesh.mName);
    if (mesh.mNumBones > 0 || mesh.mNumAnimMeshes > 0)
        deformed_.push_back(place);
    std::set<uint32_t> sets;
    if (mesh.mMaterialIndex < uvSets_.size())
        for (const uint32_t set : uvSets_[mesh.mMaterialIndex])
            if (set < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh.mTextureCoords[set] != nullptr)
                sets.insert(set);

    std::unordered_map<VertexBits, uint32_t, VertexHash> known;
    std::vector<glm::vec3> positions;
    std::vector<std::vector<glm::vec2>> uv(sets.size());
    std::vector<uint32_t> corners;
    for (size_t f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices < 3) {
            ++lineAndPointCount_;
            continue;
        }
        if (face.mNumIndices > 3)
            fail(conversion_, place,
                 "face " + std::to_string(f) + " has " + std::to_string(face.mNumIndices) +
                     " corners, and is not divided into triangles");
        for (unsigned c = 0; c < 3; ++c) {
            const unsigned v = face.mIndices[c];
            if (v >= mesh.mNumVertices || mesh.mVertices == nullptr)
                fail(conversion_, place,
                     "face " + std::to_string(f) + " refers to vertex " + std::to_string(v) +
                         " of " + std::to_string(mesh.mNumVertices));
            const aiVector3D& p = mesh.mVertices[v];
            if (!isWithinReach(vectorOf(p)))
                fail(conversion_, place,
                     "vertex " + std::to_string(v) + " is at " + pointText(vectorOf(p)) +
                         ", not within 1e9 of the origin; scale the scene");
            VertexBits bits = {std::bit_cast<uint32_t>(p.x), std::bit_cast<uint32_t>(p.y),
                               std::bit_cast<uint32_t>(p.z)};
            std::array<glm::vec2, 2> at{};
            size_t k = 0;
            for (const uint32_t set : sets) {
                const aiVector3D& t = mesh.mTextureCoords[set][v];
                at[k] = {t.x, 1.0f - t.y}; // glTF's v points down
                bits[3 + 2 * k] = std::bit_cast<uint32_t>(at[k].x);
                bits[4 + 2 * k] = std::bit_cast<uint32_t>(at[k].y);
                ++k;
            }
            const auto [found, isNew] = known.try_emplace(bits, uint32_t(positions.size()));
            if (isNew) {
                positions.emplace_back(p.x, p.y, p.z);
                for (k = 0; k < sets.size(); ++k)
                    uv[k].push_back(at[k]);
            }
            corners.push_back(found->second);
        }
    }
    if (corners.empty())
        return "";
    const auto accessor = [&](const auto& list, int componentCount) {
        return std::to_string(
            parts_.addAccessor(list.data(), list.size(), componentCount, glb::kFloat, 34962, ""));
    };
    std::string text = "{\"attributes\":{\"POSITION\":" + accessor(positions, 3);
    size_t k = 0;
    for (const uint32_t set : sets)
        text += ",\"TEXCOORD_" + std::to_string(set) + "\":" + accessor(uv[k++], 2);
    text += "},\"indices\":" + std::to_string(parts_.addAccessor(corners.data(), corners.size(), 1,
                                                                 glb::kUint32, 34963, ""));
    if (mesh.mMaterialIndex < uvSets_.size())
        text += ",\"material\":" + std::to_string(mesh.mMaterialIndex);
    return text + "}";
}

// Returns the glTF mesh of a node; kNone if it shows no triangle.
int NodeWriter::meshOf(const aiNode& node) {
    std::vector<unsigned> list;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (node.mMeshes[i] >= primitives_.size())
            fail(conversion_, placeOf("node", 0, node.mName),
                 "refers to mesh " + std::to_string(node.mMeshes[i]) + " of " +
                     std::to_string(primitives_.size()));
        if (!primitives_[node.mMeshes[i]].empty())
            list.push_back(node.mMeshes[i]);
    }
    if (list.empty())
        return kNone;
    const auto [known, isNew] = meshes_.try_emplace(list, kNone);
    if (isNew) {
        glb::JsonArray primitives("primitives");
        for (const unsigned mesh : list)
            primitives.add(primitives_[mesh]);
        known->second = int(
            parts_.meshes.add("{" + glb::nameMember(textOf(scene_.mMeshes[list.front()]->mName)) +
                              primitives.member().substr(1) + "}"));
    }
    return known->second;
}

// Returns the root's matrix. FBX states which of its axes point up, to the front and to the right,
// and its unit in centimetres; releases of Assimp differ in what they apply to the root, whose own
// matrix FBX does not have.
glm::mat4 NodeWriter::rootMatrix() const {
    if (!conversion_.isFbx) {
        const aiMatrix4x4& m = scene_.mRootNode->mTransformation;
        return {m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2,
                m.a3, m.b3, m.c3, m.d3, m.a4, m.b4, m.c4, m.d4};
    }
    if (scene_.mMetaData == nullptr)
        return glm::mat4(1.0f);
    const char* const axes[3][2] = {
        {"CoordAxis", "CoordAxisSign"}, {"UpAxis", "UpAxisSign"}, {"FrontAxis", "FrontAxisSign"}};
    glm::mat3 rows(0.0f); // row i picks the axis of the file that is our axis i
    for (int i = 0; i < 3; ++i) {
        int32_t axis = i, sign = 1;
        scene_.mMetaData->Get(axes[i][0], axis);
        scene_.mMetaData->Get(axes[i][1], sign);
        if (axis >= 0 && axis < 3)
            rows[axis][i] = sign < 0 ? -1.0f : 1.0f;
    }
    float unit = 1.0f; // some releases state a double
    double wideUnit = 1.0;
    if (scene_.mMetaData->Get("UnitScaleFactor", unit))
        wideUnit = double(unit);
    else
        scene_.mMetaData->Get("UnitScaleFactor", wideUnit);
    if (std::fabs(glm::determinant(rows)) != 1.0f)
        fail(conversion_, "GlobalSettings", "two of its axes are the same");
    const float metres = float(0.01 * wideUnit);
    if (!(std::isfinite(metres) && metres > 0.0f))
        fail(conversion_, "GlobalSettings/UnitScaleFactor",
             std::to_string(wideUnit) + " is not a number above 0");
    return glm::mat4(rows * metres);
}

// Finds all nodes, parents first.
void NodeWriter::collectNodes() {
    if (scene_.mRootNode == nullptr)
        return;
    nodes_.push_back({scene_.mRootNode, 1.0, {}});
    for (size_t i = 0; i < nodes_.size(); ++i) {
        const aiNode& node = *nodes_[i].node;
        const aiMatrix4x4& m = node.mTransformation;
        const double volume =
            i == 0 ? double(glm::determinant(glm::mat3(rootMatrix()))) : double(m.Determinant());
        nodes_[i].scale *= std::cbrt(std::fabs(volume));
        nodeOfName_.try_emplace(std::string(node.mName.C_Str()), i);
        if (nodes_.size() + node.mNumChildren > kMaxNodeCount)
            fail(conversion_, "nodes",
                 "more than " + std::to_string(kMaxNodeCount) +
                     "; join objects, or split the scene");
        for (unsigned c = 0; c < node.mNumChildren; ++c) {
            nodes_[i].children.push_back(nodes_.size());
            nodes_.push_back({node.mChildren[c], nodes_[i].scale, {}});
        }
    }
}

// Returns the node of a light or camera, which has its name; the root where there is none.
size_t NodeWriter::entryOf(const aiString& name) const {
    const auto found = nodeOfName_.find(name.C_Str());
    return found == nodeOfName_.end() ? 0 : found->second;
}

// Adds a node below that of the name.
void NodeWriter::attach(const aiString& nodeName, const glm::dmat4& frame,
                        const std::string& members) {
    std::string text = "{" + glb::nameMember(textOf(nodeName)) + "\"matrix\":[";
    for (int i = 0; i < 16; ++i)
        text += (i ? "," : "") + glb::number(float(frame[i / 4][i % 4]));
    nodes_[entryOf(nodeName)].children.push_back(nodes_.size() + attached_.size());
    attached_.push_back(text + "]," + members + "}");
}

void NodeWriter::writeLights() {
    for (size_t i = 0; i < scene_.mNumLights && !nodes_.empty(); ++i) {
        const aiLight& light = *scene_.mLights[i];
        const std::string place = placeOf("light", i, light.mName);
        const char* kind = light.mType == aiLightSource_DIRECTIONAL ? "directional"
                           : light.mType == aiLightSource_POINT     ? "point"
                           : light.mType == aiLightSource_SPOT      ? "spot"
                                                                    : nullptr;
        if (kind == nullptr) {
            ++otherLightCount_;
            continue;
        }
        const bool isSpot = light.mType == aiLightSource_SPOT;
        const bool isPoint = light.mType == aiLightSource_POINT;
        const glm::dvec3 position =
            light.mType == aiLightSource_DIRECTIONAL ? glm::dvec3(0.0) : vectorOf(light.mPosition);
        const glm::dvec3 direction = isPoint ? glm::dvec3(0, 0, -1) : vectorOf(light.mDirection);
        const glm::dvec3 color(light.mColorDiffuse.r, light.mColorDiffuse.g, light.mColorDiffuse.b);
        if (!isFinite(position) || !isFinite(color) || !(glm::dot(direction, direction) > 0.0))
            fail(conversion_, place,
                 "its position " + pointText(position) + ", colour " + pointText(color) +
                     " or direction " + pointText(direction) +
                     " is not finite, or the direction is zero");
        std::string text = "{" + glb::nameMember(textOf(light.mName)) +
                           "\"color\":" + glb::numbers(glm::vec3(color), 3) + ",\"type\":\"" +
                           kind + "\"";
        if (isSpot) {
            constexpr float kHalfPi = 1.5707963f;
            const float half = conversion_.hasFullAngles ? 0.5f : 1.0f;
            float outer = half * light.mAngleOuterCone, inner = half * light.mAngleInnerCone;
            if (!std::isfinite(outer) || !std::isfinite(inner))
                fail(conversion_, place, "the angle of its cone is not a number");
            wideCount_ += outer > kHalfPi;
            outer = std::fmin(outer, kHalfPi);
            inner = std::fmin(inner, outer);
            text += ",\"spot\":{\"innerConeAngle\":" + glb::number(inner) +
                    ",\"outerConeAngle\":" + glb::number(outer) + "}";
        }
        const size_t index = parts_.lights.add(text + "}");
        attach(light.mName, frameOf(position, unitOr(direction, {0, 0, -1}), vectorOf(light.mUp)),
               "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" + std::to_string(index) +
                   "}}");
        ++lightCount_;
    }
}

void NodeWriter::writeCameras() {
    for (size_t i = 0; i < scene_.mNumCameras && !nodes_.empty(); ++i) {
        const aiCamera& camera = *scene_.mCameras[i];
        const std::string place = placeOf("camera", i, camera.mName);
        if (camera.mOrthographicWidth != 0.0f) {
            ++orthographicCount_;
            continue;
        }
        const glm::dvec3 position = vectorOf(camera.mPosition), forward = vectorOf(camera.mLookAt);
        if (!isFinite(position) || !(glm::dot(forward, forward) > 0.0))
            fail(conversion_, place,
                 "its position " + pointText(position) + " or direction " + pointText(forward) +
                     " is not finite, or the direction is zero");
        // Of a camera without an aspect ratio, a picture of 16 to 9 has the stated angle.
        const double aspect =
            camera.mAspect > 0.0f && std::isfinite(camera.mAspect) ? camera.mAspect : 16.0 / 9.0;
        const double width = double(conversion_.fovScale) * camera.mHorizontalFOV;
        if (!(width > 0.0 && width < 3.1415926))
            fail(conversion_, place,
                 "its field of view of " + std::to_string(width) + " rad is not within 0 and pi");
        const double yfov = 2.0 * std::atan(std::tan(0.5 * width) / aspect);
        const double metres = nodes_[entryOf(camera.mName)].scale;
        double near = metres * camera.mClipPlaneNear;
        const double far = metres * camera.mClipPlaneFar;
        if (!(near > 0.0 && std::isfinite(near))) {
            near = 0.1;
            ++nearCount_;
        }
        std::string text =
            "{" + glb::nameMember(textOf(camera.mName)) +
            "\"type\":\"perspective\",\"perspective\":{\"yfov\":" + glb::number(float(yfov)) +
            ",\"znear\":" + glb::number(float(near));
        if (far > near && std::isfinite(float(far)))
            text += ",\"zfar\":" + glb::number(float(far));
        const size_t index = parts_.cameras.add(text + "}}");
        attach(camera.mName, frameOf(position, unitOr(forward, {0, 0, -1}), vectorOf(camera.mUp)),
               "\"camera\":" + std::to_string(index));
    }
}

void NodeWriter::writeNode(size_t index) {
    const Entry& entry = nodes_[index];
    const aiNode& node = *entry.node;
    std::string text = "{" + glb::nameMember(textOf(node.mName));
    const aiMatrix4x4& m = node.mTransformation;
    const glm::mat4 matrix = index == 0 ? rootMatrix()
                                        : glm::mat4(m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2,
                                                    m.a3, m.b3, m.c3, m.d3, m.a4, m.b4, m.c4, m.d4);
    if (matrix != glm::mat4(1.0f)) {
        text += "\"matrix\":[";
        for (int i = 0; i < 16; ++i) {
            if (!std::isfinite(matrix[i / 4][i % 4]))
                fail(conversion_, placeOf("node", index, node.mName),
                     "its transform is not of numbers");
            text += (i ? "," : "") + glb::number(matrix[i / 4][i % 4]);
        }
        text += "],";
    }
    if (const int mesh = meshOf(node); mesh != kNone)
        text += "\"mesh\":" + std::to_string(mesh) + ",";
    if (!entry.children.empty()) {
        text += "\"children\":[";
        for (size_t i = 0; i < entry.children.size(); ++i)
            text += (i ? "," : "") + std::to_string(entry.children[i]);
        text += "],";
    }
    parts_.nodes.add(glb::closed(text));
}

void NodeWriter::writeWarnings() {
    conversion_.warn(lineAndPointCount_, "points or lines ignored: they cast no shadow.");
    constexpr size_t kMaxNames = 4;
    std::string deformed;
    for (size_t i = 0; i < std::min(deformed_.size(), kMaxNames); ++i)
        deformed += (i ? ", " : "") + deformed_[i];
    conversion_.warn(deformed_.size(),
                     "meshes with bones or morph targets stay in rest pose, because only those of "
                     "glTF are posed: " +
                         deformed + (deformed_.size() > kMaxNames ? ", ..." : "") + ".");
    conversion_.warn(scene_.mNumAnimations, "animations ignored: only those of glTF move.");
    conversion_.warn(lightCount_,
                     "lights: the colour that the file states is taken as candela (lux "
                     "of directional lights), and its attenuation is ignored.");
    conversion_.warn(wideCount_, "spot cones are wider than a hemisphere and are limited to one.");
    conversion_.warn(otherLightCount_, "ambient, area and other lights ignored: only points, spots "
                                       "and directional lights are supported.");
    conversion_.warn(orthographicCount_,
                     "orthographic cameras ignored: only perspective ones are supported.");
    conversion_.warn(nearCount_, "cameras have no near plane; 0.1 m is used.");
}

} // namespace

std::string writeNodes(const aiScene& scene, const std::vector<UvSets>& uvSets,
                       Conversion& conversion) {
    return NodeWriter(scene, uvSets, conversion).write();
}

} // namespace shadowdag::assimp
