// SPDX-License-Identifier: Apache-2.0
// The built-in scenes match their table in size, light and darkness, and the failure scenes'
// closed-form visibilities are Embree's.
#include "scenes/builtin.h"

#include "cuda/error.h"
#include "scenes/fail_scenes.h"
#include "scenes/mesh_shapes.h"
#include "tests/scenes/builtin_measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <set>

namespace shadowdag {
namespace {

struct Expected {
    const char* name;
    size_t triangleCount;
    size_t lightCount;
    size_t inLampCount; ///< lights with bars or walls within 16 voxels of 4096^3
};

/// Keeps ctest's names free of addresses.
void PrintTo(const Expected& expected, std::ostream* out) {
    *out << expected.name;
}

class BuiltinScene : public testing::TestWithParam<Expected> {};

/// Returns the triangles placed by nodes whose mesh names start with one of the prefixes.
size_t countTagged(const World& world, const std::vector<std::string>& prefixes) {
    size_t count = 0;
    for (const Instance& instance : world.instances())
        for (const std::string& prefix : prefixes)
            if (world.scene().meshes[instance.mesh].name.rfind(prefix, 0) == 0)
                count += instance.triangleCount;
    return count;
}

TEST_P(BuiltinScene, HasThePapersSizeInTrianglesAndLights) {
    const Scene scene = makeBuiltin(GetParam().name);
    const World world(scene, {});
    EXPECT_NEAR(double(world.triangles().count()), double(GetParam().triangleCount),
                0.1 * double(GetParam().triangleCount));
    EXPECT_EQ(world.lights().size(), GetParam().lightCount);
    EXPECT_NEAR(scene.durationSeconds(), 20.0f, 1e-3f);
    ASSERT_EQ(world.cameras().size(), 1u);
    const size_t tagged = countTagged(world, {"thin_", "curved_", "flat_"});
    EXPECT_EQ(tagged, world.triangles().count()) << "a mesh carries no tag";
    const size_t thin = countTagged(world, {"thin_", "curved_"});
    EXPECT_GE(double(thin), 0.2 * double(world.triangles().count()));
}

TEST_P(BuiltinScene, IsTheSameBitsTwice) {
    const Scene a = makeBuiltin(GetParam().name), b = makeBuiltin(GetParam().name);
    const World worldA(a, {}), worldB(b, {});
    EXPECT_EQ(worldA.geometryHash(), worldB.geometryHash());
    ASSERT_EQ(worldA.lights().size(), worldB.lights().size());
    for (size_t i = 0; i < worldA.lights().size(); ++i)
        EXPECT_EQ(worldA.lights()[i].positionWorld, worldB.lights()[i].positionWorld);
}

TEST_P(BuiltinScene, HasEightLightsASampleAndThreeTenthsDark) {
    const Scene scene = makeBuiltin(GetParam().name);
    World world(scene, {});
    FrameCounts sum;
    for (int frame = 0; frame < 5; ++frame) {
        world.setTime(float(frame) * 5.0f);
        const FrameCounts counts = countFrame(world, 160, 90);
        sum.sampleCount += counts.sampleCount;
        sum.pairCount += counts.pairCount;
        sum.darkCount += counts.darkCount;
        sum.fightCount += counts.fightCount;
    }
    const double perSample = double(sum.pairCount) / double(sum.sampleCount);
    const double dark = double(sum.darkCount) / double(sum.pairCount);
    RecordProperty("pairs_per_sample", std::to_string(perSample));
    RecordProperty("dark_share", std::to_string(dark));
    EXPECT_GE(perSample, 8.0);
    EXPECT_GE(dark, 0.3);
    EXPECT_LE(double(sum.fightCount), 1e-3 * double(sum.sampleCount)) << "coplanar surfaces";
}

TEST_P(BuiltinScene, KeepsLightsInFreeSpace) {
    const Scene scene = makeBuiltin(GetParam().name);
    const World world(scene, {});
    const EmbreeWorld embree(world);
    for (size_t i = 0; i < world.lights().size(); ++i) {
        float nearest = 1e30f;
        for (int k = 0; k < 128; ++k) { // Fibonacci directions
            const float y = 1.0f - (2.0f * float(k) + 1.0f) / 128.0f, r = std::sqrt(1.0f - y * y);
            const float phi = float(k) * 2.3999632f;
            const glm::vec3 direction(r * std::cos(phi), y, r * std::sin(phi));
            nearest = std::min(nearest,
                               embree.trace(world.lights()[i].positionWorld, direction).ray.tfar);
        }
        EXPECT_GT(nearest, 0.05f) << "light " << i; // bars of chandeliers are at 0.07
    }
}

// Bars or walls within 16 voxels of 4096^3, where a voxel displaces a shadow farthest; and a fifth
// of all directions free past them, so that the lamp lights the scene.
TEST_P(BuiltinScene, HangsItsLightsInLampsThatLetLightOut) {
    const Scene scene = makeBuiltin(GetParam().name);
    const World world(scene, {});
    const EmbreeWorld embree(world);
    const glm::vec3 extent = world.boundsWorld().extent();
    const float reach = 16.0f * std::max({extent.x, extent.y, extent.z}) / 4096.0f;
    size_t inLampCount = 0;
    for (size_t i = 0; i < world.lights().size(); ++i) {
        int nearCount = 0, freeCount = 0;
        constexpr int kDirectionCount = 1024;
        for (int k = 0; k < kDirectionCount; ++k) { // Fibonacci directions
            const float y = 1.0f - (2.0f * float(k) + 1.0f) / float(kDirectionCount),
                        r = std::sqrt(1.0f - y * y);
            const float phi = float(k) * 2.3999632f;
            const glm::vec3 direction(r * std::cos(phi), y, r * std::sin(phi));
            const float at = embree.trace(world.lights()[i].positionWorld, direction).ray.tfar;
            nearCount += at < reach;
            freeCount += at > 0.5f;
        }
        inLampCount += nearCount > 0;
        EXPECT_GT(freeCount, kDirectionCount / 5) << "light " << i;
    }
    EXPECT_GE(inLampCount, GetParam().inLampCount);
}

INSTANTIATE_TEST_SUITE_P(Three, BuiltinScene,
                         testing::Values(Expected{"atrium", 300'000, 65, 56},
                                         Expected{"houses", 1'010'000, 256, 256},
                                         Expected{"necropolis", 2'580'000, 376, 200}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(Builtin, NecropolisHasStaticAndMovingLightsOfVeryUnequalRange) {
    const Scene scene = makeBuiltin("necropolis");
    const World world(scene, {});
    size_t moving = 0;
    float smallest = 1e30f, largest = 0.0f;
    for (const Light& light : world.lights()) {
        moving += light.isMoving;
        smallest = std::min(smallest, light.rangeWorld);
        largest = std::max(largest, light.rangeWorld);
    }
    EXPECT_EQ(world.lights().size() - moving, 275u);
    EXPECT_EQ(moving, 101u);
    EXPECT_GT(largest, 30.0f * smallest);
    size_t movers = 0;
    for (const Instance& instance : world.instances())
        movers += instance.isMoving;
    EXPECT_GT(movers, 50u);
}

TEST(Builtin, HousesByDayHaveOneDirectionalLight) {
    const Scene night = makeBuiltin("houses"), day = makeBuiltin("houses-by-day");
    const World nightWorld(night, {}), dayWorld(day, {});
    EXPECT_EQ(dayWorld.geometryHash(), nightWorld.geometryHash());
    ASSERT_EQ(dayWorld.lights().size(), 1u);
    EXPECT_EQ(dayWorld.lights()[0].kind, Light::kSun);
}

TEST(Builtin, NamesAreUniqueAndUnknownOnesListTheKnown) {
    std::set<std::string> names;
    for (const BuiltinInfo& info : builtinScenes()) {
        EXPECT_TRUE(names.insert(info.name).second) << info.name;
        EXPECT_FALSE(info.description.empty());
        EXPECT_EQ(info.description.find('\n'), std::string::npos);
    }
    EXPECT_EQ(names.size(), 4 + failScenes().size());
    try {
        makeBuiltin("Fail_wires");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()), "there is no built-in scene 'Fail_wires'; did you "
                                             "mean builtin:fail-wires?");
    }
    try {
        makeBuiltin("atrum");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(error.what()).find("'atrum'"), std::string::npos);
        EXPECT_NE(
            std::string(error.what()).find("atrium, houses, houses-by-day, necropolis, fail-acne"),
            std::string::npos);
    }
}

TEST(MeshShapes, SineIsWithinATrillionth) {
    for (int i = -4000; i <= 4000; ++i) {
        const double turns = i / 997.0;
        EXPECT_NEAR(sinTurns(turns), std::sin(turns * 6.283185307179586), 1e-12);
        EXPECT_NEAR(cosTurns(turns), std::cos(turns * 6.283185307179586), 1e-12);
    }
}

/// Returns the volume that a closed, outward wound mesh encloses (divergence theorem).
double volumeOf(const Mesh& mesh) {
    double sum = 0.0;
    for (const glm::uvec3& t : mesh.triangles)
        sum +=
            glm::dot(glm::dvec3(mesh.positions[t.x]),
                     glm::cross(glm::dvec3(mesh.positions[t.y]), glm::dvec3(mesh.positions[t.z])));
    return sum / 6.0;
}

TEST(MeshShapes, ClosedShapesEncloseTheirVolumeOutwardWound) {
    MeshBuilder box("box");
    box.setTransform(placement({3, 1, 2}, 0.1, 0.07));
    addBox(box, {0, 0, 0}, {1, 2, 3});
    EXPECT_NEAR(volumeOf(box.take()), 6.0, 1e-5);
    MeshBuilder ball("ball");
    addBall(ball, {1, 2, 3}, 0.5, 96, 64);
    EXPECT_NEAR(volumeOf(ball.take()), 4.0 / 3.0 * 3.14159265 * 0.125, 2e-3);
    MeshBuilder tube("tube");
    addTube(tube, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1, 128);
    EXPECT_NEAR(volumeOf(tube.take()), 2.0 * 3.14159265 * 0.01, 1e-4);
    MeshBuilder chain("chain");
    addChain(chain, 1.0, 0.02, 24, 24);
    EXPECT_GT(volumeOf(chain.take()), 0.0);
}

class FailSceneTest : public testing::TestWithParam<std::string> {};

FailScene failScene(const std::string& name) {
    for (FailScene& scene : failScenes())
        if (scene.name == name)
            return scene;
    throw Error(ErrorKind::kUsage, name);
}

TEST_P(FailSceneTest, ClosedFormAgreesWithEmbree) {
    const FailScene description = failScene(GetParam());
    const Scene scene = makeBuiltin(GetParam());
    World world(scene, {});
    // Small, but for balls fine enough to have levels of detail.
    const bool hasBalls = !description.balls.empty();
    EXPECT_LE(world.triangles().count(), hasBalls ? 40000u : 2000u);
    ASSERT_EQ(world.lights().size(), description.lights.size());
    ASSERT_EQ(world.cameras().size(), 1u);
    double extent = 0.0;
    for (const FailBox& b : description.boxes)
        extent = std::max({extent, 2.0 * b.half.x, 2.0 * b.half.y, 2.0 * b.half.z});
    const glm::dvec3 origin(description.boxes[0].center.x, 0.0,
                            description.boxes[0].center.z); // the floor's
    HashRandom random(7);
    size_t answered = 0, lit = 0, dark = 0, wrong = 0;
    for (const float time : {0.0f, 2.0f}) {
        world.setTime(time);
        const EmbreeWorld embree(world, origin);
        const TriangleView triangles = world.triangles();
        for (int k = 0; k < 20000; ++k) {
            // Half of the points on any triangle, half on the floor, where the shadows are.
            const uint32_t t = k & 1 ? random.below(uint32_t(triangles.count())) : random.below(12);
            const double u = random.unit(), v = random.unit() * (1.0 - u);
            const glm::dvec3 a(triangles.vertex(t, 0)), b(triangles.vertex(t, 1)),
                c(triangles.vertex(t, 2));
            const glm::dvec3 normal = glm::cross(b - a, c - a);
            if (glm::dot(normal, normal) == 0.0)
                continue;
            const glm::dvec3 point = a + (b - a) * u + (c - a) * v;
            const uint32_t light = random.below(uint32_t(description.lights.size()));
            const glm::dvec3 to = lightPointOf(description, point, int(light), time);
            // Outward normals of boxes; a flat box is lit from both sides.
            const glm::dvec3 n = glm::normalize(normal);
            if (glm::dot(n, to - point) <= 1e-3 * glm::length(to - point))
                continue;
            const std::optional<bool> expected = expectedLit(description, point, int(light), time);
            if (!expected)
                continue;
            const glm::dvec3 along = glm::normalize(to - point) * (1e-4 * extent);
            const bool blocked =
                embree.blocked(glm::vec3(point + along - origin), glm::vec3(to - along - origin));
            ++answered;
            ++(*expected ? lit : dark);
            wrong += blocked == *expected;
            if (blocked == *expected && wrong < 4)
                ADD_FAILURE() << "light " << light << " from " << point.x << " " << point.y << " "
                              << point.z;
        }
    }
    EXPECT_GT(answered, hasBalls ? 3000u : 5000u); // near a ball nothing is answered
    EXPECT_GT(lit, 0u);
    EXPECT_EQ(wrong, 0u) << "of " << answered << ", " << dark << " dark";
}

std::vector<std::string> failNames() {
    std::vector<std::string> names;
    for (const FailScene& scene : failScenes())
        names.push_back(scene.name);
    return names;
}

INSTANTIATE_TEST_SUITE_P(All, FailSceneTest, testing::ValuesIn(failNames()), [](const auto& info) {
    std::string name = info.param.substr(5);
    for (char& c : name)
        if (c == '-')
            c = '_';
    return name;
});

} // namespace
} // namespace shadowdag
