// SPDX-License-Identifier: Apache-2.0
// Maps that are kept from frame to frame over animations, compared with maps drawn from the
// beginning.
#include "cuda/pass.h"
#include "shadowmap/cull.h"
#include "shadowmap/page_mask.h"
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/kept_maps.h"

#include <gtest/gtest.h>

#include <string>

namespace shadowdag {
namespace {

using test::Animation;
using test::keeping;

/// Returns the depth that a texel's receivers need at most, by cell, of all maps.
std::vector<uint32_t> neededDepths(const Animation& a, const ShadowMapView& view,
                                   const ShadowMapOptions& options) {
    const size_t maps = view.maps.count;
    Buffer<uint32_t> projection(Backend::kCpu, "projection", maps * kProjectionWordsPerMap),
        faces(Backend::kCpu, "faces", maps), depths(Backend::kCpu, "depths", maps * kFaceCount),
        cells(Backend::kCpu, "cells", maps * kCellsPerMap),
        blocks(Backend::kCpu, "blocks", maps * kBlocksPerMap);
    for (Buffer<uint32_t>* words : {&projection, &faces, &depths, &cells, &blocks})
        words->fill(0);
    runPass(Backend::kCpu,
            MarkReceiver{
                {view.maps, viewOf(a.boxes), viewOf(a.receivers), options.taps},
                {projection.view(), faces.view(), depths.view(), cells.view(), blocks.view()}});
    runPass(Backend::kCpu, GatherBlock{cells.view(), blocks.view()});
    return cells.download();
}

/// Returns how many texels with memory in `expected` differ in `found` where receivers may tell:
/// one of both lies before the depth that the cell needs.
size_t countDifferent(const ShadowMapView& expected, const ShadowMapView& found,
                      const std::vector<uint32_t>& needed, size_t& compared) {
    size_t different = 0;
    for (uint32_t m = 0; m < expected.maps.count; ++m) {
        const ShadowMapInfo& map = expected.maps[m];
        EXPECT_EQ(found.maps[m], map);
        const uint32_t n = map.faceTexels;
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (uint32_t y = 0; y < n; ++y)
                for (uint32_t x = 0; x < n; ++x) {
                    const uint32_t a = depthAt(expected, map, {face, x, y});
                    const uint32_t b = depthAt(found, map, {face, x, y});
                    if (a == kNoPage)
                        continue;
                    const uint32_t cell = needed[cellIndex(
                        m, face, faceCell(faceCellCentre(int32_t(x), n), kProjectionMapSize),
                        faceCell(faceCellCentre(int32_t(y), n), kProjectionMapSize))];
                    const auto matters = [&](uint32_t bits) {
                        return bits != 0 && depthBits(1.0f / bitsFloat(bits)) <= cell;
                    };
                    ++compared;
                    different += a != b && (b == kNoPage || matters(a) || matters(b));
                }
    }
    return different;
}

size_t countDifferentAnswers(const Animation& a, const ShadowMapView& expected,
                             const ShadowMapView& found, std::mt19937& rng) {
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    size_t different = 0;
    for (const MapReceiver& r : a.receivers)
        for (int i = 0; i < 4; ++i) {
            const Box& box = a.boxes[r.box];
            const float x = unit(rng), y = unit(rng);
            const glm::vec3 p = box.min + box.extent() * glm::vec3(x, y, unit(rng));
            const glm::vec3 n = test::randomDirection(rng);
            const glm::vec3 d = p - a.requests[r.map].lightPositionWorld;
            const glm::vec3 normal = glm::dot(n, d) > 0.0f ? -n : n;
            different += lookupVisibility(expected, r.map, p, normal, {}) !=
                         lookupVisibility(found, r.map, p, normal, {});
        }
    return different;
}

/// What an animation summed up.
struct Sums {
    uint64_t keptTriangles = 0, drawnTriangles = 0, committed = 0, freed = 0, retained = 0,
             cleared = 0, keptMaps = 0, degraded = 0, compared = 0;

    void add(const Sums& s) {
        keptTriangles += s.keptTriangles;
        drawnTriangles += s.drawnTriangles;
        committed += s.committed;
        freed += s.freed;
        retained += s.retained;
        cleared += s.cleared;
        keptMaps += s.keptMaps;
        degraded += s.degraded;
        compared += s.compared;
    }
};

/// Plays an animation and holds every frame against one drawn from nothing without any culling.
/// @param forgetEvery after so many frames all maps are forgotten; 0: never
Sums play(uint32_t seed, int frames, const ShadowMapOptions& options, int buildEvery = 1,
          int forgetEvery = 0) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " culling " +
                 std::to_string(int(options.culling)) +
                 (options.retainsPages ? " retaining" : " freeing at once"));
    Animation a(seed);
    std::mt19937 rng(seed);
    ShadowMaps kept(Backend::kCpu);
    Sums sums;
    uint64_t held = 0;
    for (int frame = 0; frame < frames; ++frame) {
        SCOPED_TRACE("frame " + std::to_string(frame));
        if (frame % buildEvery == 0) {
            StageTimes stages;
            kept.build(a.requests, a.boxes, a.receivers, a.scene.view(), a.batches->view(), options,
                       stages, viewOf(a.moved));
            a.moved.clear();
            ShadowMapOptions nothing = options;
            nothing.culling = MapCulling::kSphere;
            nothing.useStaticOptimization = false;
            ShadowMaps drawn(Backend::kCpu);
            drawn.build(a.requests, a.boxes, a.receivers, a.scene.view(), a.batches->view(),
                        nothing, stages);
            kept.countSkipped();
            const ShadowMapCounts& counts = kept.counts();
            const std::vector<uint32_t> needed = neededDepths(a, drawn.view(), options);
            const size_t different =
                countDifferent(drawn.view(), kept.view(), needed, sums.compared) +
                countDifferentAnswers(a, drawn.view(), kept.view(), rng);
            EXPECT_EQ(different, 0u);
            if (different)
                return sums;
            EXPECT_EQ(counts.pageCount, drawn.counts().pageCount);
            EXPECT_EQ(counts.degradeDivisor, drawn.counts().degradeDivisor);
            EXPECT_EQ(counts.pagesWantedCount, drawn.counts().pagesWantedCount);
            EXPECT_EQ(counts.batchFaceSphereCount, drawn.counts().batchFaceSphereCount);
            EXPECT_EQ(counts.pageCount + counts.pagesRetainedCount,
                      held + counts.pagesCommittedCount - counts.pagesFreedCount);
            EXPECT_LE((counts.pageCount + counts.pagesRetainedCount) * options.pageTexels *
                          options.pageTexels * 4,
                      options.poolBytes);
            held = counts.pageCount + counts.pagesRetainedCount;
            sums.keptTriangles += counts.triangleKeptCount;
            sums.drawnTriangles += counts.triangleDrawCount;
            sums.committed += counts.pagesCommittedCount;
            sums.freed += counts.pagesFreedCount;
            sums.retained += counts.pagesRetainedCount;
            sums.cleared += counts.pagesClearedCount;
            sums.keptMaps += counts.keptMapCount;
            sums.degraded += counts.degradeDivisor > 1.0f;
            if (forgetEvery > 0 && frame % forgetEvery == forgetEvery - 1) {
                kept.forget();
                held = 0;
            }
        }
        a.step();
    }
    EXPECT_GT(a.movedCount * a.stoppedCount * a.lightMoveCount * a.resolutionCount * a.returnCount *
                  a.jumpCount,
              0u);
    return sums;
}

TEST(StaticOptimization, EveryFrameEqualsOneDrawnFromNothingOverAllTransitions) {
    Sums all;
    for (const uint32_t seed : {1u, 2u, 3u, 4u, 5u, 6u})
        all.add(play(seed, 60, keeping(MapCulling::kCellDepth)));
    EXPECT_GT(all.keptTriangles, all.drawnTriangles / 20);
    EXPECT_GT(all.cleared, all.committed + all.committed / 10); // what moved over needed pages
    EXPECT_GT(all.retained, all.committed);
    EXPECT_GT(all.freed, 0u);
    EXPECT_GT(all.keptMaps, 6 * 60u);
    EXPECT_EQ(all.degraded, 0u);
    EXPECT_GT(all.compared, 5000000u);
}

TEST(StaticOptimization, SoDoesItWithEveryKindOfCulling) {
    for (const MapCulling culling : {MapCulling::kSphere, MapCulling::kFaceMask,
                                     MapCulling::kProjectionMap, MapCulling::kMaximumDepth}) {
        Sums all;
        for (const uint32_t seed : {11u, 12u})
            all.add(play(seed, 60, keeping(culling)));
        EXPECT_GT(all.keptTriangles, all.drawnTriangles / 10);
    }
}

TEST(StaticOptimization, SoDoesItWhenPagesAreFreedAtOnce) {
    ShadowMapOptions options = keeping(MapCulling::kCellDepth);
    options.retainsPages = false;
    Sums all;
    for (const uint32_t seed : {21u, 22u, 23u})
        all.add(play(seed, 60, options));
    EXPECT_EQ(all.retained, 0u);
    EXPECT_GT(all.keptTriangles, all.drawnTriangles / 20);
}

TEST(StaticOptimization, SoDoesItWhenThePoolIsTooSmallToRetainAllOrEvenToHoldAll) {
    for (const uint32_t pages : {1200u, 300u, 40u}) {
        ShadowMapOptions options = keeping(MapCulling::kCellDepth);
        options.poolBytes = pages * 16 * 16 * 4;
        Sums all;
        for (const uint32_t seed : {31u, 32u, 33u})
            all.add(play(seed, 60, options));
        EXPECT_GT(all.retained, 0u);
        EXPECT_GT(all.freed, 0u);
        if (pages < 1200) {
            EXPECT_GT(all.degraded, 10u);
        }
    }
}

// What is forgotten leaves texels, keys and stamps in memory that later frames use again.
TEST(StaticOptimization, SoDoesItInMemoryOfMapsThatWereForgotten) {
    for (const bool retains : {true, false}) {
        ShadowMapOptions options = keeping(MapCulling::kCellDepth);
        options.retainsPages = retains;
        Sums all;
        for (const uint32_t seed : {61u, 62u, 63u})
            all.add(play(seed, 60, options, 1, 7));
        EXPECT_GT(all.keptTriangles, 0u);
        EXPECT_GT(all.committed, 0u);
    }
}

TEST(StaticOptimization, CudaGivesTheBitsOfTheCpu) {
    try {
        chooseBackend("cuda");
    } catch (const Error& error) {
        GTEST_SKIP() << error.what();
    }
    const auto downloaded = [](View<const uint32_t> words) {
        std::vector<uint32_t> copy(words.count);
        detail::copyBytes(Backend::kCpu, copy.data(), Backend::kCuda, words.data,
                          words.count * sizeof(uint32_t));
        return copy;
    };
    for (const bool retains : {true, false}) {
        SCOPED_TRACE(retains ? "retaining" : "freeing at once");
        ShadowMapOptions options = keeping(MapCulling::kCellDepth);
        options.poolBytes = 1200 * 16 * 16 * 4;
        options.retainsPages = retains;
        Animation a(51);
        ShadowMaps host(Backend::kCpu), device(Backend::kCuda);
        for (int frame = 0; frame < 40; ++frame) {
            SCOPED_TRACE("frame " + std::to_string(frame));
            StageTimes stages;
            for (ShadowMaps* maps : {&host, &device})
                maps->build(a.requests, a.boxes, a.receivers, a.scene.view(), a.batches->view(),
                            options, stages, viewOf(a.moved));
            const ShadowMapView view = host.view();
            // The page table of all maps, kept ones too; the pool is as large on both.
            ASSERT_EQ(std::vector<uint32_t>(view.pageTable.begin(), view.pageTable.end()),
                      downloaded(device.view().pageTable));
            const std::vector<uint32_t> depths = downloaded(device.view().depths);
            size_t different = 0;
            for (const uint32_t page : view.pageTable)
                for (size_t texel = 0; page != kNoPage && texel < 16 * 16; ++texel)
                    different +=
                        view.depths[page * 16 * 16 + texel] != depths[page * 16 * 16 + texel];
            ASSERT_EQ(different, 0u);
            for (ShadowMaps* maps : {&host, &device})
                if (frame % 8 == 7) // the device's counts are not fetched yet
                    maps->forget();
                else
                    maps->countSkipped();
            const ShadowMapCounts &expected = host.counts(), &counts = device.counts();
            EXPECT_EQ(expected.triangleDrawCount, counts.triangleDrawCount);
            EXPECT_EQ(expected.triangleKeptCount, counts.triangleKeptCount);
            EXPECT_EQ(expected.pagesCommittedCount, counts.pagesCommittedCount);
            EXPECT_EQ(expected.pagesFreedCount, counts.pagesFreedCount);
            a.moved.clear();
            a.step();
        }
    }
}

TEST(StaticOptimization, SameBitsForOneAndTwoThreads) {
    std::vector<uint32_t> tables[2], depths[2];
    for (const int threads : {1, 2}) {
        setThreadCount(threads);
        Animation a(52);
        ShadowMaps maps(Backend::kCpu);
        ShadowMapOptions options = keeping(MapCulling::kCellDepth);
        options.poolBytes = 1200 * 16 * 16 * 4;
        for (int frame = 0; frame < 30; ++frame) {
            StageTimes stages;
            maps.build(a.requests, a.boxes, a.receivers, a.scene.view(), a.batches->view(), options,
                       stages, viewOf(a.moved));
            const ShadowMapView view = maps.view();
            tables[threads - 1].insert(tables[threads - 1].end(), view.pageTable.begin(),
                                       view.pageTable.end());
            for (const uint32_t page : view.pageTable)
                if (page != kNoPage)
                    depths[threads - 1].insert(depths[threads - 1].end(),
                                               view.depths.data + page * 16 * 16,
                                               view.depths.data + (page + 1) * 16 * 16);
            a.moved.clear();
            a.step();
        }
    }
    setThreadCount(0);
    EXPECT_EQ(tables[0], tables[1]);
    EXPECT_TRUE(depths[0] == depths[1]);
    EXPECT_GT(depths[0].size(), 1000000u);
}

TEST(StaticOptimization, SoDoesItWhenSeveralStepsPassBetweenTwoBuilds) {
    for (const uint32_t seed : {41u, 42u, 43u})
        play(seed, 120, keeping(MapCulling::kCellDepth), 3);
}

} // namespace
} // namespace shadowdag
