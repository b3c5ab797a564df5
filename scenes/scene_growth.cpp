// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_growth.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/scene_growth_parts.h"

#include <algorithm>
#include <limits>

namespace shadowdag {

namespace {

constexpr uint64_t kMost = std::numeric_limits<uint64_t>::max();

/// Adds copies on all places of a square of (step + 1)^2 but the one in its middle, or next to it.
void repeat(Mesh& mesh, const Box& bounds, uint64_t step) {
    const size_t vertexCount = mesh.positions.size(), triangleCount = mesh.triangles.size();
    const uint64_t side = step + 1, places = productOf(side, side);
    requireIndices(productOf(places, vertexCount), productOf(places, triangleCount));
    const glm::dvec3 size = glm::dvec3(bounds.max) - glm::dvec3(bounds.min);
    const double gap = std::max({size.x, size.y, size.z}) / 64;
    mesh.positions.reserve(places * vertexCount);
    mesh.triangles.reserve(places * triangleCount);
    mesh.triangleMaterial.reserve(places * triangleCount);
    const int64_t first = -int64_t(step / 2), last = first + int64_t(step);
    for (int64_t z = first; z <= last; ++z)
        for (int64_t x = first; x <= last; ++x) {
            if (x == 0 && z == 0)
                continue;
            pollCpu();
            const glm::dvec3 offset(double(x) * (size.x + gap), 0.0, double(z) * (size.z + gap));
            const uint32_t firstVertex = uint32_t(mesh.positions.size());
            for (size_t v = 0; v < vertexCount; ++v) {
                mesh.positions.push_back(glm::vec3(glm::dvec3(mesh.positions[v]) + offset));
                if (!mesh.uv.empty())
                    mesh.uv.push_back(mesh.uv[v]);
            }
            for (size_t t = 0; t < triangleCount; ++t) {
                mesh.triangles.push_back(mesh.triangles[t] + firstVertex);
                mesh.triangleMaterial.push_back(mesh.triangleMaterial[t]);
            }
        }
}

} // namespace

void requireIndices(uint64_t vertexCount, uint64_t triangleCount) {
    if (std::max(vertexCount, triangleCount) >= std::numeric_limits<uint32_t>::max())
        throw Error(ErrorKind::kResource, "a scene of " + std::to_string(triangleCount) +
                                              " triangles and " + std::to_string(vertexCount) +
                                              " vertices: must have fewer than 2^32 of each; grow "
                                              "it less");
}

uint64_t grownCount(Growth growth, uint64_t triangleCount, uint64_t step) {
    switch (growth) {
    case Growth::kTessellate: {
        uint64_t count = triangleCount;
        for (uint64_t level = 0; level < step && count < kMost; ++level)
            count = productOf(4, count);
        return count;
    }
    case Growth::kInstance:
        return step == kMost ? kMost : productOf(triangleCount, productOf(step + 1, step + 1));
    case Growth::kLeaves:
        break;
    }
    const uint64_t ofLeaves = productOf(2, step);
    return ofLeaves > kMost - triangleCount ? kMost : triangleCount + ofLeaves;
}

uint64_t nearestStep(Growth growth, uint64_t triangleCount, uint64_t askedCount) {
    if (askedCount <= triangleCount)
        return 0;
    if (growth == Growth::kLeaves)
        return (askedCount - triangleCount) / 2;
    uint64_t step = 0;
    while (grownCount(growth, triangleCount, step + 1) <= askedCount)
        ++step;
    const double below = double(grownCount(growth, triangleCount, step)),
                 above = double(grownCount(growth, triangleCount, step + 1));
    const double asked = double(askedCount);
    return asked * asked > below * above ? step + 1 : step;
}

Scene flattened(const World& world) {
    const Scene& from = world.scene();
    const TriangleView triangles = world.triangles();
    Mesh mesh;
    mesh.name = from.name;
    mesh.positions.assign(triangles.positions.begin(), triangles.positions.end());
    mesh.triangles.assign(triangles.triangles.begin(), triangles.triangles.end());
    mesh.triangleMaterial = world.triangleMaterial();
    if (std::any_of(from.meshes.begin(), from.meshes.end(),
                    [](const Mesh& of) { return !of.uv.empty(); })) {
        mesh.uv.assign(mesh.positions.size(), glm::vec2(0.0f));
        for (const Instance& instance : world.instances()) {
            const std::vector<glm::vec2>& uv = from.meshes[instance.mesh].uv;
            std::copy(uv.begin(), uv.end(), mesh.uv.begin() + instance.firstVertex);
        }
    }
    Scene scene;
    scene.name = from.name;
    scene.materials = from.materials;
    scene.alphaMasks = from.alphaMasks;
    scene.textures = from.textures;
    scene.nodes = from.nodes;
    scene.roots = from.roots;
    scene.lights = from.lights;
    scene.cameras = from.cameras;
    scene.animations = from.animations;
    for (Animation& animation : scene.animations)
        std::erase_if(animation.channels, [](const AnimationChannel& channel) {
            return channel.path == AnimationChannel::Path::kMorphWeight;
        });
    for (Node& node : scene.nodes) {
        node.mesh = node.skin = kNone;
        node.morphWeights.clear();
    }
    Node node;
    node.name = mesh.name;
    node.mesh = 0;
    scene.roots.push_back(int(scene.nodes.size()));
    scene.nodes.push_back(std::move(node));
    scene.meshes.push_back(std::move(mesh));
    return scene;
}

Scene grownScene(const World& world, Growth growth, uint64_t step, const LeafOptions& leaves) {
    SDAG_ASSERT(leaves.cover > 0.0);
    Scene scene = flattened(world);
    if (step == 0)
        return scene;
    switch (growth) {
    case Growth::kTessellate:
        for (uint64_t level = 0; level < step; ++level)
            divideTriangles(scene.meshes.front());
        break;
    case Growth::kInstance:
        repeat(scene.meshes.front(), world.boundsWorld(), step);
        break;
    case Growth::kLeaves:
        strewLeaves(scene, world, step, leaves);
        break;
    }
    return scene;
}

} // namespace shadowdag
