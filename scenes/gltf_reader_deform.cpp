// SPDX-License-Identifier: Apache-2.0
// Skins and morph targets. Source: Khronos, glTF 2.0 specification, sec. 3.7.2.2 (morph targets)
// and 3.7.3 (skins).
#include "scenes/gltf_reader.h"

#include <algorithm>
#include <cmath>

namespace shadowdag::gltf {

namespace {

constexpr uint32_t kJointsPerSet = 4;

/// Returns the values of the accessor, componentCount a vertex.
const std::vector<float>& vertexFloats(const Document& document, AccessorReader& accessors,
                                       int accessor, int componentCount, size_t vertexCount,
                                       const std::string& place) {
    const std::vector<float>& values = accessors.sharedFloats(accessor, componentCount, place);
    if (values.size() != vertexCount * size_t(componentCount))
        fail(document, place,
             std::to_string(values.size() / size_t(componentCount)) + " of them for " +
                 std::to_string(vertexCount) + " vertices");
    return values;
}

/// Appends the joints of the vertices in use.
void appendJoints(const Document& document, AccessorReader& accessors, const DeformAccessors& from,
                  size_t vertexCount, const std::vector<uint32_t>& used, const std::string& place,
                  Mesh& mesh) {
    const size_t first = mesh.jointWeights.size();
    mesh.jointWeights.resize(first + used.size() * mesh.jointsPerVertex, {0, 0.0f});
    for (size_t set = 0; set < from.joints.size(); ++set) {
        const std::string name = std::to_string(set);
        const std::vector<float>& joints = vertexFloats(document, accessors, from.joints[set], 4,
                                                        vertexCount, place + "/JOINTS_" + name);
        const std::vector<float>& weights = vertexFloats(document, accessors, from.weights[set], 4,
                                                         vertexCount, place + "/WEIGHTS_" + name);
        for (size_t i = 0; i < used.size(); ++i)
            for (uint32_t k = 0; k < kJointsPerSet; ++k) {
                const float joint = joints[4 * size_t(used[i]) + k];
                const float weight = weights[4 * size_t(used[i]) + k];
                const auto vertex = [&] { return "vertex " + std::to_string(used[i]) + " has "; };
                if (!(joint >= 0.0f && joint < 65536.0f && joint == std::floor(joint)))
                    fail(document, place + "/JOINTS_" + name,
                         vertex() + "joint " + std::to_string(joint) +
                             ", which is not a whole number below 65536");
                if (!(weight >= 0.0f))
                    fail(document, place + "/WEIGHTS_" + name,
                         vertex() + "weight " + std::to_string(weight) + ", which is negative");
                if (weight > 0.0f)
                    mesh.jointWeights[first + i * mesh.jointsPerVertex + kJointsPerSet * set + k] =
                        {uint32_t(joint), weight};
            }
    }
    for (size_t i = first; i < mesh.jointWeights.size(); i += mesh.jointsPerVertex) {
        const auto begin = mesh.jointWeights.begin() + std::ptrdiff_t(i);
        if (std::none_of(begin, begin + mesh.jointsPerVertex,
                         [](const JointWeight& joint) { return joint.weight > 0.0f; }))
            *begin = {0, 1.0f};
    }
}

} // namespace

DeformAccessors readDeformAccessors(const Document& document, const tinygltf::Primitive& primitive,
                                    const std::string& place) {
    DeformAccessors found;
    const auto& attributes = primitive.attributes;
    for (size_t set = 0; !document.model.skins.empty(); ++set) {
        const auto joints = attributes.find("JOINTS_" + std::to_string(set));
        const auto weights = attributes.find("WEIGHTS_" + std::to_string(set));
        if ((joints == attributes.end()) != (weights == attributes.end()))
            fail(document, place,
                 "has one of JOINTS_" + std::to_string(set) + " and WEIGHTS_" +
                     std::to_string(set) + " without the other");
        if (joints == attributes.end())
            break;
        found.joints.push_back(joints->second);
        found.weights.push_back(weights->second);
    }
    for (const auto& target : primitive.targets) {
        const auto position = target.find("POSITION");
        found.targets.push_back(position == target.end() ? kNone : position->second);
    }
    return found;
}

void appendDeformation(const Document& document, AccessorReader& accessors,
                       const DeformAccessors& from, size_t vertexCount,
                       const std::vector<uint32_t>& used, const std::string& place, Mesh& mesh) {
    accessors.charge(used.size() * (mesh.jointsPerVertex * sizeof(JointWeight) +
                                    mesh.morphTargets.size() * sizeof(glm::vec3)),
                     place);
    if (mesh.jointsPerVertex > 0)
        appendJoints(document, accessors, from, vertexCount, used, place, mesh);
    for (size_t target = 0; target < mesh.morphTargets.size(); ++target) {
        std::vector<glm::vec3>& displacements = mesh.morphTargets[target];
        if (from.targets[target] == kNone) {
            displacements.resize(displacements.size() + used.size(), glm::vec3(0.0f));
            continue;
        }
        const std::vector<float>& values =
            vertexFloats(document, accessors, from.targets[target], 3, vertexCount,
                         place + "/targets/" + std::to_string(target) + "/POSITION");
        for (const uint32_t v : used)
            displacements.emplace_back(values[3 * size_t(v)], values[3 * size_t(v) + 1],
                                       values[3 * size_t(v) + 2]);
    }
}

std::vector<Skin> readSkins(const Document& document, AccessorReader& accessors) {
    std::vector<Skin> skins;
    for (size_t s = 0; s < document.model.skins.size(); ++s) {
        const tinygltf::Skin& source = document.model.skins[s];
        const std::string place = "skins/" + std::to_string(s);
        Skin skin;
        skin.name = source.name;
        if (source.joints.empty())
            fail(document, place, "has no joints");
        for (const int joint : source.joints)
            if (joint < 0 || size_t(joint) >= document.model.nodes.size())
                fail(document, place + "/joints",
                     "refers to node " + std::to_string(joint) + " of " +
                         std::to_string(document.model.nodes.size()));
        skin.joints = source.joints;
        // World keeps another matrix of each joint, in double.
        accessors.charge(skin.joints.size() * (sizeof(glm::mat4) + sizeof(glm::dmat4)), place);
        skin.jointFromMesh.assign(skin.joints.size(), glm::mat4(1.0f));
        if (source.inverseBindMatrices != -1) {
            const std::string matrices = place + "/inverseBindMatrices";
            const std::vector<float> values =
                accessors.readFloats(source.inverseBindMatrices, 16, matrices);
            if (values.size() < 16 * skin.joints.size())
                fail(document, matrices,
                     std::to_string(values.size() / 16) + " matrices for " +
                         std::to_string(skin.joints.size()) + " joints");
            for (size_t i = 0; i < 16 * skin.joints.size(); ++i) {
                const size_t column = i % 16 / 4, row = i % 4;
                const float bottom = column == 3 ? 1.0f : 0.0f;
                if (row == 3 && !(std::fabs(values[i] - bottom) <= 1e-5f))
                    fail(document, matrices,
                         "the bottom row of matrix " + std::to_string(i / 16) + " holds " +
                             std::to_string(values[i]) + " instead of " + std::to_string(bottom));
                skin.jointFromMesh[i / 16][int(column)][int(row)] = row == 3 ? bottom : values[i];
            }
        }
        skins.push_back(std::move(skin));
    }
    return skins;
}

} // namespace shadowdag::gltf
