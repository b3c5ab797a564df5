// SPDX-License-Identifier: Apache-2.0
#include "scenes/polygon_lod.h"

#include "cuda/backend.h"
#include "scenes/triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

namespace shadowdag {
namespace {

/// A sphere of radius 1 of 2 n n triangles, poles included.
Mesh sphere(uint32_t n) {
    Mesh mesh;
    constexpr double kPi = 3.14159265358979323846;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const double a = 2 * kPi * i / n, b = kPi * j / n;
            if ((j == 0 || j == n) && i > 0)
                continue;
            mesh.positions.push_back({float(std::sin(b) * std::cos(a)), float(std::cos(b)),
                                      float(std::sin(b) * std::sin(a))});
        }
    const auto at = [n](uint32_t i, uint32_t j) {
        return j == 0 ? 0 : j == n ? 1 + (n - 1) * n : 1 + (j - 1) * n + i % n;
    };
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            if (j > 0)
                mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            if (j + 1 < n)
                mesh.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
        }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    return mesh;
}

TriangleView trianglesOf(const Mesh& mesh) {
    return {viewOf(mesh.positions), viewOf(mesh.triangles), {}};
}

/// Spheres at these places and scales; the last moves up by 3 within a second.
Scene spheres(const std::vector<glm::vec4>& placed) {
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes.push_back(sphere(48));
    for (const glm::vec4& p : placed) {
        Node node;
        node.mesh = 0;
        node.local.translation = glm::vec3(p);
        node.local.scale = glm::vec3(p.w);
        scene.roots.push_back(int(scene.nodes.size()));
        scene.nodes.push_back(node);
    }
    scene.animations.resize(1);
    scene.animations[0].channels.resize(1);
    AnimationChannel& channel = scene.animations[0].channels[0];
    channel.node = int(placed.size()) - 1;
    channel.times = {0, 1};
    const glm::vec4 from(glm::vec3(placed.back()), 0);
    channel.values = {from, from + glm::vec4(0, 3, 0, 0)};
    return scene;
}

TEST(Simplify, LevelsHalveTriangleCountsAndErrorsAscend) {
    const Mesh mesh = sphere(48);
    const std::vector<PolygonLevel> levels = simplify(trianglesOf(mesh), false);
    ASSERT_GE(levels.size(), 4u);
    ASSERT_LT(levels.size(), kMaxPolygonLevels);
    size_t finer = mesh.triangles.size();
    float error = 0.0f;
    for (const PolygonLevel& level : levels) {
        EXPECT_LE(6 * level.triangles.size(), 5 * finer);
        EXPECT_GE(level.error, error);
        finer = level.triangles.size();
        error = level.error;
        for (const glm::uvec3& t : level.triangles)
            for (int corner = 0; corner < 3; ++corner)
                ASSERT_LT(t[corner], mesh.positions.size());
    }
}

TEST(Simplify, ErrorOfASphereIsHowDeepItsTrianglesCutIntoIt) {
    const Mesh mesh = sphere(48);
    // The full sphere lies within this of the true one.
    const double full = 1.0 - std::cos(3.14159265358979 / 48);
    const Box bounds{glm::vec3(-1), glm::vec3(1)};
    for (const PolygonLevel& level : simplify(trianglesOf(mesh), false)) {
        const TriangleView coarse{viewOf(mesh.positions), viewOf(level.triangles)};
        const double depth = 1.0 - double(TriangleTree(coarse, bounds).distance({0, 0, 0}, 1.0f));
        EXPECT_LE(depth - full, 1.25 * double(level.error));
        EXPECT_GE(1.5 * depth + full, double(level.error));
    }
}

TEST(Simplify, SeededPointsAreNoFartherThanAQuarterBeyondTheError) {
    // A bumpy sheet with a border, and the sphere.
    std::mt19937 rng(5);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    Mesh sheet;
    for (uint32_t j = 0; j <= 40; ++j)
        for (uint32_t i = 0; i <= 40; ++i)
            sheet.positions.push_back({float(i), 2.0f * unit(rng), float(j)});
    for (uint32_t j = 0; j < 40; ++j)
        for (uint32_t i = 0; i < 40; ++i) {
            const uint32_t p = j * 41 + i;
            sheet.triangles.push_back({p, p + 1, p + 42});
            sheet.triangles.push_back({p, p + 42, p + 41});
        }
    for (const Mesh& mesh : {sheet, sphere(48)}) {
        const TriangleView full{viewOf(mesh.positions), viewOf(mesh.triangles)};
        Box bounds;
        for (const glm::vec3& p : mesh.positions)
            bounds.add(p);
        const TriangleTree fullGrid(full, bounds);
        for (const PolygonLevel& level : simplify(trianglesOf(mesh), false)) {
            const TriangleView coarse{full.positions, viewOf(level.triangles)};
            const TriangleTree coarseGrid(coarse, bounds);
            float most = 0.0f;
            for (int i = 0; i < 4000; ++i) {
                const bool toCoarse = i % 2 == 0;
                const TriangleView& from = toCoarse ? full : coarse;
                const size_t t = rng() % from.count();
                float u = unit(rng), v = unit(rng);
                if (u + v > 1.0f) {
                    u = 1.0f - u;
                    v = 1.0f - v;
                }
                const glm::vec3 a = from.vertex(t, 0);
                const glm::vec3 p = a + u * (from.vertex(t, 1) - a) + v * (from.vertex(t, 2) - a);
                most = std::max(most,
                                (toCoarse ? coarseGrid : fullGrid).distance(p, 2.0f * level.error));
            }
            EXPECT_LE(most, 1.25f * level.error) << "seed 5, triangles " << level.triangles.size();
        }
    }
}

TEST(Simplify, FlatSheetsLoseTrianglesAtNoErrorAndSingleTrianglesStay) {
    Mesh sheet;
    for (uint32_t j = 0; j <= 16; ++j)
        for (uint32_t i = 0; i <= 16; ++i)
            sheet.positions.push_back({float(i), 0.0f, float(j)});
    for (uint32_t j = 0; j < 16; ++j)
        for (uint32_t i = 0; i < 16; ++i) {
            const uint32_t p = j * 17 + i;
            sheet.triangles.push_back({p, p + 1, p + 18});
            sheet.triangles.push_back({p, p + 18, p + 17});
        }
    const std::vector<PolygonLevel> levels = simplify(trianglesOf(sheet), false);
    ASSERT_GE(levels.size(), 3u);
    EXPECT_LT(levels[2].error, 1e-3f);
    EXPECT_LE(levels[2].triangles.size(), 512u / 8);
    Mesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.triangles = {{0, 1, 2}};
    EXPECT_TRUE(simplify(trianglesOf(one), false).empty());
    EXPECT_TRUE(simplify(trianglesOf(Mesh()), false).empty());
    EXPECT_TRUE(simplifyMesh(Mesh()).empty());
    one.positions.assign(3, glm::vec3(1.0f));
    one.triangles.assign(5, {0, 1, 2});
    EXPECT_TRUE(simplify(trianglesOf(one), false).empty());
}

TEST(PolygonLevels, TheCoarsestLevelWithinSoManyTexelsAtTheNearestPointIsChosen) {
    const std::vector<Box> boxes{{glm::vec3(10, -1, -1), glm::vec3(12, 1, 1)}};
    constexpr float kInf = std::numeric_limits<float>::infinity();
    const std::vector<float> errors{0.0f, 0.1f, 0.2f, 0.4f, kInf, kInf, kInf, kInf};
    const auto at = [&](const glm::vec3& light, uint32_t faceTexels, float allowed) {
        return PolygonLevelsView{viewOf(boxes), viewOf(errors), allowed}.levelFor(0, light,
                                                                                  faceTexels);
    };
    // A texel of 200 at depth 10 is 2 * 10 / 200 = 0.1 wide.
    EXPECT_EQ(at({0, 0, 0}, 200, 1.0f), 0u); // the error must stay below it
    EXPECT_EQ(at({0, 0, 0}, 199, 1.0f), 1u);
    EXPECT_EQ(at({0, 0, 0}, 99, 1.0f), 2u);
    EXPECT_EQ(at({0, 0, 0}, 49, 1.0f), 3u);
    EXPECT_EQ(at({0, 0, 0}, 1, 1.0f), 3u);
    EXPECT_EQ(at({0, 0, 0}, 199, 0.5f), 0u);
    EXPECT_EQ(at({0, 0, 0}, 199, 0.0f), 0u);
    // Depth is the largest component: moved across, the light is no farther.
    EXPECT_EQ(at({0, 9, 0}, 199, 1.0f), 1u);
    EXPECT_EQ(at({0, 0, 21}, 199, 1.0f), 2u); // depth 20
    EXPECT_EQ(at({11, 0, 0}, 1, 1.0f), 0u);   // inside
}

/// Returns the edges of triangles that only one of them has, as pairs of vertices, smaller first.
std::set<std::pair<uint32_t, uint32_t>> borderOf(const std::vector<glm::uvec3>& triangles) {
    std::map<std::pair<uint32_t, uint32_t>, int> count;
    for (const glm::uvec3& t : triangles)
        for (int i = 0; i < 3; ++i)
            ++count[std::minmax(t[i], t[(i + 1) % 3])];
    std::set<std::pair<uint32_t, uint32_t>> border;
    for (const auto& [edge, n] : count)
        if (n == 1)
            border.insert(edge);
    return border;
}

TEST(SimplifyMesh, PartsHoldEveryTriangleOnceAndKeepTheEdgesInWhichTheyMeet) {
    const Mesh mesh = sphere(48);
    const std::vector<MeshPart> parts = simplifyMesh(mesh);
    ASSERT_GE(parts.size(), 9u);
    std::vector<int> seen(mesh.triangles.size(), 0);
    size_t levelCount = 0;
    for (const MeshPart& part : parts) {
        std::vector<glm::uvec3> full;
        for (const uint32_t t : part.triangles) {
            ++seen[t];
            full.push_back(mesh.triangles[t]);
        }
        EXPECT_LE(full.size(), kMaxBatchTriangleCount);
        const auto border = borderOf(full);
        EXPECT_FALSE(border.empty());
        for (const PolygonLevel& level : part.levels) {
            EXPECT_EQ(borderOf(level.triangles), border);
            ++levelCount;
        }
    }
    for (const int count : seen)
        EXPECT_EQ(count, 1);
    EXPECT_GE(levelCount, 2 * parts.size());
}

TEST(PolygonLod, EveryLevelOfEveryPartIsBatchedOnceOverTheWorldsVertices) {
    const Scene scene = spheres({{0, 0, 0, 1}, {5, 0, 0, 2}, {-9, 0, 0, 0.5f}});
    const World world(scene, {});
    const PolygonLod lod(world);
    const TriangleView triangles = lod.triangles();
    EXPECT_EQ(triangles.positions.data, world.triangles().positions.data);
    ASSERT_GT(triangles.count(), world.triangles().count());
    const size_t fullBytes = world.triangles().count() * sizeof(glm::uvec3);
    EXPECT_EQ(std::memcmp(triangles.triangles.data, world.triangles().triangles.data, fullBytes),
              0);
    EXPECT_LT(triangles.count(), 2 * world.triangles().count());

    const BatchView batches = lod.batches(1.0f);
    const uint32_t partCount = uint32_t(lod.partCount());
    ASSERT_EQ(partCount % 3, 0u);
    std::vector<int> seen(triangles.count(), 0);
    std::map<uint32_t, uint32_t> groupTriangles;
    for (const Batch& batch : batches.batches) {
        groupTriangles[batch.instance] += batch.count;
        const Instance& instance = world.instances()[lod.instanceOf(batch.instance % partCount)];
        for (uint32_t i = 0; i < batch.count; ++i) {
            const uint32_t t = batches.triangles[batch.first + i];
            ++seen[t];
            for (int corner = 0; corner < 3; ++corner) {
                ASSERT_GE(triangles.triangles[t][corner], instance.firstVertex);
                ASSERT_LT(triangles.triangles[t][corner],
                          instance.firstVertex + instance.vertexCount);
            }
        }
    }
    for (const int count : seen)
        ASSERT_EQ(count, 1);
    uint32_t fullCount = 0;
    for (uint32_t part = 0; part < partCount; ++part)
        for (uint32_t level = 0; level < kMaxPolygonLevels; ++level) {
            EXPECT_EQ(lod.triangleCount(part, level), groupTriangles[level * partCount + part]);
            const float error = batches.levels.errorsWorld[part * kMaxPolygonLevels + level];
            EXPECT_EQ(std::isinf(error), lod.triangleCount(part, level) == 0);
            if (level == 0)
                fullCount += lod.triangleCount(part, 0);
        }
    EXPECT_EQ(fullCount, 3 * 2u * 48 * 47);
    // Errors are as large as the instance is.
    EXPECT_NEAR(batches.levels.errorsWorld[partCount / 3 * kMaxPolygonLevels + 1],
                2.0f * batches.levels.errorsWorld[1], 1e-6f);
}

TEST(PolygonLod, MovedInstancesMoveAllTheirLevelsAndNothingElse) {
    const Scene scene = spheres({{0, 0, 0, 1}, {5, 0, 0, 2}});
    World world(scene, {});
    PolygonLod lod(world, {32});
    lod.update(world.setTime(0.5f));
    std::set<uint32_t> levels;
    const BatchView batches = lod.batches(1.0f);
    for (const uint32_t b : lod.batchSet().movedBatches()) {
        const uint32_t group = batches.batches[b].instance;
        EXPECT_EQ(lod.instanceOf(group % uint32_t(lod.partCount())), 1u);
        levels.insert(batches.levels.levelOf(group));
    }
    EXPECT_GE(levels.size(), 3u);
    Box boxes[2];
    for (uint32_t part = 0; part < lod.partCount(); ++part)
        boxes[lod.instanceOf(part)].add(batches.levels.partBoxes[part]);
    EXPECT_NEAR(boxes[0].min.y, -1.0f, 1e-5f);
    EXPECT_NEAR(boxes[1].min.y, -0.5f, 1e-5f);
    EXPECT_NEAR(boxes[1].max.y, 3.5f, 1e-5f);
}

TEST(PolygonLod, ErrorsGrowWithTheGreatestScaleOfAShearedInstance) {
    Scene scene = spheres({{0, 0, 0, 1}, {5, 0, 0, 1}});
    // Columns (1, 0, 0), (3, 1, 0), (0, 0, 1): singular values (sqrt(13) +- 3) / 2 and 1.
    scene.nodes[0].local.hasMatrix = true;
    scene.nodes[0].local.matrix = glm::mat4(1);
    scene.nodes[0].local.matrix[1] = {3, 1, 0, 0};
    const World world(scene, {});
    const PolygonLod lod(world);
    const View<const float> errors = lod.batches(1.0f).levels.errorsWorld;
    const double expected = (std::sqrt(13.0) + 3.0) / 2.0;
    EXPECT_NEAR(errors[1] / errors[lod.partCount() / 2 * kMaxPolygonLevels + 1], expected, 1e-5);
}

TEST(PolygonLod, SameForOneAndTwoThreads) {
    const Scene scene = spheres({{0, 0, 0, 1}, {5, 0, 0, 2}});
    const World world(scene, {});
    setThreadCount(1);
    const PolygonLod one(world);
    setThreadCount(2);
    const PolygonLod two(world);
    setThreadCount(0);
    const View<const uint32_t> a = one.batches(1.0f).triangles, b = two.batches(1.0f).triangles;
    ASSERT_EQ(a.count, b.count);
    EXPECT_EQ(std::memcmp(a.data, b.data, a.count * sizeof(uint32_t)), 0);
}

} // namespace
} // namespace shadowdag
