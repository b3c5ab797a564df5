// SPDX-License-Identifier: Apache-2.0
// Hand-built triangles and view samples for tests of the truth and of the error.
#pragma once

#include "hybrid/clusters/pairs.h"
#include "hybrid/gbuffer/gbuffer.h"
#include "scenes/scene.h"

#include <cstdint>
#include <vector>

namespace shadowdag::test {

/// Grows triangle by triangle; view() is valid until the next addition.
struct TriangleSoup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    uint32_t add(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        const auto first = uint32_t(positions.size());
        positions.insert(positions.end(), {a, b, c});
        triangles.emplace_back(first, first + 1, first + 2);
        return uint32_t(triangles.size() - 1);
    }
    /// Adds a, b, c, d around as two triangles that share a diagonal; returns the first.
    uint32_t addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                     const glm::vec3& d) {
        const uint32_t first = add(a, b, c);
        add(a, c, d);
        return first;
    }
    /// Adds the square |x - center.x|, |z - center.z| <= half at height center.y.
    uint32_t addLevelSquare(const glm::vec3& center, float half) {
        return addQuad(center + glm::vec3(-half, 0, -half), center + glm::vec3(-half, 0, half),
                       center + glm::vec3(half, 0, half), center + glm::vec3(half, 0, -half));
    }
    /// Adds the surface of a box, 12 triangles.
    void addBox(const glm::vec3& lo, const glm::vec3& hi) {
        const auto corner = [&](int i) {
            return glm::vec3(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z);
        };
        constexpr int kFaces[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                      {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
        for (const auto& f : kFaces)
            addQuad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]));
    }
    void move(const glm::vec3& by) {
        for (glm::vec3& p : positions)
            p += by;
    }
    TriangleView view() const { return {viewOf(positions), viewOf(triangles)}; }
    Mesh mesh(uint32_t material = 0) const {
        Mesh mesh;
        mesh.positions = positions;
        mesh.triangles = triangles;
        mesh.triangleMaterial.assign(triangles.size(), material);
        return mesh;
    }
};

/// View samples in one row, and their pairs with lights.
struct SampleRow {
    std::vector<glm::vec3> position, normal;
    std::vector<float> depth;
    std::vector<uint32_t> triangle;

    void add(const glm::vec3& positionWorld, const glm::vec3& normalWorld, uint32_t receiver) {
        position.push_back(positionWorld);
        normal.push_back(normalWorld);
        depth.push_back(1.0f);
        triangle.push_back(receiver);
    }
    GBufferView view() const {
        return {viewOf(position),
                viewOf(normal),
                viewOf(depth),
                viewOf(triangle),
                uint32_t(position.size()),
                1};
    }
    /// Returns every pair of a sample with a light by pairs.h.
    PairList pairs(const std::vector<Light>& lights) const {
        PairList list;
        list.sampleStart.push_back(0);
        for (size_t s = 0; s < position.size(); ++s) {
            for (uint32_t l = 0; l < lights.size(); ++l)
                if (triangle[s] != kBackground && isPair(lights[l], position[s], normal[s]))
                    list.light.push_back(l);
            list.sampleStart.push_back(list.light.size());
        }
        return list;
    }
};

inline Light pointLight(const glm::vec3& positionWorld, float rangeWorld = 1e6f) {
    Light light;
    light.positionWorld = positionWorld;
    light.rangeWorld = rangeWorld;
    return light;
}

} // namespace shadowdag::test
