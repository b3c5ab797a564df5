// SPDX-License-Identifier: Apache-2.0
// The scene as authored: meshes, nodes, lights, cameras, animations.
// scenes/world.h turns it into triangles and lights in world space at one time.
#pragma once

#include "scenes/alpha_mask.h"
#include "scenes/base_color.h"
#include "scenes/box.h"
#include "scenes/camera.h"
#include "scenes/light.h"

#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace shadowdag {

constexpr int kNone = -1;

/// Coordinates of vertices, in a mesh and in the world, and of lights and cameras are at most this,
/// in scene units. Two points are then at most 2e9 apart along an axis, and the largest products
/// that are computed in float, fourth powers of lengths such as the squared normal of a triangle,
/// stay below 3 * (2 * (2e9)^2)^2 = 1.9e38, within float. World and readGltf refuse what is beyond.
constexpr double kMaxCoordinate = 1e9;

/// Returns whether a point is within kMaxCoordinate of the origin along each axis; false for NaN.
inline bool isWithinReach(const glm::dvec3& p) {
    return std::fabs(p.x) <= kMaxCoordinate && std::fabs(p.y) <= kMaxCoordinate &&
           std::fabs(p.z) <= kMaxCoordinate;
}

/// Returns "(1, 2.5, 1e+20)", for messages.
std::string pointText(const glm::dvec3& p);

/// Surface colour, for pictures, and the mask that cuts out the surface, which shadows use, too.
struct Material {
    std::string name;
    glm::vec3 baseColor{0.8f};
    glm::vec3 emission{0.0f};
    int alphaMask = kNone;        ///< index into Scene::alphaMasks; kNone: opaque
    int baseColorTexture = kNone; ///< index into Scene::textures, scales baseColor; kNone: none
};

/// A joint's share of a vertex.
struct JointWeight {
    uint32_t joint; ///< index into Skin::joints
    float weight;   ///< not negative
};

/// An indexed triangle list in object space. Indices are in range, positions and texture
/// coordinates finite, always.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<uint32_t> triangleMaterial; ///< count = triangles; index into Scene::materials
    std::vector<glm::vec2> uv = {};         ///< count = positions where a material has a mask or a
                                            ///< texture, or empty: (0, 0) everywhere
    uint32_t jointsPerVertex = 0;           ///< 0: no skin deforms it
    std::vector<JointWeight> jointWeights = {}; ///< jointsPerVertex * positions, by vertex; of each
                                                ///< vertex one is above 0
    std::vector<std::vector<glm::vec3>> morphTargets = {}; ///< displacements, count = positions
    std::vector<float> morphWeights = {};                  ///< count = morphTargets; default

    /// Returns whether a skin or morph targets deform it.
    bool deforms() const { return jointsPerVertex > 0 || !morphTargets.empty(); }
};

/// The nodes that a skinned mesh follows instead of its own. Source: glTF 2.0, sec. 3.7.3.
struct Skin {
    std::string name;
    std::vector<int> joints;              ///< nodes, at least one
    std::vector<glm::mat4> jointFromMesh; ///< count = joints; the inverse bind matrices
};

/// A node's local transform: a matrix, or translation * rotation * scale when animated or authored
/// so.
struct LocalTransform {
    bool hasMatrix = false;
    glm::mat4 matrix{1.0f};
    glm::vec3 translation{0.0f};
    glm::quat rotation{1, 0, 0, 0};
    glm::vec3 scale{1.0f};

    glm::mat4 parentFromLocal() const { return glm::mat4(parentFromLocalDouble()); }
    /// Returns the transform in double precision, which World accumulates. Uses additions,
    /// multiplications and one division only; a rotation that is not of unit length is normalised.
    glm::dmat4 parentFromLocalDouble() const;
};

struct Node {
    std::string name;
    LocalTransform local;
    int parent = kNone;
    int mesh = kNone;
    int light = kNone;
    int camera = kNone;
    std::vector<int> children;
    int skin = kNone;                ///< its mesh then has joints; index into Scene::skins
    std::vector<float> morphWeights; ///< count = targets of its mesh; empty: those of the mesh
};

/// A light as authored: its position and direction (-Z) come from the node that refers to it.
struct LightSource {
    std::string name;
    Light::Kind kind = Light::kPoint;
    glm::vec3 color{1.0f};
    float intensity = 1.0f; ///< candela; lux for directional lights
    float rangeWorld =
        0.0f; ///< 0: none authored, a cutoff decides (see world.h); directional lights have none
    float innerConeAngle = 0.0f;
    float outerConeAngle = 0.7853982f;
};

/// A camera as authored; its position comes from the node that refers to it.
struct CameraSource {
    std::string name;
    float yfov = 0.9f;
    float znear = 0.05f;
    float zfar = 1000.0f; ///< infinity: none authored, World takes what encloses the scene
};

/// One animated property of one node. Times ascend, in seconds; before the first and after the last
/// key the nearest key holds.
struct AnimationChannel {
    enum class Path { kTranslation, kRotation, kScale, kMorphWeight };
    enum class Interpolation { kStep, kLinear, kCubicSpline };

    int node = kNone;
    Path path = Path::kTranslation;
    Interpolation interpolation = Interpolation::kLinear;
    std::vector<float> times;
    std::vector<glm::vec4> values; ///< xyz, quaternion xyzw or weight x; count = times, or 3 *
                                   ///< times (in-tangent, value, out-tangent) for kCubicSpline
    uint32_t morphTarget = 0;      ///< of kMorphWeight: which target's
};

struct Animation {
    std::string name;
    std::vector<AnimationChannel> channels;
};

/// The whole scene as authored. World units are metres, right-handed, Y up. The node graph is a
/// forest (checked by the reader); `roots` are those of the default scene.
struct Scene {
    std::string name;
    std::vector<Material> materials; ///< never empty; 0 is the default material
    std::vector<AlphaMask> alphaMasks;
    TextureSet textures; ///< base colours
    std::vector<Mesh> meshes;
    std::vector<Node> nodes;
    std::vector<int> roots;
    std::vector<LightSource> lights;
    std::vector<CameraSource> cameras;
    std::vector<Animation> animations;
    std::vector<Skin> skins;
    std::vector<std::string> warnings; ///< what was ignored, one sentence each, with counts

    /// Returns the last key time over all animations in seconds; 0 without animations. All
    /// animations play at once; where several drive the same property of a node, the first in the
    /// list does.
    float durationSeconds() const;
};

} // namespace shadowdag
