// SPDX-License-Identifier: Apache-2.0
// Hand-built triangles with all that exact rays need.
#pragma once

#include "hybrid/rays/exact_ray.h"
#include "tests/hybrid/random.h"
#include "tests/hybrid/triangle_soup.h"

#include <numeric>

namespace shadowdag::test {

/// Triangles and a hierarchy over all of them.
struct ExactStage {
    TriangleSoup soup;
    AlphaMaskSet masks;
    std::vector<uint32_t> all;
    TruthGeometry geometry;
    TriangleBvh bvh;

    void build() {
        geometry.triangles = soup.view();
        geometry.triangles.masks = masks.view();
        const TruthSpace space = truthSpaceOf(geometry.triangles.positions);
        geometry.origin = space.origin;
        geometry.diagonal = space.diagonal;
        all.resize(geometry.triangles.count());
        std::iota(all.begin(), all.end(), 0u);
        bvh = buildTriangleBvh(geometry, viewOf(all));
    }
    glm::vec3 normalOf(uint32_t triangle) const {
        const TriangleView& t = geometry.triangles;
        return glm::cross(t.vertex(triangle, 1) - t.vertex(triangle, 0),
                          t.vertex(triangle, 2) - t.vertex(triangle, 0));
    }
};

/// Returns the weights of a random point of a triangle.
inline glm::vec3 insideWeights(Random& random) {
    const double a = random(), b = random() * (1.0 - a);
    return glm::vec3(a, b, 1.0 - a - b);
}

/// A clump of small triangles, long ones, slivers and degenerate ones.
inline void addClump(ExactStage& stage, Random& random, const glm::vec3& around) {
    for (int i = 0; i < 250; ++i) {
        const glm::vec3 at = random.inCube(1.0) + around;
        stage.soup.add(at, at + random.inCube(0.2), at + random.inCube(0.2));
    }
    for (int i = 0; i < 30; ++i)
        stage.soup.add(random.inCube(4) + around, random.inCube(4) + around,
                       random.inCube(4) + around);
    for (int i = 0; i < 30; ++i) {
        const glm::vec3 a = random.inCube(3) + around, b = random.inCube(3) + around;
        stage.soup.add(a, b, 0.5f * (a + b) + random.inCube(1e-5));
    }
    for (int i = 0; i < 5; ++i) {
        const glm::vec3 a = random.inCube(4) + around, b = random.inCube(4) + around;
        stage.soup.add(a, b, b);
        stage.soup.add(a, a, a);
    }
}

} // namespace shadowdag::test
