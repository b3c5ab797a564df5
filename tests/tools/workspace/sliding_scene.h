// SPDX-License-Identifier: Apache-2.0
// A small scene with a moving object.
#pragma once

#include "tools/workspace/workspace.h"

#include <utility>

namespace shadowdag {

/// A floor with a crate on it and a lamp above, and a second crate that slides over the floor.
inline LoadedScene slidingScene() {
    Scene scene;
    scene.name = "sliding";
    scene.materials.resize(1);
    const auto addBox = [&](const glm::vec3& lo, const glm::vec3& hi) {
        Mesh mesh;
        for (int i = 0; i < 8; ++i)
            mesh.positions.push_back(
                {i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
        mesh.triangles = {{0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}, {0, 4, 5}, {0, 5, 1},
                          {2, 3, 7}, {2, 7, 6}, {0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}};
        mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
        scene.nodes.emplace_back().mesh = int(scene.meshes.size());
        scene.roots.push_back(int(scene.nodes.size()) - 1);
        scene.meshes.push_back(mesh);
    };
    addBox({-5, -0.2f, -5}, {5, 0, 5});
    addBox({-1, 0, -1}, {0, 1, 0});
    addBox({1, 0, 1}, {1.5f, 0.5f, 1.5f});
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 8.0f;
    scene.lights[0].intensity = 20.0f;
    scene.nodes.emplace_back().light = 0;
    scene.nodes.back().local.translation = {0.5f, 3, 0.5f};
    scene.roots.push_back(3);
    AnimationChannel slide;
    slide.node = 2;
    slide.path = AnimationChannel::Path::kTranslation;
    slide.times = {0, 4};
    slide.values = {{0, 0, 0, 0}, {3, 0, 0, 0}};
    scene.animations.push_back({"slide", {slide}});
    return loadedScene(std::move(scene));
}

/// Returns a workspace of it, seen from a side.
inline Workspace slidingWorkspace() {
    WorkspaceOptions options;
    options.camera = "0.5,3,7,0,0,0";
    return Workspace(slidingScene(), options);
}

} // namespace shadowdag
