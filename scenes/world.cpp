// SPDX-License-Identifier: Apache-2.0
#include "scenes/world.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "scenes/animation.h"
#include "scenes/content_hash.h"
#include "scenes/light_placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <new>
#include <set>
#include <tuple>

namespace shadowdag {

namespace {

constexpr const char* kOutOfReach =
    ", not within 1e9 of the origin; check the transforms of its ancestors";

std::string nodeLabel(const Scene& scene, uint32_t node) {
    return "node " + std::to_string(node) +
           (scene.nodes[node].name.empty() ? "" : " ('" + scene.nodes[node].name + "')");
}

glm::dvec3 normalizedOr(const glm::dvec3& v, const glm::dvec3& otherwise) {
    const double lengthSquared = glm::dot(v, v);
    if (!(lengthSquared > 0.0) || !std::isfinite(lengthSquared))
        return otherwise;
    return v / std::sqrt(lengthSquared);
}

// Sets the sphere around the bounds, which a directional light has instead of a position and a
// range. The end of rays is at twice the width of the scene and twice its coordinates: at a smaller
// distance, rounding the end to float would turn the ray by more than rounding its start does.
void surroundScene(Light& light, const Box& bounds) {
    const glm::dvec3 center = 0.5 * (glm::dvec3(bounds.min) + glm::dvec3(bounds.max));
    const glm::dvec3 largest =
        glm::max(glm::abs(glm::dvec3(bounds.min)), glm::abs(glm::dvec3(bounds.max)));
    const double coordinate = std::max({largest.x, largest.y, largest.z});
    const double radius = 0.5 * glm::length(glm::dvec3(bounds.max) - glm::dvec3(bounds.min));
    light.positionWorld = glm::vec3(center);
    light.rangeWorld = float(radius * 1.001 + coordinate * 1e-6 + 1e-30);
    int exponent = 0;
    std::frexp(std::max(4.0 * double(light.rangeWorld), 2.0 * coordinate), &exponent);
    light.directionalDistanceWorld = std::ldexp(1.0f, exponent);
}

bool mirrors(const glm::dmat4& m) {
    return glm::dot(glm::dvec3(m[0]), glm::cross(glm::dvec3(m[1]), glm::dvec3(m[2]))) < 0.0;
}

} // namespace

World::World(const Scene& scene, const WorldOptions& options) : scene_(&scene), options_(options) {
    const size_t nodeCount = scene.nodes.size();
    isNodeReachable_.assign(nodeCount, 0);
    isNodeMoving_.assign(nodeCount, 0);
    nodeChannels_.resize(nodeCount);
    weightChannels_.resize(nodeCount);
    worldFromNode_.assign(nodeCount, glm::dmat4(1.0));

    // Parents before children, without recursion: chains may be as long as the file.
    std::vector<uint32_t> stack(scene.roots.rbegin(), scene.roots.rend());
    while (!stack.empty()) {
        const uint32_t node = stack.back();
        stack.pop_back();
        SDAG_ASSERT(!isNodeReachable_[node]);
        isNodeReachable_[node] = 1;
        placedNodes_.push_back(node);
        const std::vector<int>& children = scene.nodes[node].children;
        stack.insert(stack.end(), children.rbegin(), children.rend());
    }

    placeSkins();

    std::set<std::tuple<int, AnimationChannel::Path, uint32_t>> taken;
    for (const Animation& animation : scene.animations) {
        for (const AnimationChannel& channel : animation.channels) {
            if (channel.times.empty() ||
                !taken.emplace(channel.node, channel.path, channel.morphTarget).second)
                continue;
            const bool isWeight = channel.path == AnimationChannel::Path::kMorphWeight;
            (isWeight ? weightChannels_ : nodeChannels_)[channel.node].push_back(
                uint32_t(channels_.size()));
            channels_.push_back(&channel);
        }
    }
    for (uint32_t node : placedNodes_) {
        const int parent = scene.nodes[node].parent;
        isNodeMoving_[node] =
            !nodeChannels_[node].empty() || (parent != kNone && isNodeMoving_[parent]);
    }
    for (size_t s = 0; s < worldFromMeshOfSkin_.size(); ++s)
        if (!worldFromMeshOfSkin_[s].empty())
            isSkinMoving_[s] =
                std::any_of(scene.skins[s].joints.begin(), scene.skins[s].joints.end(),
                            [this](int joint) { return isNodeMoving_[joint] != 0; });

    // Sizes first: instancing multiplies what a small file holds.
    uint64_t vertexCount = 0, triangleCount = 0;
    for (size_t node = 0; node < nodeCount; ++node) {
        if (!isNodeReachable_[node] || scene.nodes[node].mesh == kNone)
            continue;
        const Mesh& mesh = scene.meshes[scene.nodes[node].mesh];
        if (mesh.triangles.empty())
            continue;
        vertexCount += mesh.positions.size();
        triangleCount += mesh.triangles.size();
    }
    if (triangleCount == 0)
        throw Error(ErrorKind::kInput, "scene '" + scene.name +
                                           "' has no triangle in its default scene; there is "
                                           "nothing to light");
    if (triangleCount > options.maxTriangleCount || vertexCount > 0xffffffffu)
        throw Error(ErrorKind::kResource,
                    "scene '" + scene.name + "' has " + std::to_string(triangleCount) +
                        " instanced triangles and " + std::to_string(vertexCount) +
                        " vertices, more than the limit of " +
                        std::to_string(options.maxTriangleCount) +
                        " triangles; use fewer instances");
    try {
        positions_.resize(vertexCount);
        triangles_.reserve(triangleCount);
        triangleMaterial_.reserve(triangleCount);
        triangleInstance_.reserve(triangleCount);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, "not enough memory for the " +
                                              std::to_string(triangleCount) +
                                              " instanced triangles of scene '" + scene.name + "'");
    }

    updateTransforms(false);
    uint32_t firstVertex = 0;
    for (uint32_t node = 0; node < nodeCount; ++node) {
        if (!isNodeReachable_[node] || scene.nodes[node].mesh == kNone)
            continue;
        const Mesh& mesh = scene.meshes[scene.nodes[node].mesh];
        if (mesh.triangles.empty())
            continue;
        Instance instance{};
        instance.node = node;
        instance.mesh = uint32_t(scene.nodes[node].mesh);
        instance.firstVertex = firstVertex;
        instance.vertexCount = uint32_t(mesh.positions.size());
        instance.firstTriangle = uint32_t(triangles_.size());
        instance.triangleCount = uint32_t(mesh.triangles.size());
        instance.isMoving = isInstanceMoving(node);
        const bool isMirrored = mirrors(worldFromMeshOf(node).front());
        for (size_t i = 0; i < mesh.triangles.size(); ++i) {
            glm::uvec3 t = mesh.triangles[i] + firstVertex;
            if (isMirrored)
                std::swap(t.y, t.z);
            if (!instance.isMoving)
                staticTriangles_.push_back(uint32_t(triangles_.size()));
            triangles_.push_back(t);
            triangleMaterial_.push_back(mesh.triangleMaterial[i]);
            triangleInstance_.push_back(uint32_t(instances_.size()));
        }
        firstVertex += instance.vertexCount;
        instance.worldFromObject = glm::mat4(worldFromNode_[node]);
        placeVertices(instance);
        instances_.push_back(instance);
    }
    refuseWithoutArea();
    cutTriangles();
    mapTextures();
    for (uint32_t t : staticTriangles_)
        for (int corner = 0; corner < 3; ++corner)
            staticBounds_.add(positions_[triangles_[t][corner]]);
    updateBounds();
    if (staticTriangles_.empty())
        staticBounds_ = bounds_;
    if (options_.placedLightCount >= 0)
        placedLights_ = placeLights(*this, options_.placedLightCount, options_.seed);
    updateLightsAndCameras();
}

/// Throws unless a triangle has an area, or moves and may get one. As float, as it is drawn; but
/// where floats are coarser than a tenth, they cannot tell.
void World::refuseWithoutArea() const {
    for (uint32_t t = 0; t < triangles_.size(); ++t) {
        const glm::vec3 a = positions_[triangles_[t].x];
        constexpr float kCoarse = 1e6f;
        const glm::vec3 size = glm::abs(a);
        if (instances_[triangleInstance_[t]].isMoving ||
            glm::max(size.x, glm::max(size.y, size.z)) > kCoarse ||
            glm::cross(positions_[triangles_[t].y] - a, positions_[triangles_[t].z] - a) !=
                glm::vec3(0.0f))
            return;
    }
    throw Error(ErrorKind::kInput, "scene '" + scene_->name +
                                       "': no triangle has an area, so there is nothing to light; "
                                       "check the positions and the scales of nodes");
}

void World::cutTriangles() {
    const auto maskOf = [this](uint32_t triangle) {
        return scene_->materials[triangleMaterial_[triangle]].alphaMask;
    };
    bool isAnyCut = false;
    for (uint32_t t = 0; t < triangles_.size(); ++t)
        isAnyCut |= maskOf(t) != kNone;
    if (!isAnyCut)
        return;
    for (const AlphaMask& mask : scene_->alphaMasks)
        masks_.add(mask);
    masks_.triangleCut.assign(triangles_.size(), kNotCut);
    // Instances of a mesh share its cuts, those that mirror it have their own.
    std::map<std::pair<uint32_t, bool>, uint32_t> firstCut;
    for (const Instance& instance : instances_) {
        const Mesh& mesh = scene_->meshes[instance.mesh];
        const glm::uvec3 firstVertex(instance.firstVertex);
        const bool isMirrored = // at time 0, as corners
            mirrors(worldFromMeshOf(instance.node).front());
        const auto [known, isNew] =
            firstCut.emplace(std::pair(instance.mesh, isMirrored), uint32_t(masks_.cuts.size()));
        uint32_t cut = known->second;
        for (uint32_t i = 0; i < instance.triangleCount; ++i) {
            const uint32_t t = instance.firstTriangle + i;
            if (maskOf(t) == kNone)
                continue;
            if (isNew) {
                CutTriangle corners{uint32_t(maskOf(t)), {}};
                const glm::uvec3 v = triangles_[t] - firstVertex;
                for (int corner = 0; corner < 3; ++corner)
                    corners.uv[corner] = mesh.uv.empty() ? glm::vec2(0.0f) : mesh.uv[v[corner]];
                masks_.cuts.push_back(corners);
            }
            masks_.triangleCut[t] = cut++;
        }
    }
}

void World::mapTextures() {
    const auto hasTexture = [this](const Mesh& mesh) {
        return std::any_of(mesh.triangleMaterial.begin(), mesh.triangleMaterial.end(),
                           [this](uint32_t material) {
                               return scene_->materials[material].baseColorTexture != kNone;
                           });
    };
    std::map<uint32_t, uint32_t> firstUv; // by mesh
    for (size_t i = 0; i < instances_.size(); ++i) {
        const Instance& instance = instances_[i];
        const Mesh& mesh = scene_->meshes[instance.mesh];
        auto known = firstUv.find(instance.mesh);
        if (known == firstUv.end()) {
            if (!hasTexture(mesh))
                continue;
            known = firstUv.emplace(instance.mesh, uint32_t(uv_.size())).first;
            uv_.insert(uv_.end(), mesh.uv.begin(), mesh.uv.end());
            if (mesh.uv.empty())
                uv_.resize(uv_.size() + mesh.positions.size(), glm::vec2(0.0f));
        }
        instanceUv_.resize(instances_.size(), 0);
        instanceUv_[i] = known->second - instance.firstVertex; // modulo 2^32
    }
    if (uv_.empty())
        return;
    for (const Material& material : scene_->materials)
        materialTexture_.push_back(
            material.baseColorTexture == kNone ? kNoTexture : uint32_t(material.baseColorTexture));
}

BaseColorView World::baseColors() const {
    if (uv_.empty())
        return {};
    return {viewOf(materialTexture_),
            viewOf(instanceUv_),
            viewOf(uv_),
            viewOf(scene_->textures.textures),
            viewOf(scene_->textures.texels),
            viewOf(linearFromSrgb())};
}

/// Finds the skins that nodes of the scene have, and the nodes of their joints, which need not be
/// in the scene.
void World::placeSkins() {
    worldFromMeshOfSkin_.resize(scene_->skins.size());
    isSkinMoving_.assign(scene_->skins.size(), 0);
    std::vector<uint8_t> isPlaced = isNodeReachable_;
    for (size_t i = 0, count = placedNodes_.size(); i < count; ++i) {
        const int skin = scene_->nodes[placedNodes_[i]].skin;
        if (skin == kNone || !worldFromMeshOfSkin_[skin].empty())
            continue;
        worldFromMeshOfSkin_[skin].resize(scene_->skins[skin].joints.size());
        for (const int joint : scene_->skins[skin].joints) {
            const auto first = placedNodes_.end() - placedNodes_.begin();
            for (int node = joint; node != kNone && !isPlaced[node];
                 node = scene_->nodes[node].parent) {
                isPlaced[node] = 1;
                placedNodes_.push_back(uint32_t(node));
            }
            std::reverse(placedNodes_.begin() + first, placedNodes_.end());
        }
    }
}

void World::updateTransforms(bool movingOnly) {
    for (uint32_t node : placedNodes_) {
        if (movingOnly && !isNodeMoving_[node])
            continue;
        LocalTransform local = scene_->nodes[node].local;
        for (uint32_t c : nodeChannels_[node]) {
            const AnimationChannel& channel = *channels_[c];
            const glm::vec4 v = sampleChannel(channel, timeSeconds_);
            local.hasMatrix = false; // the reader refuses animated matrices
            switch (channel.path) {
            case AnimationChannel::Path::kTranslation:
                local.translation = glm::vec3(v);
                break;
            case AnimationChannel::Path::kRotation:
                local.rotation = glm::quat(v.w, v.x, v.y, v.z);
                break;
            case AnimationChannel::Path::kScale:
                local.scale = glm::vec3(v);
                break;
            case AnimationChannel::Path::kMorphWeight: // of weightChannels_
                break;
            }
        }
        const int parent = scene_->nodes[node].parent;
        const glm::dmat4 parentFromLocal = local.parentFromLocalDouble();
        worldFromNode_[node] =
            parent == kNone ? parentFromLocal : worldFromNode_[parent] * parentFromLocal;
    }
    for (size_t s = 0; s < worldFromMeshOfSkin_.size(); ++s) {
        if (movingOnly && !isSkinMoving_[s])
            continue;
        const Skin& skin = scene_->skins[s];
        std::vector<glm::dmat4>& worldFromMesh = worldFromMeshOfSkin_[s];
        for (size_t j = 0; j < worldFromMesh.size(); ++j)
            worldFromMesh[j] = worldFromNode_[skin.joints[j]] * glm::dmat4(skin.jointFromMesh[j]);
    }
}

bool World::isInstanceMoving(uint32_t node) const {
    const Node& n = scene_->nodes[node];
    if (!weightChannels_[node].empty())
        return true;
    return n.skin == kNone ? isNodeMoving_[node] : isSkinMoving_[n.skin];
}

// Returns what places the mesh of a node at the current time: a matrix for each joint of its skin,
// or one. They are the world's, until its time changes.
std::span<const glm::dmat4> World::worldFromMeshOf(uint32_t node) const {
    const int skin = scene_->nodes[node].skin;
    if (skin == kNone)
        return {&worldFromNode_[node], 1};
    return worldFromMeshOfSkin_[skin];
}

// Returns how the mesh of a node is posed at the current time.
MeshPose World::poseOf(uint32_t node) const {
    const Node& n = scene_->nodes[node];
    MeshPose pose;
    const std::vector<float>& weights =
        n.morphWeights.empty() ? scene_->meshes[n.mesh].morphWeights : n.morphWeights;
    pose.morphWeights.assign(weights.begin(), weights.end());
    for (const uint32_t c : weightChannels_[node])
        pose.morphWeights[channels_[c]->morphTarget] =
            double(sampleChannel(*channels_[c], timeSeconds_).x);
    pose.worldFromMesh = worldFromMeshOf(node);
    pose.isSkinned = n.skin != kNone;
    return pose;
}

void World::placeVertices(const Instance& instance) {
    const Mesh& mesh = scene_->meshes[instance.mesh];
    const MeshPose pose = poseOf(instance.node);
    for (uint32_t i = 0; i < instance.vertexCount; ++i) {
        const glm::dvec3 p = posedVertex(mesh, pose, i);
        if (!isWithinReach(p))
            throw Error(ErrorKind::kInput,
                        "scene '" + scene_->name + "': " + nodeLabel(*scene_, instance.node) +
                            " places vertex " + std::to_string(i) + " of mesh " +
                            std::to_string(instance.mesh) + " at " + pointText(p) + kOutOfReach);
        positions_[instance.firstVertex + i] = glm::vec3(p);
    }
}

/// Throws unless a node's light or camera lies where distances to it are floats.
void World::requireWithinReach(uint32_t node, const std::string& what) const {
    const glm::dvec3 p(worldFromNode_[node][3]);
    if (!isWithinReach(p))
        throw Error(ErrorKind::kInput, "scene '" + scene_->name + "': " + nodeLabel(*scene_, node) +
                                           " places its " + what + " at " + pointText(p) +
                                           kOutOfReach);
}

void World::updateBounds() {
    bounds_ = staticTriangles_.empty() ? Box{} : staticBounds_;
    std::vector<Box> boxes(instances_.size());
    parallelFor<CpuTag>(
        instances_.size(),
        [&](size_t i) {
            const Instance& instance = instances_[i];
            for (uint32_t t = 0; t < instance.triangleCount && instance.isMoving; ++t)
                for (int corner = 0; corner < 3; ++corner)
                    boxes[i].add(positions_[triangles_[instance.firstTriangle + t][corner]]);
        },
        8);
    for (const Box& box : boxes)
        bounds_.add(box);
}

void World::updateLightsAndCameras() {
    lights_ = placedLights_;
    cameras_.clear();
    for (uint32_t node = 0; node < scene_->nodes.size(); ++node) {
        if (!isNodeReachable_[node])
            continue;
        const Node& n = scene_->nodes[node];
        const glm::dmat4& m = worldFromNode_[node];
        const glm::dvec3 forward = normalizedOr(-glm::dvec3(m[2]), glm::dvec3(0, 0, -1));
        if (n.light != kNone && options_.placedLightCount < 0) {
            const LightSource& source = scene_->lights[n.light];
            const glm::vec3 intensity = source.color * source.intensity;
            const float strongest = std::max({intensity.x, intensity.y, intensity.z});
            if (!(strongest > 0.0f))
                continue;
            if (source.kind != Light::kSun)
                requireWithinReach(node, "light");
            // A node that moves may hide its light so for a time.
            if (source.kind != Light::kPoint && !isNodeMoving_[node] &&
                glm::dvec3(m[2]) == glm::dvec3(0.0))
                throw Error(ErrorKind::kInput, "scene '" + scene_->name +
                                                   "': " + nodeLabel(*scene_, node) +
                                                   " has the scale 0, so that its light has no "
                                                   "direction; give it another scale");
            Light light;
            light.positionWorld = glm::vec3(glm::dvec3(m[3]));
            const bool isHidden =
                source.kind != Light::kPoint && glm::dvec3(m[2]) == glm::dvec3(0.0);
            light.intensity = isHidden ? glm::vec3(0.0f) : intensity; // its place in the list stays
            light.kind = source.kind;
            light.rangeWorld =
                source.rangeWorld > 0.0f
                    ? source.rangeWorld
                    : float(std::sqrt(double(strongest) / double(options_.rangeCutoff)));
            light.directionWorld = glm::vec3(forward);
            if (source.kind == Light::kSpot) {
                // The one use of libm: a cosine of an authored constant, for shading and culling
                // alike.
                light.cosInner = float(std::cos(double(source.innerConeAngle)));
                light.cosOuter = float(std::cos(double(source.outerConeAngle)));
            }
            if (source.kind == Light::kSun)
                surroundScene(light, bounds_);
            light.isMoving = isNodeMoving_[node];
            lights_.push_back(light);
        }
        if (n.camera != kNone) {
            const CameraSource& source = scene_->cameras[n.camera];
            requireWithinReach(node, "camera");
            Camera camera;
            camera.positionWorld = glm::vec3(glm::dvec3(m[3]));
            camera.forward = glm::vec3(forward);
            // Gram-Schmidt; a node that squashes its Y axis away gets any vector across.
            const glm::dvec3 side =
                std::fabs(forward.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
            const glm::dvec3 across = normalizedOr(side - forward * glm::dot(side, forward), side);
            const glm::dvec3 y = normalizedOr(glm::dvec3(m[1]), across);
            camera.up = glm::vec3(normalizedOr(y - forward * glm::dot(y, forward), across));
            camera.yfov = source.yfov;
            camera.znear = source.znear;
            camera.zfar = source.zfar;
            if (!std::isfinite(camera.zfar)) {
                // Nothing authored: the farthest corner of the bounds, and a margin for rounding.
                const glm::vec3 far = glm::max(glm::abs(bounds_.min - camera.positionWorld),
                                               glm::abs(bounds_.max - camera.positionWorld));
                camera.zfar = std::max(1.01f * glm::length(far), 2.0f * camera.znear);
            }
            cameras_.push_back(camera);
        }
    }
}

std::vector<uint32_t> World::setTime(float timeSeconds) {
    timeSeconds_ = timeSeconds;
    try {
        return moveInstances();
    } catch (...) { // some may have moved: the world is at no time
        timeSeconds_ = std::numeric_limits<float>::quiet_NaN();
        throw;
    }
}

std::vector<uint32_t> World::moveInstances() {
    updateTransforms(true);
    std::vector<uint32_t> moved;
    for (uint32_t i = 0; i < instances_.size(); ++i) {
        if (!instances_[i].isMoving)
            continue;
        instances_[i].worldFromObject = glm::mat4(worldFromNode_[instances_[i].node]);
        moved.push_back(i);
    }
    // The first is rethrown, whatever the order of threads.
    std::vector<std::exception_ptr> failed(moved.size());
    parallelFor<CpuTag>(
        moved.size(),
        [&](size_t i) {
            try {
                placeVertices(instances_[moved[i]]);
            } catch (...) {
                failed[i] = std::current_exception();
            }
        },
        1);
    for (const std::exception_ptr& exception : failed)
        if (exception)
            std::rethrow_exception(exception);
    updateBounds();
    updateLightsAndCameras();
    return moved;
}

static_assert(sizeof(Light) == 15 * sizeof(float)); // there is no padding in what is hashed

std::string World::geometryHash() const {
    ContentHasher hasher;
    // Nine floats a triangle, in order, as their bits; chunks spare the call per triangle.
    std::vector<glm::vec3> chunk;
    constexpr size_t kChunkTriangles = 1024;
    chunk.reserve(3 * kChunkTriangles);
    const auto flush = [&] {
        hasher.add(chunk.data(), chunk.size() * sizeof(glm::vec3));
        chunk.clear();
    };
    for (uint32_t t : staticTriangles_) {
        for (int corner = 0; corner < 3; ++corner)
            chunk.push_back(positions_[triangles_[t][corner]]);
        if (chunk.size() == 3 * kChunkTriangles)
            flush();
    }
    flush();
    // Without masks nothing more is hashed: such scenes keep their former hashes.
    std::map<uint32_t, std::array<uint8_t, 16>> maskHashes;
    for (size_t i = 0; i < staticTriangles_.size() && !masks_.triangleCut.empty(); ++i) {
        const uint32_t index = masks_.triangleCut[staticTriangles_[i]];
        if (index == kNotCut)
            continue;
        const CutTriangle& cut = masks_.cuts[index];
        if (!maskHashes.count(cut.mask))
            maskHashes[cut.mask] = masks_.contentHash(cut.mask);
        const uint64_t which = i;
        hasher.add(&which, sizeof which);
        hasher.add(cut.uv, sizeof cut.uv);
        hasher.add(maskHashes[cut.mask].data(), 16);
    }
    return hashText(hasher.hash());
}

std::string World::contentHash() const {
    ContentHasher hasher;
    hasher.add(positions_.data(), positions_.size() * sizeof(positions_[0]));
    hasher.add(triangles_.data(), triangles_.size() * sizeof(triangles_[0]));
    hasher.add(lights_.data(), lights_.size() * sizeof(Light));
    return hashText(hasher.hash());
}

std::string World::lightHash() const {
    return hashText(shadowdag::contentHash(lights_.data(), lights_.size() * sizeof(Light)));
}

} // namespace shadowdag
