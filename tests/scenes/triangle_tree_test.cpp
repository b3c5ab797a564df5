// SPDX-License-Identifier: Apache-2.0
// The tree against all triangles one by one.
#include "scenes/triangle_tree.h"

#include "scenes/warning.h"
#include "tests/scenes/overlaps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag {
namespace {

struct Soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    Box bounds;

    // Small triangles, and every tenth a large one; `flatness` squeezes one axis.
    Soup(unsigned seed, uint32_t count, float scale, float flatness) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
        const auto vector = [&](float size) {
            return size * scale *
                   glm::vec3(uniform(random), flatness * uniform(random), uniform(random));
        };
        for (uint32_t t = 0; t < count; ++t) {
            const glm::vec3 at = vector(1.0f);
            const float size = t % 10 == 0 ? 1.0f : 0.05f;
            for (int corner = 0; corner < 3; ++corner)
                positions.push_back(at + vector(size));
            triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
        }
        triangles.emplace_back(0, 0, 0); // a degenerate one
        for (const glm::vec3& p : positions)
            bounds.add(p);
    }
    TriangleView view() const { return {viewOf(positions), viewOf(triangles)}; }
};

TEST(TriangleTree, AgreesWithAllTrianglesOneByOne) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE(seed);
        const float scale = seed % 2 ? 1.0f : 3000.0f, flatness = seed == 5 ? 0.0f : 1.0f;
        const Soup soup(seed, 500, scale, flatness);
        const TriangleTree tree(soup.view(), soup.bounds);
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> uniform(-1.5f, 1.5f);
        for (int i = 0; i < 300; ++i) {
            const glm::vec3 p =
                scale * glm::vec3(uniform(random), uniform(random), uniform(random));
            glm::vec3 direction =
                glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)));
            if (i % 10 == 0)
                direction = {0, i % 20 ? 1 : -1, 0}; // along an axis
            // A tree of one triangle is a plain test of that triangle.
            float nearest = std::numeric_limits<float>::infinity(), distance = scale;
            for (const glm::uvec3& t : soup.triangles) {
                const std::vector<glm::uvec3> one{t};
                Box box;
                for (int corner = 0; corner < 3; ++corner)
                    box.add(soup.positions[t[corner]]);
                const TriangleTree single({viewOf(soup.positions), viewOf(one)}, box);
                nearest = std::min(nearest, single.trace(p, direction).distance);
                distance = std::min(distance, single.distance(p, scale));
            }
            EXPECT_EQ(tree.trace(p, direction).distance, nearest) << "ray " << i;
            EXPECT_EQ(tree.distance(p, scale), distance) << "point " << i;
        }
    }
}

TEST(TriangleTree, ReachLeavesOutWhatIsFarther) {
    const Soup soup(7, 500, 1.0f, 1.0f);
    const TriangleTree tree(soup.view(), soup.bounds);
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(-1.5f, 1.5f);
    int hitCount = 0;
    for (int i = 0; i < 300; ++i) {
        const glm::vec3 p(uniform(random), uniform(random), uniform(random));
        const glm::vec3 direction =
            glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)));
        const TriangleTree::Hit first = tree.trace(p, direction);
        if (!std::isfinite(first.distance)) {
            EXPECT_FALSE(tree.isBlocked(p, direction, 1e9f));
            continue;
        }
        ++hitCount;
        const float beyond = std::nextafter(first.distance, 1e9f);
        EXPECT_TRUE(tree.isBlocked(p, direction, beyond));
        EXPECT_FALSE(tree.isBlocked(p, direction, first.distance));
        EXPECT_EQ(tree.trace(p, direction, beyond).distance, first.distance);
        EXPECT_EQ(tree.trace(p, direction, beyond).triangle, first.triangle);
        EXPECT_TRUE(std::isinf(tree.trace(p, direction, first.distance).distance));
    }
    EXPECT_GT(hitCount, 100);
}

TEST(TriangleTree, CoincidentTrianglesAreKeptOnce) {
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
    std::vector<glm::uvec3> triangles(100'000, glm::uvec3(0, 1, 2));
    triangles[7] = {0, 2, 1}; // turned over: seen from the other side
    triangles[70] = {0, 1, 3};
    const TriangleTree tree({viewOf(positions), viewOf(triangles)}, Box{{0, 0, 0}, {4, 4, 4}});
    EXPECT_EQ(tree.distinctCount(), 3u);
    const TriangleTree::Hit hit = tree.trace({1, 1, 3}, {0, 0, -1});
    EXPECT_EQ(hit.distance, 3.0f);
    EXPECT_TRUE(hit.isFrontFace);
    EXPECT_EQ(hit.triangle, 0u); // the first of those that are hit there
}

// Each spans the whole diagonal of the bounds: cells of a grid would each list a share of them.
TEST(TriangleTree, LargeTrianglesCostNoMoreThanSmallOnes) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    Box bounds;
    for (uint32_t t = 0; t < 50'000; ++t) {
        const auto near = [&](float at) {
            return glm::vec3(at + uniform(random), at + uniform(random), at + uniform(random));
        };
        positions.insert(positions.end(), {near(0), near(50), near(100)});
        triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    for (const glm::vec3& p : positions)
        bounds.add(p);
    const TriangleTree tree({viewOf(positions), viewOf(triangles)}, bounds);
    EXPECT_EQ(tree.distinctCount(), triangles.size());
    EXPECT_LT(tree.trace({50, 50, 49}, {0, 0, 1}).distance, 10.0f);
}

// A step more than the limit is a node, and a leaf's triangles.
constexpr uint64_t kStepsBeyond = 8;

TEST(TriangleTree, QueriesEndAfterTheirStepsWhateverOverlaps) {
    for (const test::Overlap kind : {test::Overlap::kPile, test::Overlap::kSlivers}) {
        SCOPED_TRACE(int(kind));
        Mesh mesh;
        addOverlap(mesh, kind, 20'000);
        Box bounds;
        for (const glm::vec3& p : mesh.positions)
            bounds.add(p);
        const TriangleTree tree({viewOf(mesh.positions), viewOf(mesh.triangles)}, bounds);
        EXPECT_GT(tree.distinctCount(), 4'000u); // of the pile, floats tell apart one in four
        std::mt19937 random(1);
        std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
        QueryCost before;
        for (int i = 0; i < 20'000 && before.cutCount < TriangleTree::kMaxLongCuts + 200; ++i) {
            const glm::vec3 p(8 * uniform(random), 3 * uniform(random), 5 * uniform(random));
            const glm::vec3 d =
                glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)) - 0.5f);
            bool isBlocked = false;
            if (i % 3 == 0)
                tree.trace(p, d);
            else if (i % 3 == 1)
                isBlocked = tree.isBlocked(p, d, 4.0f);
            else
                tree.distance(p, 0.5f);
            const QueryCost after = tree.cost();
            if (i % 3 == 1 && after.cutCount > before.cutCount) {
                EXPECT_TRUE(isBlocked) << "query " << i;
            }
            const uint64_t most = before.cutCount < TriangleTree::kMaxLongCuts
                                      ? TriangleTree::kMaxQuerySteps
                                      : TriangleTree::kFewQuerySteps;
            ASSERT_EQ(after.queryCount, before.queryCount + 1);
            ASSERT_LE(after.stepCount, before.stepCount + most + kStepsBeyond) << "query " << i;
            before = after;
        }
        EXPECT_GT(before.cutCount, TriangleTree::kMaxLongCuts); // both limits were met
    }
}

// All of the pile is within 2 mm: any of it is a good answer.
TEST(TriangleTree, ACutQueryFindsAPile) {
    Mesh mesh;
    addOverlap(mesh, test::Overlap::kPile, 20'000);
    const std::vector<glm::uvec3> one{mesh.triangles[0]};
    const Box bounds{{0, 0, 0}, {8, 3, 5}};
    const TriangleTree tree({viewOf(mesh.positions), viewOf(mesh.triangles)}, bounds),
        single({viewOf(mesh.positions), viewOf(one)}, bounds);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    int hitCount = 0;
    for (int i = 0; i < 6'000; ++i) {
        const glm::vec3 p(1 + 6 * uniform(random), 3, 1 + 3 * uniform(random));
        const float expected = single.trace(p, {0, -1, 0}).distance;
        if (!std::isfinite(expected))
            continue;
        ++hitCount;
        EXPECT_NEAR(tree.trace(p, {0, -1, 0}).distance, expected, 2.1e-3f) << i;
        EXPECT_TRUE(tree.isBlocked(p, {0, -1, 0}, expected + 0.01f)) << i;
    }
    EXPECT_GT(hitCount, 1'000);
    EXPECT_GT(tree.cost().cutCount, 1'000u);
}

TEST(TriangleTree, CutQueriesAreReported) {
    static std::vector<std::string> heard;
    heard.clear();
    setWarningListener([](const std::string& text) { heard.push_back(text); });
    warnOfCutQueries({1000, 50'000, 0}, "lights");
    EXPECT_TRUE(heard.empty());
    warnOfCutQueries({1000, 50'000, 7}, "lights");
    setWarningListener(nullptr);
    ASSERT_EQ(heard.size(), 1u);
    EXPECT_NE(heard[0].find("7 of 1000 rays that place lights were cut short"), std::string::npos)
        << heard[0];
}

// Exact scaling by a power of two, up to the largest coordinate, shows that nothing overflows.
TEST(TriangleTree, AnswersAreTheSameAtTheLargestCoordinates) {
    constexpr float kScale = 0x1p29f; // of coordinates below 1.86
    for (unsigned seed = 1; seed <= 4; ++seed) {
        const Soup small(seed, 500, 0.9f, 1.0f);
        Soup large = small;
        large.bounds = {small.bounds.min * kScale, small.bounds.max * kScale};
        for (glm::vec3& p : large.positions) {
            p *= kScale;
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_LE(std::fabs(p[axis]), kMaxCoordinate);
        }
        const TriangleTree a(small.view(), small.bounds), b(large.view(), large.bounds);
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
        for (int i = 0; i < 300; ++i) {
            const glm::vec3 p(uniform(random), uniform(random), uniform(random));
            const glm::vec3 direction =
                glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)));
            EXPECT_EQ(a.trace(p, direction).distance * kScale,
                      b.trace(p * kScale, direction).distance);
            EXPECT_EQ(a.distance(p, 4.0f) * kScale, b.distance(p * kScale, 4.0f * kScale));
        }
    }
}

TEST(TriangleTree, HandComputedHitsAndDistances) {
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    const std::vector<glm::uvec3> triangles = {{0, 1, 2}};
    const TriangleTree tree({viewOf(positions), viewOf(triangles)}, Box{{0, 0, 0}, {4, 4, 0}});
    const TriangleTree::Hit front = tree.trace({1, 1, 3}, {0, 0, -1});
    EXPECT_EQ(front.distance, 3.0f);
    EXPECT_TRUE(front.isFrontFace);
    const TriangleTree::Hit back = tree.trace({1, 1, -2}, {0, 0, 1});
    EXPECT_EQ(back.distance, 2.0f);
    EXPECT_FALSE(back.isFrontFace);
    EXPECT_TRUE(std::isinf(tree.trace({3, 3, 3}, {0, 0, -1}).distance)); // beyond the long edge
    EXPECT_TRUE(std::isinf(tree.trace({1, 1, 3}, {0, 0, 1}).distance));
    EXPECT_EQ(tree.distance({1, 1, 2}, 9.0f), 2.0f);                  // face
    EXPECT_EQ(tree.distance({2, -3, 0}, 9.0f), 3.0f);                 // edge
    EXPECT_EQ(tree.distance({-3, -4, 0}, 9.0f), 5.0f);                // corner
    EXPECT_EQ(tree.distance({-3, -4, 0}, 4.0f), 4.0f);                // none within the limit
    EXPECT_FLOAT_EQ(tree.distance({4, 4, 0}, 9.0f), std::sqrt(8.0f)); // the long edge
}

} // namespace
} // namespace shadowdag
