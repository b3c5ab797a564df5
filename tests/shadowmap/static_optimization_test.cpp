// SPDX-License-Identifier: Apache-2.0
// Maps that are kept from frame to frame, held against maps drawn from nothing.
#include "shadowmap/cull_pass.h"
#include "shadowmap/page_mask_pass.h"
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace shadowdag {
namespace {

using test::SmallScene;

constexpr uint32_t kInstances = 14;
constexpr float kRoom = 4.0f;

/// A room with things in it, some of which move, stop and move on; lights that do the same, leave
/// and return; a camera whose receivers creep or jump.
class Animation {
public:
    SmallScene scene;
    std::unique_ptr<BatchSet> batches;
    std::vector<MapRequest> requests;
    std::vector<Box> boxes;
    std::vector<MapReceiver> receivers;
    std::vector<uint32_t> moved; ///< batches, of all steps since the last build
    /// How often each happened.
    size_t movedCount = 0, stoppedCount = 0, lightMoveCount = 0, resolutionCount = 0,
           returnCount = 0, jumpCount = 0;

    explicit Animation(uint32_t seed) : rng_(seed) {
        scene.addBox(glm::vec3(-kRoom), glm::vec3(kRoom), 8);
        instances_.assign(scene.triangles.size(), 0);
        for (uint32_t i = 1; i < kInstances; ++i) {
            firstVertex_[i] = uint32_t(scene.positions.size());
            const glm::vec3 c = 0.8f * kRoom * uniform3();
            switch (i % 3) {
            case 0:
                scene.addSphere(c, 0.2f + 0.4f * std::abs(uniform()), 6);
                break;
            case 1:
                scene.addBox(c - 0.5f * glm::abs(uniform3()), c + 0.4f, 3);
                break;
            default:
                for (int k = 0; k < 40; ++k)
                    scene.addTriangle(c + uniform3(), c + uniform3(), c + 0.3f * uniform3());
            }
            instances_.resize(scene.triangles.size(), i);
        }
        firstVertex_[kInstances] = uint32_t(scene.positions.size());
        batches = std::make_unique<BatchSet>(scene.view(), instances_);
        for (uint32_t l = 0; l < 5; ++l)
            lights_.push_back({0.7f * kRoom * uniform3(), 2.0f + 4.0f * std::abs(uniform()),
                               resolution(), true, l == 0});
        for (glm::vec3& station : stations_)
            station = 0.8f * kRoom * uniform3();
        placeReceivers();
    }

    void step() {
        std::vector<uint32_t> movedInstances;
        for (uint32_t i = 1; i < kInstances; ++i) {
            if (chance(8)) {
                isMoving_[i] = !isMoving_[i];
                stoppedCount += !isMoving_[i];
            }
            if (!isMoving_[i])
                continue;
            movedInstances.push_back(i);
            ++movedCount;
            move(i);
        }
        batches->update(scene.view(), movedInstances);
        moved.insert(moved.end(), batches->movedBatches().begin(), batches->movedBatches().end());
        for (Light& light : lights_) {
            if (chance(10))
                light.isMoving = !light.isMoving;
            if (light.isMoving) {
                light.position += 0.1f * uniform3();
                ++lightMoveCount;
            }
            if (chance(12)) {
                light.faceTexels = resolution();
                ++resolutionCount;
            }
            if (chance(6)) {
                light.isPresent = !light.isPresent;
                returnCount += light.isPresent;
            }
        }
        if (chance(10)) {
            eye_ = stations_[rng_() % std::size(stations_)];
            ++jumpCount;
        } else {
            eye_ += 0.05f * uniform3();
        }
        placeReceivers();
    }

private:
    struct Light {
        glm::vec3 position;
        float range;
        uint32_t faceTexels;
        bool isPresent, isMoving;
    };

    float uniform() { return std::uniform_real_distribution<float>(-1.0f, 1.0f)(rng_); }
    glm::vec3 uniform3() {
        const float x = uniform(), y = uniform();
        return {x, y, uniform()};
    }
    bool chance(uint32_t n) { return rng_() % n == 0; }
    uint32_t resolution() {
        constexpr uint32_t kTexels[] = {5, 20, 33, 64, 100, 190, 256};
        return kTexels[rng_() % std::size(kTexels)];
    }
    void move(uint32_t i) {
        // Now and then within the own box, which then stays what it was.
        if (chance(3)) {
            Box box;
            for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v)
                box.add(scene.positions[v]);
            for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v) {
                glm::vec3& p = scene.positions[v];
                if (glm::all(glm::lessThan(box.min, p)) && glm::all(glm::lessThan(p, box.max)))
                    p = box.center() + 0.5f * box.extent() * uniform3();
            }
            return;
        }
        const glm::vec3 by = (chance(4) ? 1.5f : 0.15f) * uniform3();
        for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v)
            scene.positions[v] += by;
    }
    void placeReceivers() {
        requests.clear();
        boxes.clear();
        receivers.clear();
        // A light may ask for several maps, even of one resolution.
        std::vector<std::vector<uint32_t>> maps(lights_.size());
        for (uint32_t l = 0; l < lights_.size(); ++l)
            for (uint32_t octave = 0; octave < 1 + l % 3 && lights_[l].isPresent; ++octave) {
                maps[l].push_back(uint32_t(requests.size()));
                requests.push_back({lights_[l].position, lights_[l].range, l,
                                    octave == 1 ? 64 : lights_[l].faceTexels, octave});
            }
        std::mt19937 around(7);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        for (uint32_t i = 0; i < 30; ++i) {
            const float x = unit(around), y = unit(around), z = unit(around);
            const glm::vec3 c = eye_ + 1.5f * glm::vec3(x, y, z);
            const glm::vec3 e = 0.02f + 0.2f * glm::abs(glm::vec3(z, x, y));
            boxes.push_back({c - e, c + e});
            for (uint32_t l = 0; l < lights_.size(); ++l)
                if (!maps[l].empty() && distanceSquared(boxes[i], lights_[l].position) <
                                            lights_[l].range * lights_[l].range)
                    receivers.push_back({i, maps[l][i % maps[l].size()]});
        }
    }

    std::mt19937 rng_;
    std::vector<uint32_t> instances_; // a triangle
    uint32_t firstVertex_[kInstances + 1] = {};
    bool isMoving_[kInstances] = {};
    std::vector<Light> lights_;
    glm::vec3 stations_[3]; // so that it also returns
    glm::vec3 eye_{0.5f, 0.0f, 0.0f};
};

/// Returns the depth that a texel's receivers need at most, by cell, of all maps.
std::vector<uint32_t> neededDepths(const Animation& a, const ShadowMapView& view,
                                   const ShadowMapOptions& options) {
    const size_t maps = view.maps.count;
    Buffer<uint32_t> pages(Backend::kCpu, "pages", (view.pageTable.count + 31) / 32),
        projection(Backend::kCpu, "projection", maps * kProjectionWordsPerMap),
        faces(Backend::kCpu, "faces", maps), depths(Backend::kCpu, "depths", maps * kFaceCount),
        cells(Backend::kCpu, "cells", maps * kCellsPerMap),
        blocks(Backend::kCpu, "blocks", maps * kBlocksPerMap);
    for (Buffer<uint32_t>* words : {&pages, &projection, &faces, &depths, &cells, &blocks})
        words->fill(0);
    markReceivers(Backend::kCpu, {view.maps, viewOf(a.boxes), viewOf(a.receivers),
                                  PageMaskView{pages.view(), projection.view(), faces.view(),
                                               depths.view(), cells.view(), blocks.view()},
                                  view.pageTexelsLog2, options.taps});
    gatherBlocks(Backend::kCpu, {cells.view(), blocks.view()});
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
Sums play(uint32_t seed, int frames, const ShadowMapOptions& options, int buildEvery = 1) {
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
        }
        a.step();
    }
    EXPECT_GT(a.movedCount * a.stoppedCount * a.lightMoveCount * a.resolutionCount * a.returnCount *
                  a.jumpCount,
              0u);
    return sums;
}

ShadowMapOptions keeping(MapCulling culling) {
    ShadowMapOptions options;
    options.culling = culling;
    options.useStaticOptimization = true;
    options.pageTexels = 16;
    options.poolBytes = 16ull << 20;
    return options;
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
    ShadowMapOptions options = keeping(MapCulling::kCellDepth);
    options.poolBytes = 1200 * 16 * 16 * 4;
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
                different += view.depths[page * 16 * 16 + texel] != depths[page * 16 * 16 + texel];
        ASSERT_EQ(different, 0u);
        EXPECT_EQ(host.counts().triangleDrawCount, device.counts().triangleDrawCount);
        EXPECT_EQ(host.counts().triangleKeptCount, device.counts().triangleKeptCount);
        EXPECT_EQ(host.counts().pagesFreedCount, device.counts().pagesFreedCount);
        a.moved.clear();
        a.step();
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

/// One light that looks along +x at a wall of two batches, instances 0 (left) and 1 (right), and a
/// board before it, instance 2; receivers that lie before or behind the board.
class Wall {
public:
    SmallScene scene;
    ShadowMaps maps{Backend::kCpu};
    ShadowMapOptions options = keeping(MapCulling::kCellDepth);
    glm::vec3 light{0.0f};
    uint32_t faceTexels = 64;
    float boardX = 5.0f;
    bool isFar = true; ///< the receivers: at x = 8, behind the board, or at x = 2

    Wall() {
        for (const float side : {-1.0f, 1.0f})
            scene.addQuad({12, 0, 1.5f * side}, {0, 3, 0}, {0, 0, 1.5f}, 2);
        scene.addQuad({boardX, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.5f}, 2);
        std::vector<uint32_t> instances;
        for (uint32_t i = 0; i < 24; ++i)
            instances.push_back(i / 8);
        batches_ = std::make_unique<BatchSet>(scene.view(), instances);
    }
    void moveBoard(float toX) {
        for (size_t v = scene.positions.size() - 9; v < scene.positions.size(); ++v)
            scene.positions[v].x = toX;
        boardX = toX;
        batches_->update(scene.view(), {2});
        moved_ = batches_->movedBatches();
    }
    /// A frame that looks at nothing.
    void buildNothing() {
        StageTimes stages;
        maps.build({}, {}, {}, scene.view(), batches_->view(), options, stages, viewOf(moved_));
        moved_.clear();
    }
    const ShadowMapCounts& build() {
        Box box;
        const float x = isFar ? 8.0f : 2.0f;
        box.add(glm::vec3(x - 0.1f, -0.1f, -0.1f));
        box.add(glm::vec3(x, 0.1f, 0.1f));
        StageTimes stages;
        maps.build({{light, 20.0f, 0, faceTexels}}, {box}, {{0, 0}}, scene.view(), batches_->view(),
                   options, stages, viewOf(moved_));
        moved_.clear();
        // What stands before the receiver darkens it, and nothing else does.
        const uint8_t v = lookupVisibility(maps.view(), 0, {x - 0.05f, 0, 0}, {-1, 0, 0}, {});
        EXPECT_EQ(v, boardX < x ? 0 : 255);
        return maps.counts();
    }

private:
    std::unique_ptr<BatchSet> batches_;
    std::vector<uint32_t> moved_;
};

// The switch moves triangleDrawCount: to nothing when nothing changed, and by what was kept.
TEST(StaticOptimization, WhatStandsStillIsDrawnOnce) {
    Wall wall;
    const ShadowMapCounts first = wall.build();
    EXPECT_EQ(first.triangleDrawCount, 8u); // the board: the wall is behind the receivers
    EXPECT_EQ(first.triangleKeptCount, 0u);
    const ShadowMapCounts second = wall.build();
    EXPECT_EQ(second.triangleDrawCount, 0u);
    EXPECT_EQ(second.batchFaceCount, 0u);
    EXPECT_EQ(second.triangleKeptCount, 8u);
    EXPECT_EQ(second.batchFaceKeptCount, 1u);
    EXPECT_EQ(second.keptMapCount, 1u);
    EXPECT_EQ(second.pagesCommittedCount + second.pagesClearedCount + second.pagesFreedCount, 0u);
    EXPECT_EQ(second.pageCount, first.pageCount);
    wall.options.useStaticOptimization = false;
    const ShadowMapCounts without = wall.build();
    EXPECT_EQ(without.triangleDrawCount, 8u);
    EXPECT_EQ(without.triangleKeptCount, 0u);
    EXPECT_EQ(without.pagesCommittedCount, without.pageCount);
    EXPECT_EQ(without.pagesFreedCount, second.pageCount);
}

TEST(StaticOptimization, ForgettingALightThatMovedOrAnotherResolutionDrawsAnew) {
    Wall wall;
    wall.build();
    wall.maps.forget();
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    wall.light.y = 0.01f;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    EXPECT_EQ(wall.maps.counts().keptMapCount, 0u);
    wall.faceTexels = 100;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    EXPECT_GT(wall.maps.counts().pagesRetainedCount, 0u); // of the map of 64 texels
    wall.faceTexels = 64;                                 // which is still there
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    EXPECT_EQ(wall.maps.counts().keptMapCount, 1u);
    wall.options.retainsPages = false;
    wall.build();
    wall.faceTexels = 100;
    wall.build();
    EXPECT_EQ(wall.maps.counts().pagesRetainedCount, 0u);
    wall.faceTexels = 64;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
}

TEST(StaticOptimization, BoardThatMovesIsDrawnEveryFrameAndOnceMoreWhenItsOldPlaceIsCleared) {
    Wall wall;
    wall.build();
    for (const float x : {5.5f, 6.0f, 6.5f, 10.0f, 5.0f}) {
        wall.moveBoard(x);
        const ShadowMapCounts counts = wall.build();
        EXPECT_EQ(counts.triangleDrawCount, x < 8.0f ? 8u : 0u);
        EXPECT_EQ(counts.pagesCommittedCount, 0u);
        // Where it stood behind the receivers it was not drawn: nothing to clear.
        EXPECT_EQ(counts.pagesClearedCount, x == 5.0f ? 0u : counts.pageCount) << x;
    }
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
}

// Depth 5 was drawn when the board stood elsewhere; it came where nobody looked, and stopped.
TEST(StaticOptimization, BoardThatStoppedWhereNobodyLookedIsDrawnWhenSomebodyLooksAgain) {
    Wall wall;
    wall.moveBoard(10.0f);
    wall.build();
    wall.isFar = false;
    wall.build();
    wall.moveBoard(5.0f);
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    wall.isFar = true;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
}

// The same when no map at all is asked for while it moves.
TEST(StaticOptimization, BoardThatMovedWhileNoMapWasAskedForIsDrawn) {
    Wall wall;
    wall.moveBoard(10.0f);
    wall.build();
    wall.moveBoard(5.0f);
    wall.buildNothing();
    wall.build(); // expects darkness behind the board
}

TEST(StaticOptimization, BatchThatIsNotThereIsRefused) {
    Wall wall;
    StageTimes stages;
    const std::vector<uint32_t> moved{1};
    const SmallScene nothing;
    const BatchSet none = nothing.batches();
    try {
        wall.maps.build({}, {}, {}, nothing.view(), none.view(), wall.options, stages,
                        viewOf(moved));
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(error.what()).find("moved batch 1 of 0"), std::string::npos);
    }
}

TEST(StaticOptimization, SoDoesItWhenSeveralStepsPassBetweenTwoBuilds) {
    for (const uint32_t seed : {41u, 42u, 43u})
        play(seed, 120, keeping(MapCulling::kCellDepth), 3);
}

} // namespace
} // namespace shadowdag
