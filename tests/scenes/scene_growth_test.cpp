// SPDX-License-Identifier: Apache-2.0
// Grown scenes: counts, areas, bounds and shared edges in closed form, the same bits at each call.
#include "scenes/scene_growth.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/mesh_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <tuple>

namespace shadowdag {
namespace {

/// A closed box of 3 x 2 x 1 on a node that is moved, with a light and a camera.
Scene boxScene() {
    MeshBuilder builder("box");
    addBox(builder, glm::dvec3(0.0), glm::dvec3(3.0, 2.0, 1.0));
    Scene scene;
    scene.name = "box";
    scene.materials.push_back({});
    scene.meshes.push_back(builder.take());
    scene.lights.push_back({});
    scene.cameras.push_back({});
    Node node;
    node.mesh = node.light = node.camera = 0;
    node.local.translation = glm::vec3(0.1f, 0.2f, 0.3f);
    scene.nodes.push_back(node);
    scene.roots = {0};
    return scene;
}

double areaOf(const TriangleView& triangles, size_t first = 0) {
    double area = 0;
    for (size_t t = first; t < triangles.count(); ++t) {
        const glm::dvec3 a(triangles.vertex(t, 0)), b(triangles.vertex(t, 1)),
            c(triangles.vertex(t, 2));
        area += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    return area;
}

using Point = std::tuple<float, float, float>;

Point pointOf(const glm::vec3& p) {
    return {p.x, p.y, p.z};
}

/// Returns how often each directed edge is used, by the positions of its ends.
std::map<std::pair<Point, Point>, int> edgesOf(const TriangleView& triangles) {
    std::map<std::pair<Point, Point>, int> edges;
    for (size_t t = 0; t < triangles.count(); ++t)
        for (int side = 0; side < 3; ++side)
            ++edges[{pointOf(triangles.vertex(t, side)),
                     pointOf(triangles.vertex(t, (side + 1) % 3))}];
    return edges;
}

bool isClosed(const TriangleView& triangles) {
    const auto edges = edgesOf(triangles);
    return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
        const auto opposite = edges.find({edge.first.second, edge.first.first});
        return opposite != edges.end() && opposite->second == edge.second;
    });
}

template <class T> bool areSameBits(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

struct Grown {
    Scene scene;
    World world;
    Grown(const World& base, Growth growth, uint64_t step, const LeafOptions& leaves = {})
        : scene(grownScene(base, growth, step, leaves)), world(scene, {}) {}
};

TEST(SceneGrowth, StepsGiveTheCountsThatTheyState) {
    const Scene scene = boxScene();
    const World world(scene, {});
    ASSERT_EQ(world.triangles().count(), 12u);
    for (const auto& [growth, counts] :
         {std::pair{Growth::kTessellate, std::array<uint64_t, 4>{12, 48, 192, 768}},
          std::pair{Growth::kInstance, std::array<uint64_t, 4>{12, 48, 108, 192}},
          std::pair{Growth::kLeaves, std::array<uint64_t, 4>{12, 14, 16, 18}}})
        for (uint64_t step = 0; step < counts.size(); ++step) {
            EXPECT_EQ(grownCount(growth, 12, step), counts[step]);
            EXPECT_EQ(Grown(world, growth, step).world.triangles().count(), counts[step])
                << kGrowthNames[size_t(growth)] << " " << step;
        }
    EXPECT_EQ(grownCount(Growth::kTessellate, 12, 200), UINT64_MAX);
    EXPECT_EQ(grownCount(Growth::kInstance, 12, UINT64_MAX), UINT64_MAX);
    EXPECT_EQ(grownCount(Growth::kLeaves, 12, UINT64_MAX), UINT64_MAX);
}

TEST(SceneGrowth, TheNearestStepIsByRatioAndLeavesDoNotExceedWhatIsAsked) {
    EXPECT_EQ(nearestStep(Growth::kTessellate, 100, 1), 0u);
    EXPECT_EQ(nearestStep(Growth::kTessellate, 100, 200), 0u); // as near to 100 as to 400
    EXPECT_EQ(nearestStep(Growth::kTessellate, 100, 201), 1u);
    EXPECT_EQ(nearestStep(Growth::kTessellate, 100, 6400), 3u);
    EXPECT_EQ(nearestStep(Growth::kInstance, 100, 899), 2u);
    EXPECT_EQ(nearestStep(Growth::kInstance, 100, 600), 1u); // sqrt(400 * 900)
    EXPECT_EQ(nearestStep(Growth::kInstance, 100, 601), 2u);
    EXPECT_EQ(nearestStep(Growth::kLeaves, 100, 103), 1u);
    EXPECT_EQ(nearestStep(Growth::kLeaves, 100, 99), 0u);
}

TEST(SceneGrowth, TessellationKeepsAreaBoundsAndClosedSurfaces) {
    const Scene scene = boxScene();
    const World world(scene, {});
    const Grown grown(world, Growth::kTessellate, 4);
    const TriangleView triangles = grown.world.triangles();
    EXPECT_NEAR(areaOf(triangles), 22.0, 1e-5);
    EXPECT_TRUE(grown.world.boundsWorld() == world.boundsWorld());
    EXPECT_TRUE(isClosed(triangles)) << "neighbours must have the same midpoints, bit for bit";
    // Shared vertices: V - E + F = 2 on each level, by positions.
    std::set<Point> points;
    for (const glm::vec3& p : triangles.positions)
        points.insert(pointOf(p));
    EXPECT_EQ(int(points.size()) - int(edgesOf(triangles).size() / 2) + int(triangles.count()), 2);
    // Each of the four has the normal and a quarter of the area of its parent, in its place.
    const Grown once(world, Growth::kTessellate, 1);
    // A box has 8 vertices and 12 edges, and its faces 6 diagonals.
    EXPECT_EQ(once.world.triangles().positions.count, 8 + 12 + 6u) << "an edge has one midpoint";
    for (size_t t = 0; t < 12; ++t)
        for (size_t part = 0; part < 4; ++part) {
            const auto cross = [](const TriangleView& of, size_t i) {
                const glm::dvec3 a(of.vertex(i, 0));
                return glm::cross(glm::dvec3(of.vertex(i, 1)) - a, glm::dvec3(of.vertex(i, 2)) - a);
            };
            const glm::dvec3 parent = cross(world.triangles(), t),
                             child = cross(once.world.triangles(), 4 * t + part);
            EXPECT_LT(glm::length(0.25 * parent - child), 1e-6) << t << " " << part;
        }
}

TEST(SceneGrowth, ACurvedSurfaceOfRoundedVerticesStaysClosed) {
    MeshBuilder builder("ball");
    addBall(builder, {0.3, 0.7, 1.1}, 1.7, 12, 7);
    Scene scene = boxScene();
    scene.meshes[0] = builder.take();
    const World world(scene, {});
    ASSERT_TRUE(isClosed(world.triangles()));
    const Grown grown(world, Growth::kTessellate, 3);
    EXPECT_TRUE(isClosed(grown.world.triangles()));
    EXPECT_NEAR(areaOf(grown.world.triangles()), areaOf(world.triangles()), 1e-5);
}

TEST(SceneGrowth, TheMiddleOfTheCopiesIsTheSceneAndNoneOverlaps) {
    const Scene scene = boxScene();
    const World world(scene, {});
    const Grown grown(world, Growth::kInstance, 2);
    const TriangleView triangles = grown.world.triangles();
    EXPECT_NEAR(areaOf(triangles), 9 * 22.0, 1e-4);
    const Box box = world.boundsWorld(), bounds = grown.world.boundsWorld();
    const double gap = 3.0 / 64; // of the longest side
    EXPECT_NEAR(bounds.extent().x, 9.0 + 2 * gap, 1e-5);
    EXPECT_NEAR(bounds.extent().z, 3.0 + 2 * gap, 1e-5);
    EXPECT_EQ(bounds.extent().y, box.extent().y);
    EXPECT_NEAR(glm::length(bounds.center() - box.center()), 0.0, 1e-5);
    std::vector<Box> boxes(9);
    for (size_t t = 0; t < triangles.count(); ++t)
        for (int corner = 0; corner < 3; ++corner)
            boxes[t / 12].add(triangles.vertex(t, corner));
    EXPECT_TRUE(boxes[0] == box) << "the first triangles are the scene's own";
    for (size_t i = 0; i < boxes.size(); ++i)
        for (size_t j = 0; j < i; ++j)
            EXPECT_FALSE(overlaps(boxes[i], boxes[j])) << i << " " << j;
}

TEST(SceneGrowth, LeavesHaveTheAreaOfTheirCoverAndStayWithinTheBounds) {
    const Scene scene = boxScene();
    const World world(scene, {});
    for (const bool isMasked : {false, true}) {
        const LeafOptions options{7, 0.5, isMasked};
        const Grown grown(world, Growth::kLeaves, 1000, options);
        const TriangleView triangles = grown.world.triangles();
        EXPECT_NEAR(areaOf(triangles, 12), 0.5 * 22.0, 1e-3);
        EXPECT_TRUE(grown.world.boundsWorld() == world.boundsWorld());
        size_t opaqueCount = 0;
        for (size_t t = 12; t < triangles.count(); ++t) {
            EXPECT_EQ(triangles.masks.isCut(t), isMasked);
            // A leaf's middle, the longest side's, is opaque; its corner is cut off by a mask.
            if (isMasked) {
                EXPECT_TRUE(triangles.masks.isOpaque(t, 1, t % 2 ? 1e-3 : 0, t % 2 ? 1 : 1));
                opaqueCount += triangles.masks.isOpaque(t, 1, 0, 0);
            }
        }
        EXPECT_EQ(opaqueCount, 0u);
        EXPECT_FALSE(triangles.masks.isCut(0) && isMasked);
    }
}

TEST(SceneGrowth, LeavesLieOnTheSurfaceOnAllOfIt) {
    const Scene scene = boxScene();
    const World world(scene, {});
    const Grown grown(world, Growth::kLeaves, 6000, {1, 0.1, false});
    const TriangleView triangles = grown.world.triangles();
    const double halfLength = std::sqrt(0.1 * 22.0 / (2.0 * 6000));
    const Box box = world.boundsWorld();
    std::map<int, int> countOnFace;
    for (size_t t = 12; t < triangles.count(); t += 2) {
        const glm::vec3 middle = 0.5f * (triangles.vertex(t, 0) + triangles.vertex(t, 2));
        double nearest = 1e9;
        int face = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side) {
                const double away =
                    std::abs(double(middle[axis]) - double(side ? box.max[axis] : box.min[axis]));
                if (away < nearest) {
                    nearest = away;
                    face = 2 * axis + side;
                }
            }
        EXPECT_LT(nearest, 2.0 * halfLength);
        ++countOnFace[face];
    }
    const double areas[] = {2, 2, 3, 3, 6, 6}; // of the faces
    for (int face = 0; face < 6; ++face) {
        const double expected = 6000 * areas[face] / 22.0;
        EXPECT_NEAR(countOnFace[face], expected, 6 * std::sqrt(expected)) << face;
    }
}

TEST(SceneGrowth, LeavesLieOnTheSideOfTheNormalWithinHalfALeafsLength) {
    MeshBuilder builder("floor");
    builder.quad({0, 0, 0}, {0, 0, 10}, {10, 0, 10}, {10, 0, 0}); // seen from above
    for (const double y : {-5.0, 5.0})                            // make the bounds thick
        builder.triangle(builder.vertex({5, y, 5}), builder.vertex({5, y, 5.001}),
                         builder.vertex({5.001, y, 5}));
    Scene scene = boxScene();
    scene.meshes[0] = builder.take();
    scene.nodes[0].local.translation = glm::vec3(0.0f);
    const World world(scene, {});
    const double halfLength = std::sqrt(0.1 * 100.0 / (2.0 * 2000));
    const auto middles = [&](uint64_t seed) {
        const Grown grown(world, Growth::kLeaves, 2000, {seed, 0.1, false});
        const TriangleView triangles = grown.world.triangles();
        std::vector<glm::vec3> points;
        for (size_t t = 4; t < triangles.count(); t += 2)
            points.push_back(0.5f * (triangles.vertex(t, 0) + triangles.vertex(t, 2)));
        return points;
    };
    const std::vector<glm::vec3> of = middles(1), others = middles(2);
    float low = 1e9f, high = -1e9f;
    int farCount = 0;
    for (size_t i = 0; i < of.size(); ++i) {
        low = std::min(low, of[i].y);
        high = std::max(high, of[i].y);
        farCount += glm::length(of[i] - others[i]) > 10 * halfLength;
    }
    EXPECT_GE(low, -1e-6);
    EXPECT_LT(low, 0.05 * halfLength);
    EXPECT_LE(high, 1.0001 * halfLength);
    EXPECT_GT(high, 0.95 * halfLength);
    EXPECT_GT(farCount, 1800) << "another seed has other places";
}

TEST(SceneGrowth, TheSameArgumentsGiveTheSameBitsAndAnotherSeedOthers) {
    const Scene scene = boxScene();
    const World world(scene, {});
    for (const Growth growth : {Growth::kTessellate, Growth::kInstance, Growth::kLeaves}) {
        const Scene a = grownScene(world, growth, 3), b = grownScene(world, growth, 3);
        EXPECT_TRUE(areSameBits(a.meshes[0].positions, b.meshes[0].positions));
        EXPECT_TRUE(areSameBits(a.meshes[0].triangles, b.meshes[0].triangles));
    }
    const Scene a = grownScene(world, Growth::kLeaves, 3, {1}),
                b = grownScene(world, Growth::kLeaves, 3, {2});
    EXPECT_FALSE(areSameBits(a.meshes[0].positions, b.meshes[0].positions));
}

TEST(SceneGrowth, LightsAndCamerasStayAndAFlattenedSceneHasTheSameTriangles) {
    for (const std::string name : {"atrium", "fail-alpha", "fail-wires"}) {
        const Scene scene = makeBuiltin(name);
        const World world(scene, {});
        const Scene flat = flattened(world);
        const World same(flat, {});
        ASSERT_EQ(same.triangles().count(), world.triangles().count()) << name;
        EXPECT_TRUE(areSameBits(std::vector<glm::vec3>(world.triangles().positions.begin(),
                                                       world.triangles().positions.end()),
                                std::vector<glm::vec3>(same.triangles().positions.begin(),
                                                       same.triangles().positions.end())));
        for (size_t t = 0; t < world.triangles().count(); ++t) {
            ASSERT_EQ(same.triangles().triangles[t], world.triangles().triangles[t]) << name << t;
            ASSERT_EQ(same.triangles().masks.isCut(t), world.triangles().masks.isCut(t));
            if (world.triangles().masks.isCut(t)) {
                ASSERT_EQ(same.triangles().masks.isOpaque(t, 1, 2, 3),
                          world.triangles().masks.isOpaque(t, 1, 2, 3));
            }
        }
        ASSERT_EQ(same.lights().size(), world.lights().size());
        for (size_t i = 0; i < world.lights().size(); ++i) {
            EXPECT_EQ(same.lights()[i].positionWorld, world.lights()[i].positionWorld);
            EXPECT_EQ(same.lights()[i].rangeWorld, world.lights()[i].rangeWorld);
        }
        ASSERT_EQ(same.cameras().size(), world.cameras().size());
        EXPECT_EQ(same.staticTriangles().size(), world.triangles().count());
    }
}

TEST(SceneGrowth, MoreThanIndicesReachIsRefused) {
    const Scene scene = boxScene();
    const World world(scene, {});
    for (const auto& [growth, step] : {std::pair{Growth::kInstance, uint64_t(100000)},
                                       std::pair{Growth::kLeaves, uint64_t(3000000000)}})
        try {
            grownScene(world, growth, step);
            FAIL() << "nothing was refused";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_NE(std::string(error.what()).find("2^32"), std::string::npos);
        }
}

} // namespace
} // namespace shadowdag
