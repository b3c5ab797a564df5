// SPDX-License-Identifier: Apache-2.0
// The truth against closed forms: umbras, convex bodies, rooms, sheets, ends that touch.
#include "hybrid/judge/truth.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/rays/float_mode.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>
#include <stdexcept>

namespace shadowdag {
namespace {

using test::pointLight;
using test::SampleRow;
using test::TriangleSoup;

constexpr uint64_t kSeed = 20260101;

class Random {
public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    double between(double low, double high) {
        return low + (high - low) * double(engine_() >> 11) * 0x1p-53;
    }
    glm::vec3 inBox(const glm::vec3& lo, const glm::vec3& hi) {
        const double x = between(lo.x, hi.x), y = between(lo.y, hi.y), z = between(lo.z, hi.z);
        return glm::vec3(x, y, z);
    }
    uint32_t below(uint32_t count) { return uint32_t(engine_() % count); }

private:
    std::mt19937_64 engine_;
};

/// A floor of two triangles at y = 0 and a square blocker of half side 1 at y = 1, all moved by
/// `by`.
struct UmbraScene {
    TriangleSoup soup;
    glm::vec3 by;
    static constexpr float kFloorHalf = 8.0f;

    explicit UmbraScene(const glm::vec3& move = glm::vec3(0.0f)) : by(move) {
        soup.addLevelSquare(glm::vec3(0.0f), kFloorHalf);
        soup.addLevelSquare(glm::vec3(0, 1, 0), 1.0f);
        soup.move(by);
    }
    /// Returns how far (metres, Chebyshev) the segment to the light passes the blocker's outline;
    /// negative inside.
    double outside(const glm::vec3& sample, const glm::vec3& light) const {
        const glm::dvec3 p = glm::dvec3(sample) - glm::dvec3(by),
                         l = glm::dvec3(light) - glm::dvec3(by);
        const glm::dvec3 q = p + (l - p) * ((1.0 - p.y) / (l.y - p.y));
        return std::max(std::fabs(q.x), std::fabs(q.z)) - 1.0;
    }
    uint32_t floorTriangle(const glm::vec3& sample) const {
        return sample.z - by.z >= sample.x - by.x ? 0u : 1u;
    }
};

void expectUmbra(const glm::vec3& by, double tolerance, double sampleNoise) {
    const UmbraScene scene(by);
    const Truth truth(scene.soup.view());
    Random random(kSeed);
    std::vector<Light> lights;
    for (int i = 0; i < 8; ++i)
        lights.push_back(pointLight(random.inBox({-4, 2, -4}, {4, 5, 4}) + by));
    SampleRow row;
    for (int i = 0; i < 20000; ++i) {
        glm::vec3 p = random.inBox({-7.9f, 0, -7.9f}, {7.9f, 0, 7.9f}) + by;
        const uint32_t triangle = scene.floorTriangle(p);
        p.y += float(random.between(-sampleNoise, sampleNoise));
        row.add(p, {0, 1, 0}, triangle);
    }
    const PairList pairs = row.pairs(lights);
    const std::vector<uint8_t> visibility = truth.visibility(row.view(), lights, pairs);
    size_t darkCount = 0, wrongCount = 0, judgedCount = 0;
    for (size_t s = 0; s < row.position.size(); ++s)
        for (uint64_t k = pairs.sampleStart[s]; k < pairs.sampleStart[s + 1]; ++k) {
            const double outside =
                scene.outside(row.position[s], lights[pairs.light[k]].positionWorld);
            darkCount += visibility[k] == 0;
            if (std::fabs(outside) <= tolerance)
                continue;
            ++judgedCount;
            wrongCount += visibility[k] != (outside > 0 ? kLit : 0);
        }
    EXPECT_EQ(wrongCount, 0u);
    EXPECT_GT(judgedCount, 150000u);
    EXPECT_GT(darkCount, 3000u);
}

TEST(Truth, UmbraOfASquareIsTheClosedForm) {
    expectUmbra(glm::vec3(0.0f), 3e-5, 0.0);
}

TEST(Truth, UmbraIsCorrectAHundredThousandUnitsFromTheOrigin) {
    // Positions are multiples of 1/128 there: samples and lights are exact, c is 0.024.
    expectUmbra(glm::vec3(1e5f, -1e5f, 1e5f), 0.03, 0.0);
}

TEST(Truth, SamplesBelowOrAboveTheirPlaneByRoundingHaveTheSameResult) {
    expectUmbra(glm::vec3(0.0f), 1e-4, 2e-5);
}

TEST(Truth, CoplanarDuplicatesDoNotBlock) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    // The same floor once more, tessellated otherwise and turned by an angle whose vertices round.
    const float c = std::cos(0.3f), s = std::sin(0.3f);
    for (int i = -10; i < 10; ++i)
        for (int k = -10; k < 10; ++k) {
            const auto corner = [&](int x, int z) {
                return glm::vec3(c * float(x) - s * float(z), 3e-7f * float((x * 7 + z * 3) % 5),
                                 s * float(x) + c * float(z));
            };
            soup.addQuad(corner(i, k), corner(i, k + 1), corner(i + 1, k + 1), corner(i + 1, k));
        }
    const Truth truth(soup.view());
    Random random(kSeed);
    SampleRow row;
    std::vector<Light> lights{pointLight({1, 3, 2}), pointLight({-30, 0.5f, 2}),
                              pointLight({0.3f, 0.01f, 0.1f})};
    for (int i = 0; i < 50000; ++i) {
        const glm::vec3 p = random.inBox({-7.9f, 0, -7.9f}, {7.9f, 0, 7.9f});
        row.add(p, {0, 1, 0}, p.z >= p.x ? 0 : 1);
    }
    const PairList pairs = row.pairs(lights);
    size_t darkCount = 0;
    for (uint8_t v : truth.visibility(row.view(), lights, pairs))
        darkCount += v == 0;
    EXPECT_EQ(darkCount, 0u);
    EXPECT_GT(pairs.count(), 140000u);
}

TEST(Truth, LightsThatTouchGeometryLightIt) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 8.0f);
    soup.addLevelSquare({0, 3, 0}, 8.0f); // a ceiling, in whose plane the first two lights lie
    soup.addBox({1, 1, 1}, {2, 2, 2});    // on whose face and corner the others lie
    const Truth truth(soup.view());
    const std::vector<Light> lights{pointLight({0.3f, 3, 0.1f}), pointLight({-8, 3, 8}),
                                    pointLight({1.5f, 1.5f, 1}), pointLight({1, 1, 1})};
    Random random(kSeed);
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 p = random.inBox({-7.9f, 0, -7.9f}, {0.9f, 0, 0.9f});
        for (const Light& light : lights) {
            const TruthRay ray =
                truth.pairRay(p, {0, 1, 0}, p.z >= p.x ? 0 : 1, light.positionWorld);
            uint8_t blocked = 1;
            truth.traceBlocked(&ray, 1, &blocked);
            // Lights on the box are seen from where the box's near faces are: x < 1 and z < 1.
            ASSERT_EQ(blocked, 0) << p.x << " " << p.z << " light " << light.positionWorld.x;
        }
    }
}

TEST(Truth, BothSidesOfATriangleBlock) {
    for (const bool flipped : {false, true}) {
        TriangleSoup soup;
        const glm::vec3 a(-1, 1, -1), b(1, 1, -1), c(0, 1, 2);
        flipped ? soup.add(a, c, b) : soup.add(a, b, c);
        const Truth truth(soup.view());
        EXPECT_TRUE(truth.isBlocked({0, 0, 0}, {0, 2, 0}));
        EXPECT_TRUE(truth.isBlocked({0, 2, 0}, {0, 0, 0}));
        EXPECT_FALSE(truth.isBlocked({0, 2, 0}, {0, 1.5f, 0}));
        EXPECT_FALSE(truth.isBlocked({3, 0, 0}, {3, 2, 0}));
    }
}

TEST(Truth, EndsThatOnlyTouchDoNotBlock) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 1, 0}, 1.0f);
    const Truth truth(soup.view());
    EXPECT_FALSE(truth.isBlocked({0.3f, 1, 0.1f}, {0.5f, 2, 0}));
    EXPECT_FALSE(truth.isBlocked({0.5f, 0, 0}, {0.3f, 1, 0.1f}));
    EXPECT_TRUE(truth.isBlocked({0.3f, 0.999f, 0.1f}, {0.5f, 2, 0}));
    EXPECT_FALSE(truth.isBlocked({-2, 1, 0.1f}, {2, 1, 0})) << "edge-on";
    EXPECT_FALSE(truth.isBlocked({0, 1, 0}, {0, 1, 0})) << "no length";
}

TEST(Truth, RoomIsLitIntoItsCornersAndEdges) {
    for (const glm::vec3 by : {glm::vec3(0.0f), glm::vec3(37.3f, -11.1f, 905.7f)}) {
        TriangleSoup soup;
        soup.addBox(glm::vec3(-1.1f, -2.3f, -3.7f) + by, glm::vec3(1.9f, 2.7f, 3.1f) + by);
        const Truth truth(soup.view());
        const Light light = pointLight(by + glm::vec3(0.21f, 0.17f, -0.4f));
        Random random(kSeed);
        SampleRow row;
        for (uint32_t t = 0; t < soup.triangles.size(); ++t) {
            const glm::vec3 v[3] = {soup.view().vertex(t, 0), soup.view().vertex(t, 1),
                                    soup.view().vertex(t, 2)};
            glm::vec3 normal = glm::normalize(glm::cross(v[1] - v[0], v[2] - v[0]));
            if (glm::dot(normal, light.positionWorld - v[0]) < 0)
                normal = -normal;
            for (int i = 0; i < 3; ++i) {
                row.add(v[i], normal, t);
                for (int k = 0; k < 2000; ++k) { // along the edge and a hair to both sides of it
                    glm::vec3 p = glm::mix(v[i], v[(i + 1) % 3], float(random.between(0, 1)));
                    for (int a = 0; a < 3; ++a)
                        for (uint32_t step = random.below(3); step > 0; --step)
                            p[a] = std::nextafter(p[a], random.below(2) ? 1e9f : -1e9f);
                    row.add(p, normal, t);
                }
            }
        }
        const std::vector<Light> lights{light};
        const PairList pairs = row.pairs(lights);
        size_t darkCount = 0;
        for (uint8_t v : truth.visibility(row.view(), lights, pairs))
            darkCount += v == 0;
        EXPECT_EQ(darkCount, 0u) << "of " << pairs.count() << " at " << by.x;
        EXPECT_GT(pairs.count(), 70000u);
    }
}

/// A sphere of quads and, at the poles, slivers; not exactly convex: its quads are flat only to
/// rounding.
TriangleSoup makeSphere(int segments, int rings, float radius, const glm::vec3& center) {
    TriangleSoup soup;
    const double pi = 3.14159265358979;
    const auto point = [&](int i, int k) {
        const double theta = pi * k / rings, phi = 2 * pi * (i % segments) / segments;
        return center + glm::vec3(radius * std::sin(theta) * std::cos(phi),
                                  radius * std::cos(theta),
                                  radius * std::sin(theta) * std::sin(phi));
    };
    for (int k = 0; k < rings; ++k)
        for (int i = 0; i < segments; ++i) {
            const glm::vec3 a = point(i, k), b = point(i + 1, k), c = point(i + 1, k + 1),
                            d = point(i, k + 1);
            if (k > 0)
                soup.add(a, b, c);
            if (k + 1 < rings)
                soup.add(a, c, d);
        }
    return soup;
}

void expectConvexBodyLit(const glm::vec3& center, float radius, int segments, int rings,
                         int count) {
    const TriangleSoup soup = makeSphere(segments, rings, radius, center);
    const Truth truth(soup.view());
    Random random(kSeed);
    std::vector<TruthRay> rays;
    for (int i = 0; i < count; ++i) {
        const uint32_t t = random.below(uint32_t(soup.triangles.size()));
        const glm::dvec3 v[3] = {soup.view().vertex(t, 0), soup.view().vertex(t, 1),
                                 soup.view().vertex(t, 2)};
        double u = random.between(0, 1), w = random.between(0, 1);
        if (u + w > 1)
            u = 1 - u, w = 1 - w;
        if (i % 4 == 0) // on an edge
            w = 0;
        if (i % 16 == 0) // on a vertex
            u = 0;
        const glm::vec3 p(v[0] + u * (v[1] - v[0]) + w * (v[2] - v[0]));
        glm::dvec3 normal = glm::normalize(glm::cross(v[1] - v[0], v[2] - v[0]));
        if (glm::dot(normal, v[0] - glm::dvec3(center)) < 0)
            normal = -normal;
        // Lights all around, one in three within rounding of the horizon.
        glm::dvec3 light = glm::dvec3(center) +
                           glm::dvec3(random.inBox(glm::vec3(-3 * radius), glm::vec3(3 * radius)));
        if (i % 3 == 0)
            light -= normal * (glm::dot(normal, light - v[0]) - random.between(0, 1e-5) * radius);
        if (glm::dot(normal, light - v[0]) <= 0 ||
            glm::dot(glm::vec3(light) - p, glm::vec3(normal)) <= 0)
            continue;
        rays.push_back(truth.pairRay(p, glm::vec3(normal), t, glm::vec3(light)));
    }
    std::vector<uint8_t> blocked(rays.size());
    truth.traceBlocked(rays.data(), rays.size(), blocked.data());
    size_t darkCount = 0;
    for (uint8_t b : blocked)
        darkCount += b;
    EXPECT_EQ(darkCount, 0u) << "of " << rays.size();
    EXPECT_GT(rays.size(), size_t(count) / 3);
}

TEST(Truth, ConvexBodyNeverShadowsItself) {
    expectConvexBodyLit({0.3f, 1.1f, -0.7f}, 1.0f, 64, 48, 1000000);
}
TEST(Truth, ConvexBodyOfSliversNeverShadowsItself) {
    expectConvexBodyLit({0, 0, 0}, 3.0f, 2000, 7, 200000);
}
TEST(Truth, ConvexBodyFarAwayNeverShadowsItself) {
    expectConvexBodyLit({1e5f, 2e4f, -1e5f}, 50.0f, 24, 16, 200000);
}

TEST(Truth, SheetsDoNotLeakAtSharedEdgesAndVertices) {
    TriangleSoup soup;
    constexpr int kCells = 32;
    const auto corner = [](int x, int z) {
        return glm::vec3(0.37f * float(x), 1.0f + 0.01f * float((x * 31 + z * 17) % 7),
                         0.29f * float(z));
    };
    for (int x = 0; x < kCells; ++x)
        for (int z = 0; z < kCells; ++z)
            soup.addQuad(corner(x, z), corner(x, z + 1), corner(x + 1, z + 1), corner(x + 1, z));
    const Truth truth(soup.view());
    Random random(kSeed);
    size_t leakCount = 0;
    std::vector<TruthRay> rays;
    for (int i = 0; i < 200000; ++i) {
        const int x = 4 + int(random.below(kCells - 8)), z = 4 + int(random.below(kCells - 8));
        const glm::dvec3 a = corner(x, z), b = corner(x + int(random.below(2)), z + 1);
        const glm::dvec3 target = a + (b - a) * (i % 4 ? random.between(0, 1) : 0.0);
        const glm::dvec3 from =
            target + glm::dvec3(random.inBox({-0.5f, -0.9f, -0.5f}, {0.5f, -0.2f, 0.5f}));
        rays.push_back(truth.segmentRay(glm::vec3(from), glm::vec3(from + (target - from) * 2.0)));
    }
    std::vector<uint8_t> blocked(rays.size());
    truth.traceBlocked(rays.data(), rays.size(), blocked.data());
    for (uint8_t b : blocked)
        leakCount += !b;
    EXPECT_EQ(leakCount, 0u);
}

/// A heap of random triangles over a floor.
TriangleSoup makeHeap(int count) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    Random random(kSeed + 1);
    for (int i = 0; i < count; ++i) {
        const glm::vec3 p = random.inBox({-6, 0.5f, -6}, {6, 4, 6});
        const glm::vec3 d(0.4f);
        soup.add(p, p + random.inBox(-d, d), p + random.inBox(-d, d));
    }
    return soup;
}

TEST(Truth, ResultsDependNeitherOnThreadsNorOnPackets) {
    const TriangleSoup soup = makeHeap(2000);
    const Truth truth(soup.view());
    Random random(kSeed);
    std::vector<Light> lights;
    for (int i = 0; i < 12; ++i)
        lights.push_back(pointLight(random.inBox({-6, 1, -6}, {6, 6, 6})));
    SampleRow row;
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 p = random.inBox({-7.9f, 0, -7.9f}, {7.9f, 0, 7.9f});
        row.add(p, {0, 1, 0}, p.z >= p.x ? 0 : 1);
    }
    const PairList pairs = row.pairs(lights);
    setThreadCount(1);
    const std::vector<uint8_t> one = truth.visibility(row.view(), lights, pairs);
    setThreadCount(4);
    const std::vector<uint8_t> four = truth.visibility(row.view(), lights, pairs);
    setThreadCount(0);
    EXPECT_EQ(one, four);
    size_t differentCount = 0, darkCount = 0;
    for (size_t s = 0; s < row.position.size(); ++s)
        for (uint64_t k = pairs.sampleStart[s]; k < pairs.sampleStart[s + 1]; ++k) {
            const TruthBlocker found =
                truth.blocker(row.position[s], row.normal[s], row.triangle[s],
                              lights[pairs.light[k]].positionWorld);
            differentCount += (found.triangle != kBackground) != (one[k] == 0);
            darkCount += one[k] == 0;
        }
    EXPECT_EQ(differentCount, 0u) << "packets of eight against single rays";
    EXPECT_GT(darkCount, pairs.count() / 10);
}

TEST(Truth, BlockerIsTheNearestTriangle) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 8.0f);
    soup.addLevelSquare({0, 3, 0}, 1.0f);
    const uint32_t near = soup.addLevelSquare({0, 2, 0}, 1.0f);
    const Truth truth(soup.view());
    const TruthBlocker found = truth.blocker({0.1f, 0, 0.2f}, {0, 1, 0}, 0, {0.1f, 5, 0.2f});
    EXPECT_EQ(found.triangle, near);
    EXPECT_NEAR(found.distanceWorld, 2.0f, 1e-4f);
    EXPECT_EQ(truth.blocker({5, 0, 5}, {0, 1, 0}, 0, {5, 5, 5}).triangle, kBackground);
}

TEST(Truth, FloatModeOfEveryThreadIsRestored) {
    const TriangleSoup soup = makeHeap(20000);
    const auto mode = [] { return floatModeRegister() & ~uint64_t(0x3f); }; // without exceptions
    const uint64_t before = mode();
    const Truth truth(soup.view());
    SampleRow row;
    for (int i = 0; i < 20000; ++i)
        row.add({-7.0f + 0.0006f * float(i), 0, 0.5f}, {0, 1, 0}, 0);
    const std::vector<Light> lights{pointLight({0, 5, 0})};
    truth.visibility(row.view(), lights, row.pairs(lights));
    truth.isBlocked({0, 0.1f, 0}, {0, 5, 0});
    std::atomic<int> changedCount{0};
    cpuParallelRanges(4096, 1, [&](size_t, size_t) {
        volatile float tiny = 1e-38f;
        const float half = tiny * 0.25f; // denormal: zero under flush-to-zero
        changedCount += mode() != before || half == 0.0f;
    });
    EXPECT_EQ(changedCount, 0);
    EXPECT_EQ(mode(), before);
}

TEST(Truth, CoordinatesThatEmbreeWouldIgnoreAreRefused) {
    TriangleSoup soup;
    soup.add({0, 0, 0}, {1e19f, 0, 0}, {0, 1, 0});
    try {
        const Truth truth(soup.view());
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(e.what()).find("axis 0"), std::string::npos) << e.what();
    }
}

TEST(Truth, UpdateSeesMovedTriangles) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 8.0f);
    soup.addLevelSquare({0, 1, 0}, 1.0f);
    Truth truth(soup.view());
    EXPECT_TRUE(truth.isBlocked({0, 0.5f, 0}, {0, 2, 0}));
    for (size_t i = 6; i < soup.positions.size(); ++i)
        soup.positions[i].x += 4;
    truth.update(soup.view());
    EXPECT_FALSE(truth.isBlocked({0, 0.5f, 0}, {0, 2, 0}));
    EXPECT_TRUE(truth.isBlocked({4, 0.5f, 0}, {4, 2, 0}));
}

TEST(Truth, ABuildEndsWhenThePollFunctionThrows) {
    TriangleSoup soup;
    for (int i = 0; i < 1000; ++i)
        soup.addLevelSquare({float(i), 0, 0}, 1.0f);
    setCpuPoll([](double) { throw std::runtime_error("enough"); });
    EXPECT_THROW(Truth{soup.view()}, std::runtime_error);
    setCpuPoll(nullptr);
    EXPECT_NO_THROW(Truth{soup.view()});
}

TEST(Truth, NearbyTrianglesAndTheirPlanesAreFound) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 1.0f);    // 0, 1
    soup.addLevelSquare({4, 0, 0}, 1.0f);    // 2, 3: the same plane
    soup.addLevelSquare({0, 0.1f, 0}, 1.0f); // 4, 5
    const Truth truth(soup.view());
    std::vector<int> seen(6);
    truth.forTrianglesNear({0.5, 0.0, -0.2}, 0.11, [&](uint32_t t) { ++seen[t]; });
    EXPECT_EQ(seen[0] + seen[1], 2);
    EXPECT_EQ(seen[2] + seen[3], 0);
    EXPECT_EQ(seen[4] + seen[5], 2);
    EXPECT_TRUE(truth.isCoplanar(0, 1));
    EXPECT_TRUE(truth.isCoplanar(0, 3));
    EXPECT_FALSE(truth.isCoplanar(0, 4));
    EXPECT_FALSE(truth.isCoplanar(0, kBackground));
}

} // namespace
} // namespace shadowdag
