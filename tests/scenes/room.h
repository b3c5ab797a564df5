// SPDX-License-Identifier: Apache-2.0
// A closed room for tests of placement.
#pragma once

#include "scenes/scene.h"

#include <utility>

namespace shadowdag::test {

/// Returns a box from `min` to `max` whose faces turn inwards, as one mesh of twelve triangles.
inline Scene room(const glm::vec3& min, const glm::vec3& max) {
    Scene scene;
    scene.name = "room";
    scene.materials.resize(1);
    Mesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.emplace_back(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y,
                                    i & 4 ? max.z : min.z);
    // Quads counter-clockwise as seen from inside.
    constexpr uint32_t kQuads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& q : kQuads) {
        const glm::vec3 a = mesh.positions[q[0]], b = mesh.positions[q[1]],
                        c = mesh.positions[q[2]];
        const bool isInward = glm::dot(glm::cross(b - a, c - a), 0.5f * (min + max) - a) > 0.0f;
        mesh.triangles.emplace_back(q[0], q[isInward ? 1 : 2], q[isInward ? 2 : 1]);
        mesh.triangles.emplace_back(q[0], q[isInward ? 2 : 3], q[isInward ? 3 : 2]);
    }
    mesh.triangleMaterial.assign(12, 0);
    scene.meshes = {mesh};
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.roots = {0};
    return scene;
}

/// Adds another scene's only mesh, its faces turned over when `isTurned`.
inline void addMesh(Scene& scene, const Scene& other, bool isTurned) {
    Mesh mesh = other.meshes[0];
    if (isTurned)
        for (glm::uvec3& t : mesh.triangles)
            std::swap(t.y, t.z);
    scene.nodes.emplace_back();
    scene.nodes.back().mesh = int(scene.meshes.size());
    scene.roots.push_back(uint32_t(scene.nodes.size() - 1));
    scene.meshes.push_back(std::move(mesh));
}

/// Returns a furnished hall inside a shell: from 0 to (20, 8, 12) is the shell, seen from within;
/// two metres further in stand the hall's double walls, 0.2 thick. Gap and hall are both closed.
/// The hall, from 2.2 to (17.8, 3, 9.8), has 24 pillars.
inline Scene hallInShell() {
    Scene scene = room({0, 0, 0}, {20, 8, 12});
    addMesh(scene, room({2, -0.1f, 2}, {18, 8.1f, 10}), true); // the gap's inner wall
    addMesh(scene, room({2.2f, 0, 2.2f}, {17.8f, 3, 9.8f}), false);
    for (int i = 0; i < 24; ++i) {
        const float x = 3.5f + 2.5f * float(i % 6), z = 3.2f + 1.8f * float(i / 6);
        addMesh(scene, room({x, 0, z}, {x + 0.3f, 1.0f + 0.2f * float(i % 5), z + 0.3f}), true);
    }
    return scene;
}

} // namespace shadowdag::test
