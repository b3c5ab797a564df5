// SPDX-License-Identifier: Apache-2.0
#include "tests/voxel/soup.h"
#include "voxel/dag_trace.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

struct Receiver {
    Soup soup;
    VoxelGrid grid;
    Dag dag;
    glm::vec3 normal;
};

/// A triangle that crosses much of a grid, of any orientation (some axis-parallel, some diagonal),
/// anywhere.
Receiver makeReceiver(std::mt19937& random) {
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto point = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
    Receiver r;
    const float far = random() % 3 == 0 ? 1000.0f : 3.0f;
    const glm::vec3 centre = far * point();
    glm::vec3 a = point(), b = point();
    if (random() % 4 == 0)
        a = glm::vec3(glm::ivec3(2.0f * a)), b = glm::vec3(glm::ivec3(2.0f * b));
    if (glm::length(glm::cross(a, b)) < 0.05f)
        a = glm::vec3(1, 0, 0), b = glm::vec3(0, 1, 0);
    r.soup.add(centre - a - b, centre + a, centre + b);
    Box box;
    box.add(centre - 2.5f);
    box.add(centre + 2.5f);
    r.grid = gridAround(box, 6 + random() % 4);
    r.dag = voxelize(r.soup.view(), r.soup.all(), r.grid);
    const TriangleView t = r.soup.view();
    r.normal = glm::normalize(
        glm::cross(t.vertex(0, 1) - t.vertex(0, 0), t.vertex(0, 2) - t.vertex(0, 0)));
    return r;
}

glm::vec3 pointOn(const Soup& soup, std::mt19937& random) {
    std::uniform_real_distribution<float> unit(0, 1);
    float u = unit(random), v = unit(random);
    if (u + v > 1)
        u = 1 - u, v = 1 - v;
    const TriangleView t = soup.view();
    return t.vertex(0, 0) * (1 - u - v) + t.vertex(0, 1) * u + t.vertex(0, 2) * v;
}

TEST(ShadowSegment, PlanarReceiverOfAnyOrientationNeverSeesItsOwnVoxels) {
    std::mt19937 random(41);
    std::uniform_real_distribution<float> unit(-1, 1);
    int shadowedWithout = 0;
    for (int plane = 0; plane < 200; ++plane) {
        const Receiver r = makeReceiver(random);
        ASSERT_FALSE(r.dag.empty());
        for (int i = 0; i < 200; ++i) {
            const glm::vec3 n = random() % 2 ? r.normal : -r.normal;
            const glm::vec3 p = pointOn(r.soup, random);
            // From grazing to upright, from inside the offset to outside the grid.
            const glm::vec3 aside = glm::vec3(unit(random), unit(random), unit(random));
            const float reach = std::exp2(-10 + 12.5f * std::abs(unit(random)));
            const float height = std::exp2(-14.0f * std::abs(unit(random)));
            const glm::vec3 light = p + reach * (height * n + aside - n * glm::dot(aside, n));
            if (!(glm::dot(light - p, n) > 0))
                continue;
            const uint32_t level = random() % 4;
            ASSERT_FALSE(
                occluded(r.dag.view(), shadowSegment(r.grid, p, n, light, 1.0f, level), level))
                << "seed 41 plane " << plane << " ray " << i << " level " << level << " reach "
                << reach << " height " << height;
            shadowedWithout +=
                occluded(r.dag.view(), shadowSegment(r.grid, p, n, light, 0.0f, level), level);
        }
    }
    EXPECT_GT(shadowedWithout, 20000); // what the offset is there for
}

// The offset is no larger than it must be: nine tenths of it let some planes shadow themselves.
TEST(ShadowSegment, OffsetIsTight) {
    std::mt19937 random(42);
    std::uniform_real_distribution<float> spread(-1, 1);
    int shadowed = 0;
    for (int plane = 0; plane < 100; ++plane) {
        const Receiver r = makeReceiver(random);
        for (int i = 0; i < 200; ++i) {
            const glm::vec3 p = pointOn(r.soup, random);
            // Grazing, so that what draws the start towards the light does not lift it.
            const glm::vec3 aside =
                glm::cross(r.normal, glm::vec3(spread(random), spread(random), spread(random)));
            const glm::vec3 light = p + aside + 1e-3f * r.normal;
            shadowed += occluded(r.dag.view(), shadowSegment(r.grid, p, r.normal, light, 0.9f, 0));
        }
    }
    EXPECT_GT(shadowed, 0);
}

TEST(ShadowSegment, EndsAreThoseOfTheFormula) {
    VoxelGrid grid;
    grid.resolutionLog2 = 6;
    grid.voxelSizeWorld = 0.5;
    grid.originWorld = glm::dvec3(-1, 0, 1);
    // Plane z = 5 (voxel 8), light 10 voxels above. Lift: one cell of 2 voxels, and one towards the
    // light; end: sqrt(3) cells back.
    const DagSegment s = shadowSegment(grid, {3, 4, 5}, {0, 0, 1}, {3, 4, 10}, 1.0f, 1);
    EXPECT_NEAR(s.from.x, 8, 1e-6);
    EXPECT_NEAR(s.from.y, 8, 1e-6);
    EXPECT_NEAR(s.from.z, 8 + 2 + 2, 2e-3);
    EXPECT_GT(s.from.z, 8 + 2 + 2);
    EXPECT_NEAR(s.to.z, 18 - 2 * std::sqrt(3.0), 1e-5);
    // A diagonal normal reaches sqrt(3) cells up, 1 along each axis, and 1 / sqrt(3) further.
    const float d = 1 / std::sqrt(3.0f);
    const DagSegment t = shadowSegment(grid, {3, 4, 5}, {d, d, d}, {13, 14, 15}, 1.0f, 0);
    for (int a = 0; a < 3; ++a)
        EXPECT_NEAR(t.from[a], 8 + 1 + 1 / std::sqrt(3.0), 2e-3);
    // Halfway at most: 2.5 voxels from the lifted start to the light, sqrt(3) of them kept.
    const DagSegment half = shadowSegment(grid, {3, 4, 5}, {0, 0, 1}, {3, 4, 6.75f}, 1.0f, 0);
    EXPECT_NEAR(half.from.z, 9 + 0.5 * (2.5 - std::sqrt(3.0)), 2e-3);
    // Never past the start; no offset: the very ends.
    const DagSegment near = shadowSegment(grid, {3, 4, 5}, {0, 0, 1}, {3, 4, 6}, 1.0f, 1);
    EXPECT_EQ(near.from, near.to);
    const DagSegment none = shadowSegment(grid, {3, 4, 5}, {0, 0, 1}, {3, 4, 6}, 0.0f, 1);
    EXPECT_EQ(none.from, glm::vec3(8, 8, 8));
    EXPECT_EQ(none.to, glm::vec3(8, 8, 10));
}

} // namespace
} // namespace shadowdag
