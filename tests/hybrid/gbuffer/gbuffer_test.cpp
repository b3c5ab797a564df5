// SPDX-License-Identifier: Apache-2.0
// The G-buffer against brute-force ray casting, its fill rule, and planes through the camera.
#include "hybrid/gbuffer/gbuffer_pass.h"

#include "tests/hybrid/seen_soup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace shadowdag::test {
namespace {

using Vec = glm::vec<3, long double>;

// What a ray meets first, by Cramer's rule in long double; `margin` is how near it was to another
// answer.
struct Cast {
    uint32_t triangle = kBackground;
    long double depth = 1e30L;
    long double margin = 1e30L;
};

Cast castRay(const TriangleSoup& soup, const ViewRays& view, uint32_t x, uint32_t y) {
    const Vec d(view.direction(x, y)), origin(view.origin);
    Cast cast;
    std::vector<long double> depths;
    for (uint32_t t = 0; t < soup.triangles.size(); ++t) {
        const Vec a(soup.view().vertex(t, 0)), b(soup.view().vertex(t, 1)),
            c(soup.view().vertex(t, 2));
        const Vec e1 = b - a, e2 = c - a, s = origin - a, p = glm::cross(d, e2);
        const long double det = glm::dot(e1, p);
        if (det == 0.0L)
            continue;
        const Vec q = glm::cross(s, e1);
        const long double u = glm::dot(s, p) / det, v = glm::dot(d, q) / det;
        const long double inside = std::min({u, v, 1.0L - u - v});
        const long double depth = glm::dot(e2, q) / det;
        if (depth < view.znear - 1e-6L || depth > view.zfar + 1e-6L)
            continue;
        if (inside > -1e-9L)
            cast.margin = std::min(cast.margin, std::abs(inside));
        if (inside < 0.0L || depth < view.znear || depth > view.zfar)
            continue;
        depths.push_back(depth);
        if (depth < cast.depth) {
            cast.depth = depth;
            cast.triangle = t;
        }
    }
    for (const long double depth : depths)
        if (depth != cast.depth)
            cast.margin = std::min(cast.margin, depth / cast.depth - 1.0L);
    return cast;
}

// Small triangles one by one, large ones tile by tile, if there is room on the list.
TEST(GBuffer, DrawnBySlotIsDrawnByBatchBitForBit) {
    for (uint64_t seed = 1; seed <= 4; ++seed)
        for (const glm::uvec2 size : {glm::uvec2(333, 187), glm::uvec2(64, 32), glm::uvec2(7, 3),
                                      glm::uvec2(4099, 9), glm::uvec2(3, 2)})
            for (const size_t room : {size_t(0), size_t(1), GBuffer::kLargeTriangles}) {
                SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << size.x << " x "
                                                << size.y << ", room for " << room);
                const TriangleSoup soup = randomSoup(seed, 400);
                const ViewRays view = makeViewRays(frontCamera(), size.x, size.y);
                GBuffer bySlot = drawSoup(soup, view, GBufferDraw::kBySlot, room);
                EXPECT_EQ(bySlot.visibility.download(), drawSoup(soup, view).visibility.download());
                // One is too little, and the smallest picture needs none.
                EXPECT_EQ(bySlot.large.grow() > 0, size.x > 7 && room < 2) << room;
            }
}

// Where a plane is cut by the near or the far plane, part of a tile within the triangle is empty.
TEST(GBuffer, PlanesThatLeaveTheViewWithinATileAreDrawnBitForBit) {
    Camera camera = frontCamera();
    camera.znear = 2.0f;
    camera.zfar = 8.0f;
    for (uint64_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const TriangleSoup soup = randomSoup(seed, 900);
        const ViewRays view = makeViewRays(camera, 331, 190);
        EXPECT_EQ(drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download(),
                  drawSoup(soup, view).visibility.download());
    }
}

/// Returns triangles in the plane y = 0, but for heights of at most `size`.
TriangleSoup flatSoup(std::mt19937_64& random, float size, int count) {
    std::uniform_real_distribution<float> across(-8.0f, 8.0f), ahead(-40.0f, -0.5f),
        tiny(-1.0f, 1.0f);
    TriangleSoup soup;
    const auto point = [&] {
        const float x = across(random), y = size * tiny(random);
        return glm::vec3(x, y, ahead(random));
    };
    for (int i = 0; i < count; ++i) {
        const glm::vec3 a = point(), b = point();
        soup.add(a, b, point());
    }
    return soup;
}

// Seen edge on, edges are as small as what rounding leaves of them; and the picture is as wide as
// pictures can be, where rectangles in floats are least exact.
TEST(GBuffer, EdgeOnTrianglesInWidePicturesAreDrawnBitForBit) {
    constexpr uint64_t kSeed = 20261129;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    Camera camera = frontCamera();
    camera.yfov = 0.01f; // rows are 16383 pixels and 5 m wide, 1 m ahead
    size_t seenCount = 0;
    for (int run = 0; run < 12; ++run) {
        SCOPED_TRACE(run);
        const TriangleSoup soup = flatSoup(random, std::exp2(-40.0f - 8.0f * float(run)), 600);
        const ViewRays view = makeViewRays(camera, 16383, 31);
        const std::vector<uint64_t> bySlot =
            drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download();
        EXPECT_EQ(drawSoup(soup, view).visibility.download(), bySlot);
        seenCount += size_t(std::count_if(bySlot.begin(), bySlot.end(),
                                          [](uint64_t seen) { return seen != kNothingSeen; }));
    }
    EXPECT_GT(seenCount, 10000u);
}

// Corners far to the side of a wide view, or hardly in front of the camera, are projected least
// exactly; far from the origin their differences to it are, too.
TEST(GBuffer, WideViewsAreDrawnBitForBit) {
    constexpr uint64_t kSeed = 20261131;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    size_t seenCount = 0;
    for (int run = 0; run < 24; ++run) {
        SCOPED_TRACE(run);
        Camera camera = frontCamera();
        camera.yfov = run % 2 ? 3.09f : 2.0f;
        camera.znear = std::exp2(-float(run));
        const glm::vec3 far = run % 3 ? glm::vec3(0.0f) : glm::vec3(4099.3f, -513.7f, 8190.1f);
        camera.positionWorld += far;
        const glm::vec3 eye = camera.positionWorld;
        TriangleSoup soup;
        for (int i = 0; i < 500; ++i) {
            // Anywhere around the eye, from 2^-12 to 2^8 m away, and of any size.
            const float away = std::exp2(-2.0f + 10.0f * unit(random));
            const auto point = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
            const glm::vec3 centre = eye + away * point();
            const float size = away * std::exp2(-4.0f + 4.0f * unit(random));
            const glm::vec3 a = centre + size * point(), b = centre + size * point();
            soup.add(a, b, centre + size * point());
        }
        const ViewRays view = makeViewRays(camera, 1921, 61);
        const std::vector<uint64_t> bySlot =
            drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download();
        EXPECT_EQ(drawSoup(soup, view).visibility.download(), bySlot);
        seenCount += size_t(std::count_if(bySlot.begin(), bySlot.end(),
                                          [](uint64_t seen) { return seen != kNothingSeen; }));
    }
    EXPECT_GT(seenCount, 100000u);
}

// The lanes of a row's end, pixels without a triangle, and planes through the eye included.
TEST(GBuffer, SamplesInLanesAreThoseOneByOneBitForBit) {
    constexpr uint64_t kSeed = 20261130;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    for (const uint32_t width : {1u, 2u, 3u, 5u, 8u, 97u})
        for (const float size : {0.0f, 0x1p-60f}) {
            SCOPED_TRACE(testing::Message() << width << " pixels, height " << size);
            const TriangleSoup soup =
                size > 0.0f ? flatSoup(random, size, 60) : randomSoup(random(), 60);
            const ViewRays view = makeViewRays(frontCamera(), width, 61);
            GBuffer inLanes = drawSoup(soup, view), one(Backend::kCpu);
            one.resize(width, 61);
            ResolveSamples oneByOne = one.resolvePass(soup.view(), view);
            oneByOne.visibility = inLanes.visibility.view();
            parallelFor<CpuTag>(oneByOne.itemCount(), oneByOne);
            const auto isSame = [](const auto& a, const auto& b) {
                const auto x = a.download(), y = b.download();
                return x.size() == y.size() &&
                       std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
            };
            EXPECT_TRUE(isSame(inLanes.positionWorld, one.positionWorld));
            EXPECT_TRUE(isSame(inLanes.normalWorld, one.normalWorld));
            EXPECT_TRUE(isSame(inLanes.depthView, one.depthView));
            EXPECT_TRUE(isSame(inLanes.triangle, one.triangle));
        }
}

TEST(GBuffer, EqualsBruteForceRays) {
    for (uint64_t seed = 1; seed <= 4; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const TriangleSoup soup = randomSoup(seed, 400);
        const ViewRays view = makeViewRays(frontCamera(), 97, 61);
        const GBuffer gbuffer = drawSoup(soup, view);
        const GBufferView seen = gbuffer.view();
        size_t differCount = 0, closeCount = 0, backgroundCount = 0;
        for (uint32_t y = 0; y < 61; ++y)
            for (uint32_t x = 0; x < 97; ++x) {
                const size_t i = y * 97 + x;
                const Cast cast = castRay(soup, view, x, y);
                backgroundCount += cast.triangle == kBackground;
                if (cast.margin < 1e-6L) { // depths are compared as floats
                    ++closeCount;
                    continue;
                }
                differCount += seen.triangle[i] != cast.triangle;
                if (cast.triangle != kBackground && seen.triangle[i] == cast.triangle) {
                    const Vec at = Vec(view.origin) + cast.depth * Vec(view.direction(x, y));
                    EXPECT_LT(glm::length(at - Vec(seen.positionWorld[i])),
                              2e-6L * glm::length(at));
                    EXPECT_NEAR(seen.depthView[i], double(cast.depth), 1e-6 * double(cast.depth));
                }
            }
        EXPECT_EQ(differCount, 0u);
        EXPECT_LT(closeCount, 20u);
        EXPECT_GT(backgroundCount, 100u);
        EXPECT_LT(backgroundCount, 5000u);
    }
}

TEST(GBuffer, NormalsAreUnitGeometricAndFaceTheCamera) {
    const TriangleSoup soup = randomSoup(7, 300);
    const ViewRays view = makeViewRays(frontCamera(), 80, 60);
    const GBuffer gbuffer = drawSoup(soup, view);
    const GBufferView seen = gbuffer.view();
    size_t count = 0;
    for (size_t i = 0; i < seen.count(); ++i) {
        if (seen.triangle[i] == kBackground) {
            EXPECT_EQ(seen.positionWorld[i], glm::vec3(0.0f));
            EXPECT_EQ(seen.normalWorld[i], glm::vec3(0.0f));
            EXPECT_EQ(seen.depthView[i], 0.0f);
            continue;
        }
        ++count;
        const glm::vec3 n = seen.normalWorld[i];
        EXPECT_NEAR(glm::length(n), 1.0f, 1e-6f);
        EXPECT_LT(glm::dot(glm::dvec3(n), view.direction(uint32_t(i % 80), uint32_t(i / 80))),
                  1e-6);
        for (int corner = 1; corner < 3; ++corner) {
            const glm::vec3 side = soup.view().vertex(seen.triangle[i], corner) -
                                   soup.view().vertex(seen.triangle[i], 0);
            EXPECT_NEAR(glm::dot(n, side), 0.0f, 1e-4f * glm::length(side));
        }
    }
    EXPECT_GT(count, 1000u);
}

TEST(GBuffer, AFloorThroughTheCameraPlaneIsSeenToTheNearPlane) {
    TriangleSoup soup;
    soup.addLevelSquare({0, -1, 0}, 50.0f); // reaches 50 m behind the camera
    const ViewRays view = makeViewRays(frontCamera(), 64, 64);
    const GBuffer gbuffer = drawSoup(soup, view);
    const GBufferView seen = gbuffer.view();
    for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 64; ++x) {
            const glm::dvec3 d = view.direction(x, y);
            const double depth = d.y < 0.0 ? -1.0 / d.y : 1e30; // the floor is 1 m below
            const bool isSeen = depth < 50.0 && std::abs(depth * d.x) < 50.0;
            const size_t i = y * 64 + x;
            ASSERT_EQ(seen.triangle[i] != kBackground, isSeen) << x << " " << y;
            if (isSeen) {
                EXPECT_NEAR(seen.positionWorld[i].y, -1.0f, 1e-6f);
                EXPECT_NEAR(seen.depthView[i], depth, 1e-6 * depth);
                EXPECT_EQ(seen.normalWorld[i], glm::vec3(0, 1, 0));
            }
        }
}

TEST(GBuffer, ASharedEdgeThroughPixelCentresLeavesNoCrack) {
    // A fan around the axis; its edges pass exactly through the centres of the middle row, column
    // and diagonals.
    TriangleSoup soup;
    const glm::vec3 center(0, 0, -2);
    const glm::vec3 rim[8] = {{8, 0, -2},  {8, 8, -2},   {0, 8, -2},  {-8, 8, -2},
                              {-8, 0, -2}, {-8, -8, -2}, {0, -8, -2}, {8, -8, -2}};
    for (int i = 0; i < 8; ++i)
        i % 2 ? soup.add(center, rim[i], rim[(i + 1) % 8])
              : soup.add(rim[(i + 1) % 8], center, rim[i]);
    const ViewRays view = makeViewRays(frontCamera(), 63, 63);
    const GBuffer gbuffer = drawSoup(soup, view);
    for (size_t i = 0; i < gbuffer.triangle.size(); ++i)
        EXPECT_NE(gbuffer.triangle.at(i), kBackground) << i % 63 << " " << i / 63;
}

// The middle row of an odd picture looks along them: their depth is a quotient of rounding errors.
TEST(GBuffer, SamplesOfPlanesThroughTheEyeLieWhereTheyAreSeen) {
    constexpr uint64_t kSeed = 20261126;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    size_t seenCount = 0;
    for (int run = 0; run < 200; ++run) {
        SCOPED_TRACE(run);
        const TriangleSoup soup = flatSoup(random, std::exp2(-20.0f - float(run % 130)), 30);
        const ViewRays view = makeViewRays(frontCamera(), 97, 61);
        const GBuffer gbuffer = drawSoup(soup, view);
        const GBufferView seen = gbuffer.view();
        for (size_t i = 0; i < seen.triangle.count; ++i) {
            if (seen.triangle[i] == kBackground)
                continue;
            ++seenCount;
            const double depth =
                glm::dot(glm::dvec3(seen.positionWorld[i]) - view.origin, view.forward);
            EXPECT_NEAR(depth, seen.depthView[i], 1e-5 * seen.depthView[i]);
        }
    }
    EXPECT_GT(seenCount, 1000u);
}

TEST(GBuffer, DegenerateTrianglesAreNeverVisible) {
    TriangleSoup soup;
    soup.add({0, 0, -1}, {0, 0, -1}, {0, 0, -1});
    soup.add({-1, 0, -1}, {1, 0, -1}, {1, 0, -1});
    soup.add({-0.1f, -0.1f, -1}, {0.2f, 0.2f, -1}, {0.7f, 0.7f, -1});
    soup.add({-0.3f, 0, -1.1f}, {0, 0, -1.1f}, {0.3f, 0, -1.1f});
    const uint32_t wall = soup.addQuad({-9, -9, -5}, {9, -9, -5}, {9, 9, -5}, {-9, 9, -5});
    const ViewRays view = makeViewRays(frontCamera(), 33, 33);
    const GBuffer gbuffer = drawSoup(soup, view);
    for (size_t i = 0; i < gbuffer.triangle.size(); ++i) {
        EXPECT_GE(gbuffer.triangle.at(i), wall);
        EXPECT_NE(gbuffer.triangle.at(i), kBackground);
    }
}

TEST(GBuffer, OfCoincidentTrianglesTheLowestIndexWins) {
    TriangleSoup soup;
    for (int i = 0; i < 5; ++i)
        soup.add({-9, -9, -5}, {19, -9, -5}, {-9, 19, -5});
    const ViewRays view = makeViewRays(frontCamera(), 16, 16);
    const GBuffer gbuffer = drawSoup(soup, view);
    for (size_t i = 0; i < gbuffer.triangle.size(); ++i)
        EXPECT_EQ(gbuffer.triangle.at(i), 0u);
}

TEST(GBuffer, NothingBeforeTheNearOrBehindTheFarPlaneIsSeen) {
    const ViewRays view = makeViewRays(frontCamera(), 8, 8);
    for (const float z : {-0.05f, -150.0f, 0.5f}) {
        TriangleSoup soup;
        soup.addQuad({-999, -999, z}, {999, -999, z}, {999, 999, z}, {-999, 999, z});
        const GBuffer gbuffer = drawSoup(soup, view);
        for (size_t i = 0; i < gbuffer.triangle.size(); ++i)
            EXPECT_EQ(gbuffer.triangle.at(i), kBackground) << z;
    }
}

/// Returns a point of [-1, 1)^3.
glm::vec3 pointIn(std::mt19937_64& random) {
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const float x = unit(random), y = unit(random), z = unit(random);
    return {x, y, z};
}

// Triangles of about a pixel, near the world's origin and where floats are coarse: none that
// touches a pixel's centre is left out.
TEST(GBuffer, TinyTrianglesAreDrawnFarFromTheOriginToo) {
    constexpr uint64_t kSeed = 20261127;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    const auto point = [&] { return pointIn(random); };
    for (const float offset : {0.0f, 300.0f, 1e5f, 1e7f, 9e8f}) {
        SCOPED_TRACE(offset);
        const float scale = std::max(1.0f, offset / 300.0f);
        Camera camera = frontCamera();
        camera.positionWorld = offset * glm::vec3(1.0f, -0.7f, 0.4f);
        camera.znear *= scale;
        camera.zfar *= scale;
        const ViewRays view = makeViewRays(camera, 160, 120);
        TriangleSoup soup;
        for (int i = 0; i < 30000; ++i) {
            const glm::vec3 center = camera.positionWorld + scale * 8.0f * point();
            const float size = scale * 0.08f * (1.0f + point().x);
            soup.add(center + size * point(), center + size * point(), center + size * point());
        }
        const std::vector<uint64_t> drawn = drawSoup(soup, view).visibility.download();
        EXPECT_EQ(drawn, drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download());
        EXPECT_GT(std::count_if(drawn.begin(), drawn.end(),
                                [](uint64_t seen) { return seen != kNothingSeen; }),
                  1000);
    }
}

// A wall hides most batches: none that a pixel sees is left out, nor one of triangles whose planes
// pass through the eye, where quotients give any depth.
TEST(GBuffer, BatchesBehindAWallAreDrawnWhereTheyAreSeen) {
    constexpr uint64_t kSeed = 20261128;
    RecordProperty("seed", std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    const auto point = [&] { return pointIn(random); };
    TriangleSoup soup;
    soup.addQuad({-1.9f, -1.5f, -2.0f}, {1.1f, -1.6f, -2.2f}, {1.2f, 1.4f, -2.1f},
                 {-1.8f, 1.3f, -1.9f});
    for (int i = 0; i < 150000; ++i) {
        const glm::vec3 center = glm::vec3(0, 0, -12) + 11.0f * point();
        soup.add(center + 0.1f * point(), center + 0.1f * point(), center + 0.1f * point());
    }
    for (int i = 0; i < 3000; ++i) {
        const float height = std::exp2(-30.0f - float(i % 100));
        const auto flat = [&] {
            const glm::vec3 p = point();
            const float z = -11.0f + 8.0f * p.z; // behind the wall
            return glm::vec3(0.3f * z * p.x, height * p.y, z);
        };
        const glm::vec3 a = flat(), b = flat();
        soup.add(a, b, flat());
    }
    for (const glm::uvec2 size : {glm::uvec2(161, 99), glm::uvec2(13, 7)}) {
        const ViewRays view = makeViewRays(frontCamera(), size.x, size.y);
        const std::vector<uint64_t> bySlot =
            drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download();
        for (const int threads : {1, 3, 8}) {
            setThreadCount(threads);
            EXPECT_EQ(drawSoup(soup, view).visibility.download(), bySlot) << threads << " threads";
        }
        setThreadCount(0);
        EXPECT_GT(std::count_if(bySlot.begin(), bySlot.end(),
                                [](uint64_t seen) { return uint32_t(seen) < 2; }),
                  ptrdiff_t(bySlot.size() / 5));
    }
}

// How many bands there are, and so what each leaves out, depends on the number of threads.
TEST(GBuffer, IsTheSameForAnyNumberOfThreads) {
    const TriangleSoup soup = randomSoup(11, 3000);
    const ViewRays view = makeViewRays(frontCamera(), 200, 150);
    const std::vector<uint64_t> bySlot =
        drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download();
    for (const int threads : {1, 2, 3, 4, 5, 8}) {
        setThreadCount(threads);
        EXPECT_EQ(threadCount(), threads);
        EXPECT_EQ(drawSoup(soup, view).visibility.download(), bySlot) << threads << " threads";
    }
    setThreadCount(0);
}

// What bands drew before hides what they draw in the next round.
TEST(GBuffer, IsTheSameForAnyNumberOfBatchesInARound) {
    const TriangleSoup soup = randomSoup(12, 3000);
    const ViewRays view = makeViewRays(frontCamera(), 200, 150);
    const std::vector<uint64_t> bySlot =
        drawSoup(soup, view, GBufferDraw::kBySlot).visibility.download();
    const BatchSet set(soup.view(), std::vector<uint32_t>(soup.triangles.size(), 0u));
    const BatchView batches = set.view();
    for (const size_t batchesPerRound : {size_t(1), size_t(3), batches.batches.count}) {
        std::vector<uint64_t> seen(bySlot.size(), kNothingSeen);
        rasterizeFrontToBack({soup.view(), batches.batches, batches.boxesWorld, batches.triangles,
                              view, viewOf(seen)},
                             batches.vertices, batchesPerRound);
        EXPECT_EQ(seen, bySlot) << batchesPerRound << " batches a round";
    }
}

TEST(ViewRays, RefuseInvalidImagesAndCameras) {
    EXPECT_THROW(makeViewRays(frontCamera(), 0, 10), Error);
    EXPECT_THROW(makeViewRays(frontCamera(), 10, 16385), Error);
    Camera camera = frontCamera();
    camera.up = camera.forward;
    EXPECT_THROW(makeViewRays(camera, 10, 10), Error);
    camera = frontCamera();
    camera.znear = 0.0f;
    EXPECT_THROW(makeViewRays(camera, 10, 10), Error);
    camera = frontCamera();
    camera.yfov = NAN;
    EXPECT_THROW(makeViewRays(camera, 10, 10), Error);
}

} // namespace
} // namespace shadowdag::test
