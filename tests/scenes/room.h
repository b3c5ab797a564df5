// SPDX-License-Identifier: Apache-2.0
// A closed room for tests of placement.
#pragma once

#include "scenes/scene.h"

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

} // namespace shadowdag::test
