// SPDX-License-Identifier: Apache-2.0
// A small room with a blocker and some lights, and a renderer of it, for whole frames.
#pragma once

#include "hybrid/frame.h"
#include "tests/hybrid/triangle_soup.h"
#include "voxel/voxelize.h"

#include <random>
#include <utility>
#include <vector>

namespace shadowdag::test {

constexpr float kBlockerHeight = 1.0f, kBlockerHalf = 0.5f, kLightHeight = 2.0f;

// A floor of 12 m at y = 0, a level square above it, the given lights.
inline Scene blockerScene(const std::vector<glm::vec3>& lights, bool hasRandomTriangles = false) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 6.0f);
    soup.addLevelSquare({0, kBlockerHeight, 0}, kBlockerHalf);
    if (hasRandomTriangles) {
        std::mt19937_64 random(21);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        for (int i = 0; i < 300; ++i) {
            const glm::vec3 c(5 * unit(random), 1.5f + unit(random), 5 * unit(random));
            glm::vec3 corner[3];
            for (glm::vec3& p : corner)
                p = c + 0.4f * glm::vec3(unit(random), unit(random), unit(random));
            soup.add(corner[0], corner[1], corner[2]);
        }
    }
    Scene scene;
    scene.materials.resize(2);
    scene.materials[1].baseColor = {0.5f, 0.25f, 1.0f};
    scene.materials[1].emission = {0.0f, 0.125f, 0.0f};
    scene.meshes = {soup.mesh(1)};
    scene.nodes.resize(1 + lights.size());
    scene.nodes[0].mesh = 0;
    scene.roots = {0};
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 9.0f;
    scene.lights[0].intensity = 10.0f;
    for (size_t l = 0; l < lights.size(); ++l) {
        scene.nodes[1 + l].light = 0;
        scene.nodes[1 + l].local.translation = lights[l];
        scene.roots.push_back(int(1 + l));
    }
    return scene;
}

/// Adds a mesh under a node of its own that an animation moves. @param way its node is set
inline void addMoving(Scene& scene, const TriangleSoup& soup, const glm::vec3& at,
                      AnimationChannel way) {
    scene.meshes.push_back(soup.mesh());
    way.node = uint32_t(scene.nodes.size());
    scene.roots.push_back(int(way.node));
    Node& node = scene.nodes.emplace_back();
    node.mesh = int(scene.meshes.size()) - 1;
    node.local.translation = at;
    scene.animations.push_back({"way", {std::move(way)}});
}

inline Camera roomCamera() {
    Camera camera;
    camera.positionWorld = {0.3f, 4.0f, 5.0f};
    camera.forward = glm::normalize(glm::vec3(-0.05f, -0.75f, -1.0f));
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    return camera;
}

inline FrameOptions smallFrame() {
    FrameOptions options;
    options.width = 160;
    options.height = 96;
    options.maps.poolBytes = 64ull << 20;
    return options;
}

inline Dag dagOf(const World& world, uint32_t resolutionLog2) {
    return voxelize(world.triangles(), viewOf(world.staticTriangles()),
                    gridAround(world.boundsWorld(), resolutionLog2));
}

inline const std::vector<glm::vec3> kManyLights{
    {0, kLightHeight, 0}, {3, 2.5f, 1}, {-3, 3, -2}, {1, 0.7f, 3}, {-2, 2, 4}};

// A world and its renderer, kept together.
struct Stage {
    explicit Stage(Scene s, uint32_t resolutionLog2 = 8)
        : scene(std::move(s)), world(scene, {}), dag(dagOf(world, resolutionLog2)),
          renderer(Backend::kCpu, world, dag) {}
    Scene scene;
    World world;
    Dag dag;
    FrameRenderer renderer;
};

} // namespace shadowdag::test
