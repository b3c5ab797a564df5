// SPDX-License-Identifier: Apache-2.0
// Shadow maps from receivers to stored depths. More than 500 lines because its cases share setup
// and comparison of maps.
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::freshMaps;
using test::nineTaps;
using test::Oracle;
using test::SmallScene;

// A texel's centre ray, as Embree sees it: the stored 1/z is that of the first hit, and 0 where
// there is none. Rays that pass within rounding of an edge may differ; they are few.
TEST(ShadowMaps, StoredDepthIsEmbreesFirstHitAlongEveryTexelCentre) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 rng(seed);
        const SmallScene scene =
            test::randomScene(rng, seed == 1 ? 40 : 800, 3.0f, seed == 3 ? 3.0f : 0.5f);
        const Oracle oracle(scene);
        const glm::vec3 light(0.1f, -0.2f, 0.3f);
        for (const uint32_t n : {1u, 7u, 64u, 150u}) {
            const DrawnMap drawn(scene, light, 6.0f, n);
            const ShadowMapView view = drawn.maps.view();
            const ShadowMapInfo& map = view.maps[0];
            ASSERT_EQ(map.faceTexels, n);
            size_t different = 0, blocked = 0;
            for (uint32_t face = 0; face < kFaceCount; ++face)
                for (uint32_t y = 0; y < n; ++y)
                    for (uint32_t x = 0; x < n; ++x) {
                        const uint32_t bits = depthAt(view, map, {face, x, y});
                        ASSERT_NE(bits, kNoPage);
                        const float w = bitsFloat(bits);
                        const glm::vec3 c =
                            lightFromFace(face, glm::vec3(faceCellCentre(int32_t(x), n),
                                                          faceCellCentre(int32_t(y), n), 1.0f));
                        const float z = oracle.firstHit(light, c, 0.0f, 6.0f);
                        blocked += w > 0.0f;
                        const float expected = std::isinf(z) ? 0.0f : 1.0f / z;
                        // Culling by the sphere may keep or drop what lies beyond the range.
                        if (w < 1.0f / 6.0f && expected == 0.0f)
                            continue;
                        different += std::abs(w - expected) > 2e-5f * expected;
                    }
            EXPECT_LE(different, 6 * n * n / 20000) << n;
            if (n > 7) {
                EXPECT_GT(blocked, n * n / 8) << n;
            }
        }
    }
}

// What a frame of several maps looks like: lights in and around a scene, receivers that are small
// boxes.
struct Frame {
    SmallScene scene;
    BatchSet batches;
    std::vector<MapRequest> requests;
    std::vector<Box> boxes;
    std::vector<MapReceiver> receivers;

    Frame(uint32_t seed, uint32_t triangleCount)
        : scene(make(seed, triangleCount)), batches(scene.batches()) {
        std::mt19937 rng(seed + 100);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        const uint32_t texels[] = {1, 5, 8, 13, 64, 97, 200, 333, 1000, 2048};
        for (uint32_t i = 0; i < 10; ++i)
            requests.push_back({3.0f * glm::vec3(unit(rng), unit(rng), unit(rng)),
                                1.0f + 2.0f * std::abs(unit(rng)), i, texels[i]});
        for (uint32_t i = 0; i < 60; ++i) {
            const glm::vec3 c = 3.0f * glm::vec3(unit(rng), unit(rng), unit(rng));
            const glm::vec3 e = 0.3f * glm::abs(glm::vec3(unit(rng), unit(rng), unit(rng)));
            boxes.push_back({c - e, c + e});
            for (uint32_t m = 0; m < requests.size(); ++m)
                if (distanceSquared(boxes[i], requests[m].lightPositionWorld) <
                    requests[m].rangeWorld * requests[m].rangeWorld)
                    receivers.push_back({i, m});
        }
    }
    static SmallScene make(uint32_t seed, uint32_t count) {
        std::mt19937 rng(seed);
        return test::randomScene(rng, count, 3.0f, 0.3f);
    }
    void build(ShadowMaps& maps, const ShadowMapOptions& options = freshMaps()) const {
        StageTimes stages;
        maps.build(requests, boxes, receivers, scene.view(), batches.view(), options, stages);
    }
};

Box wholeBoxOf(float range) {
    return test::wholeBox(glm::vec3(0), range);
}

std::vector<uint32_t> tableOf(const ShadowMaps& maps) {
    const View<const uint32_t> t = maps.view().pageTable;
    return {t.begin(), t.end()};
}
std::vector<uint32_t> depthsOf(const ShadowMaps& maps) {
    const View<const uint32_t> t = maps.view().depths;
    return {t.begin(), t.end()};
}

TEST(ShadowMaps, SameBitsForOneAndTwoThreadsAndForBothCpuKernels) {
    const Frame frame(4, 3000);
    setThreadCount(1);
    ShadowMaps one(Backend::kCpu);
    frame.build(one);
    setThreadCount(2);
    ShadowMaps two(Backend::kCpu);
    frame.build(two);
    ShadowMapOptions atomic = freshMaps();
    atomic.useAtomicRasterizer = true;
    ShadowMaps text(Backend::kCpu);
    frame.build(text, atomic);
    setThreadCount(0);
    EXPECT_EQ(tableOf(one), tableOf(two));
    EXPECT_EQ(depthsOf(one), depthsOf(two));
    EXPECT_EQ(depthsOf(one), depthsOf(text));
    EXPECT_EQ(one.pagesPerMap(), two.pagesPerMap());
    EXPECT_EQ(one.trianglesPerMap(), two.trianglesPerMap());
    EXPECT_GT(one.counts().pageCount, 100u);
    EXPECT_EQ(one.counts().texelCount, one.counts().pageCount * 64 * 64);
    uint64_t pages = 0;
    for (const uint32_t p : one.pagesPerMap())
        pages += p;
    EXPECT_EQ(pages, one.counts().pageCount);
}

TEST(ShadowMaps, CudaGivesTheBitsOfTheCpu) {
    try {
        chooseBackend("cuda");
    } catch (const Error& error) {
        GTEST_SKIP() << error.what();
    }
    const Frame frame(4, 3000);
    ShadowMaps host(Backend::kCpu), device(Backend::kCuda);
    frame.build(host);
    frame.build(device);
    const auto downloaded = [](View<const uint32_t> words) {
        std::vector<uint32_t> copy(words.count);
        detail::copyBytes(Backend::kCpu, copy.data(), Backend::kCuda, words.data,
                          words.count * sizeof(uint32_t));
        return copy;
    };
    EXPECT_EQ(tableOf(host), downloaded(device.view().pageTable));
    EXPECT_EQ(depthsOf(host), downloaded(device.view().depths));
    EXPECT_EQ(host.pagesPerMap(), device.pagesPerMap());
    EXPECT_EQ(host.trianglesPerMap(), device.trianglesPerMap());
}

// Any receiver in its box, any normal: no tap misses its page, and no culling switch changes an
// answer.
TEST(ShadowMaps, NoReceiverInItsBoxMissesAPageAndCullingChangesNoLookup) {
    for (const uint32_t seed : {1u, 2u})
        for (const uint32_t taps : {1u, 9u})
            for (const uint32_t pageTexels : {16u, 64u, 256u}) {
                SCOPED_TRACE("seed " + std::to_string(seed) + " taps " + std::to_string(taps));
                const Frame frame(seed, 4000);
                ShadowMapOptions options = freshMaps();
                options.pageTexels = pageTexels;
                options.taps = taps;
                ShadowMaps cells(Backend::kCpu), full(Backend::kCpu), projected(Backend::kCpu),
                    masked(Backend::kCpu);
                options.culling = MapCulling::kCellDepth;
                frame.build(cells, options);
                options.culling = MapCulling::kMaximumDepth;
                frame.build(full, options);
                options.culling = MapCulling::kProjectionMap;
                frame.build(projected, options);
                options.culling = MapCulling::kFaceMask;
                frame.build(masked, options);
                EXPECT_LT(cells.counts().batchFaceCount, full.counts().batchFaceCount);
                EXPECT_LT(full.counts().batchFaceCount, projected.counts().batchFaceCount);
                EXPECT_LT(projected.counts().batchFaceCount, masked.counts().batchFaceCount);
                EXPECT_LT(masked.counts().batchFaceCount, masked.counts().batchFaceSphereCount);
                ShadowMaps sphere(Backend::kCpu);
                options.culling = MapCulling::kSphere;
                frame.build(sphere, options);
                EXPECT_EQ(sphere.counts().batchFaceCount, sphere.counts().batchFaceSphereCount);
                EXPECT_EQ(tableOf(full), tableOf(masked));
                std::mt19937 rng(seed);
                std::uniform_real_distribution<float> unit(0.0f, 1.0f);
                size_t missing = 0, different = 0, dark = 0, asked = 0;
                ShadowMapBias bias = nineTaps();
                bias.taps = taps;
                for (const MapReceiver& r : frame.receivers)
                    for (int i = 0; i < 60; ++i) {
                        const Box& box = frame.boxes[r.box];
                        const MapRequest& map = frame.requests[r.map];
                        glm::vec3 p =
                            box.min + box.extent() * glm::vec3(unit(rng), unit(rng), unit(rng));
                        if (i < 8)
                            p = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                 i & 4 ? box.max.z : box.min.z};
                        const glm::vec3 d = p - map.lightPositionWorld;
                        if (glm::length(d) >= map.rangeWorld)
                            continue;
                        glm::vec3 normal = test::randomDirection(rng);
                        if (glm::dot(normal, d) > 0.0f)
                            normal = -normal;
                        ShadowMapTrace trace;
                        const uint8_t v =
                            lookupVisibility(full.view(), r.map, p, normal, bias, &trace);
                        missing += trace.missingTapCount;
                        different +=
                            v != lookupVisibility(cells.view(), r.map, p, normal, bias) ||
                            v != lookupVisibility(projected.view(), r.map, p, normal, bias) ||
                            v != lookupVisibility(masked.view(), r.map, p, normal, bias);
                        dark += v < 128;
                        ++asked;
                    }
                EXPECT_EQ(missing, 0u);
                EXPECT_EQ(different, 0u);
                EXPECT_GT(dark, asked / 20);
                EXPECT_LT(dark, asked);
            }
}

// The culling depth of a face is that of its farthest receiver and hardly more, on every face: what
// stands a hundredth before it blocks, what stands a fiftieth behind it is not drawn.
TEST(ShadowMaps, BlockerJustBeforeTheFarthestReceiverIsDrawnAndOneBehindItIsNot) {
    const glm::vec3 light(2.0f, -1.0f, 0.5f);
    const float farDepth = 5.0f;
    for (uint32_t face = 0; face < kFaceCount; ++face) {
        SCOPED_TRACE("face " + std::to_string(face));
        const auto world = [&](float u, float v, float depth) {
            return light + lightFromFace(face, glm::vec3(u, v, depth));
        };
        Box receiver;
        receiver.add(world(-0.2f, -0.2f, 3.0f));
        receiver.add(world(0.2f, 0.2f, farDepth));
        const glm::vec3 p = world(0.1f, -0.05f, farDepth);
        const glm::vec3 normal = -lightFromFace(face, glm::vec3(0, 0, 1));
        for (const float fraction : {0.5f, 0.99f, 1.02f}) {
            SmallScene scene;
            scene.addQuad(world(0, 0, fraction * farDepth), lightFromFace(face, glm::vec3(1, 0, 0)),
                          lightFromFace(face, glm::vec3(0, 1, 0)));
            const DrawnMap drawn(scene, light, 10.0f, 1000, {receiver});
            const bool blocks = fraction < 1.0f;
            EXPECT_EQ(drawn.maps.counts().batchFaceCount, blocks ? 1u : 0u) << fraction;
            EXPECT_EQ(lookupVisibility(drawn.maps.view(), 0, p, normal, {}), blocks ? 0 : 255)
                << fraction;
        }
    }
}

// One face, receivers near on its left and far on its right, a batch between both depths before
// each: one depth a face draws both batches, a depth a cell only the right one.
TEST(ShadowMaps, CellDepthsDropABatchBehindTheReceiversOfItsOwnCells) {
    const glm::vec3 light(0.5f, 1.0f, -2.0f);
    for (uint32_t face = 0; face < kFaceCount; ++face) {
        SCOPED_TRACE("face " + std::to_string(face));
        const auto world = [&](float u, float v, float depth) {
            return light + lightFromFace(face, depth * glm::vec3(u, v, 1.0f));
        };
        std::vector<Box> receivers(2);
        receivers[0].add(world(-0.8f, -0.2f, 2.0f));
        receivers[0].add(world(-0.4f, 0.2f, 2.0f));
        receivers[1].add(world(0.4f, -0.2f, 8.0f));
        receivers[1].add(world(0.8f, 0.2f, 8.0f));
        SmallScene scene;
        for (const float u : {-0.6f, 0.6f})
            scene.addQuad(world(u, 0, 5), lightFromFace(face, glm::vec3(0.5f, 0, 0)),
                          lightFromFace(face, glm::vec3(0, 0.5f, 0)), 2);
        const std::vector<uint32_t> instances{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
        const BatchSet batches(scene.view(), instances);
        ASSERT_EQ(batches.size(), 2u);
        for (const MapCulling culling : {MapCulling::kMaximumDepth, MapCulling::kCellDepth}) {
            const uint64_t expected = culling == MapCulling::kCellDepth ? 1 : 2;
            ShadowMapOptions options = freshMaps();
            options.culling = culling;
            ShadowMaps maps(Backend::kCpu);
            StageTimes stages;
            maps.build({{light, 20.0f, 0, 256}}, receivers, {{0, 0}, {1, 0}}, scene.view(),
                       batches.view(), options, stages);
            EXPECT_EQ(maps.counts().batchFaceCount, expected);
            EXPECT_EQ(maps.counts().triangleDrawCount, 8 * expected);
            const glm::vec3 normal = -lightFromFace(face, glm::vec3(0, 0, 1));
            EXPECT_EQ(lookupVisibility(maps.view(), 0, world(-0.6f, 0, 2), normal, {}), 255);
            EXPECT_EQ(lookupVisibility(maps.view(), 0, world(0.6f, 0, 8), normal, {}), 0);
        }
    }
}

// Triangles of all sizes around and behind the light, thin and on texel centres: where the CPU's
// kernel guesses, proves and leaves things to the one text.
TEST(ShadowMaps, CpuKernelEqualsTheSharedCodeOnSliversGridsAndTrianglesAroundTheLight) {
    for (const uint32_t seed : {11u, 12u, 13u})
        for (const uint32_t pageTexels : {16u, 64u}) {
            SCOPED_TRACE("seed " + std::to_string(seed));
            std::mt19937 rng(seed);
            std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
            SmallScene scene = test::randomScene(rng, 100, 0.5f, 3.0f); // many cross the light
            scene.addQuad({0, 0, 2}, {1.9f, 0, 0}, {0, 1.9f, 0}, 19);   // edges on centres
            scene.addBox(glm::vec3(-2), glm::vec3(2), 16);
            for (int i = 0; i < 300; ++i) { // slivers, along and across the rows
                const glm::vec3 a = 2.0f * test::randomDirection(rng);
                const glm::vec3 along = (i & 1) ? glm::vec3(unit(rng), 1e-6f * unit(rng), 0)
                                                : test::randomDirection(rng);
                const float width = std::exp2(-20.0f * std::abs(unit(rng)));
                scene.addTriangle(a, a + along, a + 0.5f * along + width * glm::vec3(0, 0, 1));
            }
            const glm::vec3 light = seed == 11 ? glm::vec3(0) : 0.1f * test::randomDirection(rng);
            for (const uint32_t n : {1u, 5u, 64u, 200u, 777u}) {
                if (n == 777 && seed != 13)
                    continue; // which takes most of the time
                ShadowMapOptions options = freshMaps();
                options.pageTexels = pageTexels;
                // Whole, and with holes between the pages.
                std::vector<Box> boxes[2];
                for (int i = 0; i < 12; ++i) {
                    const glm::vec3 c = 2.0f * test::randomDirection(rng);
                    boxes[1].push_back({c - 0.1f, c + 0.1f});
                }
                for (const std::vector<Box>& receivers : boxes) {
                    options.useAtomicRasterizer = false;
                    const DrawnMap own(scene, light, 8.0f, n, receivers, options);
                    options.useAtomicRasterizer = true;
                    const DrawnMap text(scene, light, 8.0f, n, receivers, options);
                    EXPECT_EQ(depthsOf(own.maps), depthsOf(text.maps)) << n;
                }
            }
        }
}

TEST(ShadowMaps, FullPoolDividesEveryResolutionUntilItFitsAndReportsIt) {
    const Frame frame(5, 500);
    ShadowMaps roomy(Backend::kCpu), tight(Backend::kCpu);
    frame.build(roomy);
    EXPECT_EQ(roomy.counts().degradeDivisor, 1.0f);
    EXPECT_EQ(roomy.counts().pagesWantedCount, roomy.counts().pageCount);
    ShadowMapOptions options = freshMaps();
    options.poolBytes = roomy.counts().pageCount / 3 * 64 * 64 * 4;
    frame.build(tight, options);
    const ShadowMapCounts& counts = tight.counts();
    EXPECT_EQ(counts.pagesWantedCount, roomy.counts().pageCount);
    EXPECT_GT(counts.degradeDivisor, 1.4f);
    EXPECT_LE(counts.pageCount * 64 * 64 * 4, options.poolBytes);
    EXPECT_EQ(counts.pagesRefusedCount, 0u);
    // The divisor is a power of sqrt(2), and the step before it did not fit.
    const float steps = 2.0f * std::log2(counts.degradeDivisor);
    EXPECT_NEAR(steps, std::round(steps), 1e-4f);
    for (size_t i = 0; i < frame.requests.size(); ++i)
        EXPECT_EQ(tight.view().maps[i].faceTexels,
                  std::max(1u, uint32_t(double(frame.requests[i].faceTexels) /
                                        std::pow(2.0, std::round(steps) / 2))));
    frame.build(tight); // and back
    EXPECT_EQ(depthsOf(tight), depthsOf(roomy));
}

TEST(ShadowMaps, PageThatFitsNowhereIsDarkAndCountedNeverLit) {
    SmallScene scene; // nothing blocks: all would be lit
    const Frame frame(6, 10);
    ShadowMaps maps(Backend::kCpu);
    StageTimes stages;
    ShadowMapOptions options = freshMaps();
    options.poolBytes = 2 * 64 * 64 * 4;
    const BatchSet none = scene.batches();
    maps.build(frame.requests, frame.boxes, frame.receivers, scene.view(), none.view(), options,
               stages);
    EXPECT_EQ(maps.counts().pageCount, 2u);
    EXPECT_GT(maps.counts().pagesRefusedCount, 10u);
    size_t lit = 0, dark = 0;
    for (const MapReceiver& r : frame.receivers) {
        const glm::vec3 p = frame.boxes[r.box].center();
        const glm::vec3 n = glm::normalize(frame.requests[r.map].lightPositionWorld - p);
        ShadowMapTrace trace;
        const uint8_t v = lookupVisibility(maps.view(), r.map, p, n, {}, &trace);
        EXPECT_EQ(v == 255, trace.missingTapCount == 0);
        if (trace.missingTapCount == 9) {
            EXPECT_EQ(v, 0);
        }
        lit += v == 255;
        dark += v == 0;
    }
    EXPECT_GT(dark, lit);
    options.poolBytes = 0;
    maps.build(frame.requests, frame.boxes, frame.receivers, scene.view(), none.view(), options,
               stages);
    EXPECT_EQ(maps.counts().pageCount, 0u);
}

TEST(ShadowMaps, EmptyInputsGiveEmptyMaps) {
    ShadowMaps maps(Backend::kCpu);
    StageTimes stages;
    const SmallScene nothing;
    const BatchSet none = nothing.batches();
    EXPECT_EQ(none.size(), 0u);
    maps.build({}, {}, {}, nothing.view(), none.view(), freshMaps(), stages);
    EXPECT_EQ(maps.counts().pageCount, 0u);
    EXPECT_TRUE(maps.pagesPerMap().empty());
    // A map without receivers gets no page; one without geometry is all lit.
    maps.build({{{0, 0, 0}, 5.0f, 0, 100}, {{0, 1, 0}, 5.0f, 0, 100}}, {wholeBoxOf(5)}, {{0, 1}},
               nothing.view(), none.view(), freshMaps(), stages);
    EXPECT_EQ(maps.pagesPerMap(), (std::vector<uint32_t>{0, 24}));
    EXPECT_EQ(maps.trianglesPerMap(), (std::vector<uint32_t>{0, 0}));
    EXPECT_EQ(lookupVisibility(maps.view(), 1, {1, 2, 3}, {0, -1, 0}, {}), 255);
    EXPECT_EQ(lookupVisibility(maps.view(), 0, {1, 2, 3}, {0, -1, 0}, {}), 0);
    std::vector<std::string> names, expected;
    for (const auto& stage : stages.stagesMs)
        names.push_back(stage.first);
    for (const std::string stage : kShadowMapStages)
        if (stage != "geometry copy") // CUDA only
            expected.push_back(stage);
    EXPECT_EQ(names, expected);
}

TEST(ShadowMaps, SidesOfOneAnd8192TexelsWorkWithEveryPageSide) {
    SmallScene scene;
    scene.addQuad({0, 2, 0}, {1, 0, 0}, {0, 0, 1});
    const Box receiver{{-0.05f, 0, -0.05f}, {0.05f, 0, 0.05f}};
    for (const uint32_t pageTexels : {16u, 256u})
        for (const uint32_t n : {1u, 8192u}) {
            ShadowMapOptions options = freshMaps();
            options.pageTexels = pageTexels;
            const DrawnMap drawn(scene, {0, 4, 0}, 9.0f, n, {receiver}, options);
            ShadowMapTrace trace;
            const uint8_t v =
                lookupVisibility(drawn.maps.view(), 0, {0.01f, 0, 0.02f}, {0, 1, 0}, {}, &trace);
            EXPECT_EQ(trace.missingTapCount, 0u);
            if (n == 1) {
                EXPECT_EQ(drawn.maps.counts().pageCount, 6u);
            } else {
                EXPECT_EQ(v, 0);
                // 0.1 / 4 / 2 of a face and a few texels around it.
                const uint64_t side = (102 + 10) / pageTexels + 2;
                EXPECT_LE(drawn.maps.counts().pageCount, side * side);
            }
        }
}

TEST(ShadowMaps, LayoutGivesEveryMapItsOwnMaskWords) {
    // 65 texels: 2 x 2 pages of 64, 24 entries, one word; 257: 5 x 5 pages, 150 entries, 5 words.
    const MapLayout layout =
        layOutMaps({{{}, 1.0f, 0, 65}, {{}, 1.0f, 1, 257}, {{}, 1.0f, 2, 1}}, 64);
    EXPECT_EQ(layout.maps[0].pageTableStart, 0u);
    EXPECT_EQ(layout.maps[1].pageTableStart, 32u);
    EXPECT_EQ(layout.maps[1].facePages, 5u);
    EXPECT_EQ(layout.maps[2].pageTableStart, 192u);
    EXPECT_EQ(layout.maskWordCount, 7u);
    EXPECT_EQ(layOutMaps({{{}, 1.0f, 0, 257}}, 64, 2.0).maps[0].faceTexels, 128u);
}

TEST(ShadowMaps, LayoutBeyond32BitIndicesIsRefused) {
    // 6 * 128^2 entries a map: 43690 of them are the most below 2^32.
    std::vector<MapRequest> requests(43690, MapRequest{{}, 1.0f, 0, 2048});
    EXPECT_EQ(layOutMaps(requests, 16).maskWordCount, 43690ull * 6 * 128 * 128 / 32);
    requests.push_back(requests.back());
    try {
        layOutMaps(requests, 16);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("exceed 32-bit indices"), std::string::npos);
    }
}

TEST(ShadowMaps, BadInputIsRefusedByName) {
    const Frame frame(1, 10);
    ShadowMaps maps(Backend::kCpu);
    StageTimes stages;
    const auto messageOf = [&](auto change) -> std::string {
        Frame bad = frame;
        ShadowMapOptions options = freshMaps();
        change(bad, options);
        try {
            bad.build(maps, options);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            return error.what();
        }
        return "no error";
    };
    using O = ShadowMapOptions;
    EXPECT_NE(messageOf([](Frame&, O& o) { o.pageTexels = 48; }).find("page side 48"),
              std::string::npos);
    EXPECT_NE(messageOf([](Frame&, O& o) { o.pageTexels = 8; }).find("page side 8"),
              std::string::npos);
    EXPECT_NE(messageOf([](Frame&, O& o) { o.taps = 2; }).find("2 taps"), std::string::npos);
    EXPECT_NE(
        messageOf([](Frame& f, O&) { f.requests[3].faceTexels = 8193; }).find("request 3 has 8193"),
        std::string::npos);
    EXPECT_NE(messageOf([](Frame& f, O&) { f.requests[3].faceTexels = 0; }).find("request 3 has 0"),
              std::string::npos);
    EXPECT_NE(
        messageOf([](Frame& f, O&) { f.requests[2].rangeWorld = 0; }).find("request 2 has range"),
        std::string::npos);
    EXPECT_NE(messageOf([](Frame& f, O&) {
                  f.requests[2].lightPositionWorld.y = NAN;
              }).find("not finite"),
              std::string::npos);
    EXPECT_NE(messageOf([](Frame& f, O&) {
                  f.receivers[1].map = 10;
              }).find("receiver 1 refers to map 10 of 10"),
              std::string::npos);
    EXPECT_NE(messageOf([](Frame& f, O&) { f.receivers[1].box = 60; }).find("box 60 of 60"),
              std::string::npos);
}

} // namespace
} // namespace shadowdag
