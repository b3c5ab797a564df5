// SPDX-License-Identifier: Apache-2.0
#include "scenes/batches.h"

#include "cuda/backend.h"
#include "cuda/cancel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <stdexcept>

namespace shadowdag {
namespace {

struct Triangles {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<uint32_t> instances;

    TriangleView view() const { return {viewOf(positions), viewOf(triangles)}; }
};

/// A height field of n x n cells: an instance a quadrant.
Triangles heightField(uint32_t n) {
    Triangles t;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i)
            t.positions.push_back({float(i), float((i * 7 + j * 13) % 5) * 0.1f, float(j)});
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t p = j * (n + 1) + i;
            t.triangles.push_back({p, p + 1, p + n + 2});
            t.triangles.push_back({p, p + n + 2, p + n + 1});
            const uint32_t instance = (i < n / 2 ? 0 : 1) + (j < n / 2 ? 0 : 2);
            t.instances.insert(t.instances.end(), {instance, instance});
        }
    return t;
}

Box boxOf(const Triangles& t, const BatchView& view, const Batch& batch) {
    Box box;
    for (uint32_t i = 0; i < batch.count; ++i)
        for (int corner = 0; corner < 3; ++corner)
            box.add(t.view().vertex(view.triangles[batch.first + i], corner));
    return box;
}

/// A batch's own vertices give its triangles, and each of them once.
void expectVertices(const Triangles& t, const BatchView& view, size_t b) {
    const Batch& batch = view.batches[b];
    const uint32_t first = view.vertices.first[b];
    std::vector<uint32_t> vertexOf(view.vertices.count(b), 0xffffffffu); // of the geometry
    for (uint32_t i = batch.first; i < batch.first + batch.count; ++i)
        for (int corner = 0; corner < 3; ++corner) {
            const uint32_t own = view.vertices.corners[i].of[corner];
            const uint32_t vertex = t.triangles[view.triangles[i]][corner];
            ASSERT_LT(own, vertexOf.size());
            ASSERT_TRUE(vertexOf[own] == 0xffffffffu || vertexOf[own] == vertex);
            vertexOf[own] = vertex;
            ASSERT_EQ(view.vertices.positions[first + own], t.positions[vertex]);
        }
    std::sort(vertexOf.begin(), vertexOf.end());
    ASSERT_TRUE(std::adjacent_find(vertexOf.begin(), vertexOf.end()) == vertexOf.end());
    ASSERT_TRUE(vertexOf.empty() || vertexOf.back() != 0xffffffffu);
}

void expectPartition(const Triangles& t, const BatchSet& set) {
    const BatchView view = set.view();
    std::vector<int> seen(t.triangles.size(), 0);
    uint32_t next = 0;
    for (size_t b = 0; b < view.batches.count; ++b) {
        const Batch& batch = view.batches[b];
        ASSERT_EQ(batch.first, next);
        ASSERT_GE(batch.count, 1u);
        ASSERT_LE(batch.count, view.maxTriangleCount);
        next += batch.count;
        for (uint32_t i = 0; i < batch.count; ++i) {
            ++seen[view.triangles[batch.first + i]];
            ASSERT_EQ(t.instances[view.triangles[batch.first + i]], batch.instance);
        }
        ASSERT_TRUE(boxOf(t, view, batch) == view.boxesWorld[b]);
        expectVertices(t, view, b);
    }
    ASSERT_EQ(next, t.triangles.size());
    for (const int count : seen)
        ASSERT_EQ(count, 1);
}

TEST(BatchSet, EveryTriangleIsInOneBatchOfItsInstance) {
    const Triangles t = heightField(64);
    const BatchSet set(t.view(), t.instances);
    expectPartition(t, set);
    // A regular grid of 8192 triangles fills at least half of each batch.
    EXPECT_LE(set.size(), 2 * 8192 / set.view().maxTriangleCount);
}

TEST(BatchSet, RandomTrianglesAndCoincidentOnesArePartitioned) {
    for (const uint32_t seed : {1u, 2u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 rng(seed);
        std::normal_distribution<float> normal;
        Triangles t;
        for (uint32_t i = 0; i < 5000; ++i) {
            const glm::vec3 c = i % 4 == 0
                                    ? glm::vec3(1.0f)
                                    : 5.0f * glm::vec3(normal(rng), normal(rng), normal(rng));
            for (int k = 0; k < 3; ++k)
                t.positions.push_back(c + (seed == 2 ? 0.0f : 0.1f) *
                                              glm::vec3(normal(rng), normal(rng), normal(rng)));
            t.triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(0, 1, 2));
            t.instances.push_back(uint32_t(rng() % 3));
        }
        expectPartition(t, BatchSet(t.view(), t.instances));
    }
}

TEST(BatchSet, BatchesAreCompact) {
    // 128 triangles are 64 cells: a square of 8 x 8, diagonal 11.3. A strip of one row would
    // have 64.
    const Triangles t = heightField(128);
    const BatchSet set(t.view(), t.instances);
    double sum = 0;
    for (const Box& box : set.view().boxesWorld)
        sum += glm::length(box.extent());
    EXPECT_LT(sum / double(set.size()), 1.3 * 11.4);
}

// Of equal boxes each cluster prefers the one before it; of growing ones, too.
TEST(BatchSet, ChainsOfPreferenceTakeFewRounds) {
    constexpr uint32_t kCount = 20'000;
    static std::atomic<size_t> pollCount;
    for (const bool isPile : {true, false})
        for (const BatchCut cut : {BatchCut::kFull, BatchCut::kSubtree}) {
            SCOPED_TRACE(isPile);
            Triangles t;
            for (uint32_t i = 0; i < kCount; ++i) {
                // Exact in floats: 2^-20 apart, or distances that grow.
                const float at = float(i) * 0x1p-20f, size = isPile ? 6.0f : 1.0f + 8.0f * at;
                t.positions.insert(t.positions.end(), {{at, at, 0}, {size, at, 1}, {at, size, 3}});
                t.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
                t.instances.push_back(0);
            }
            pollCount = 0;
            setCpuPoll([](double) { ++pollCount; });
            BatchOptions options;
            options.cut = cut;
            const BatchSet set(t.view(), t.instances, options);
            setCpuPoll(nullptr);
            expectPartition(t, set);
            // A round polls once in 1024 clusters: fewer than 50 rounds of all of them.
            EXPECT_LT(pollCount, 50u * (kCount / 1024 + 1));
            if (cut == BatchCut::kFull) {
                EXPECT_LT(set.view().batches.count, kCount / 64);
            }
        }
}

TEST(BatchSet, SameForOneAndTwoThreads) {
    const Triangles t = heightField(100);
    setThreadCount(1);
    const BatchSet one(t.view(), t.instances);
    setThreadCount(2);
    const BatchSet two(t.view(), t.instances);
    setThreadCount(0);
    ASSERT_EQ(one.size(), two.size());
    for (size_t i = 0; i < t.triangles.size(); ++i)
        ASSERT_EQ(one.view().triangles[i], two.view().triangles[i]);
    for (size_t i = 0; i < one.size(); ++i)
        ASSERT_TRUE(one.view().boxesWorld[i] == two.view().boxesWorld[i]);
}

TEST(BatchSet, UpdateRecomputesTheBoxesOfMovedInstancesOnly) {
    Triangles t = heightField(40);
    BatchSet set(t.view(), t.instances);
    const std::vector<Box> before(set.view().boxesWorld.begin(), set.view().boxesWorld.end());
    // Corners of instance 2 move; those shared with others are left alone by update unless it is
    // told.
    for (size_t i = 0; i < t.triangles.size(); ++i)
        if (t.instances[i] == 2)
            for (int corner = 0; corner < 3; ++corner)
                t.positions[t.triangles[i][corner]].y += 0.25f;
    set.update(t.view(), {2});
    for (size_t b = 0; b < set.size(); ++b) {
        const Batch& batch = set.view().batches[b];
        if (batch.instance == 2) {
            EXPECT_TRUE(boxOf(t, set.view(), batch) == set.view().boxesWorld[b]);
            expectVertices(t, set.view(), b);
        } else {
            EXPECT_TRUE(before[b] == set.view().boxesWorld[b]);
        }
    }
    Box all;
    for (const Box& box : set.view().boxesWorld)
        all.add(box);
    const WideBvhView bvh = set.view().bvh;
    Box top;
    for (uint32_t i = bvh.levelStart[bvh.levelCount - 1]; i < bvh.levelStart[bvh.levelCount]; ++i)
        top.add(bvh.boxes[i]);
    EXPECT_TRUE(top == all);
}

TEST(BatchSet, MovedBatchesAreThoseWhoseCornersChangedWithTheirBoxesBefore) {
    Triangles t = heightField(40);
    BatchSet set(t.view(), t.instances, {}, {0, 1, 0, 1});
    const auto batchesOf = [&](std::initializer_list<uint32_t> instances) {
        std::vector<uint32_t> found;
        for (uint32_t b = 0; b < set.size(); ++b)
            if (std::count(instances.begin(), instances.end(), set.view().batches[b].instance))
                found.push_back(b);
        return found;
    };
    set.update(t.view(), {3, 1});
    EXPECT_TRUE(set.movedBatches().empty()); // named, but at rest
    EXPECT_TRUE(set.movedBoxesBefore().empty());

    // A corner that one batch of instance 3 has alone: the last of the grid.
    const auto last = uint32_t(t.positions.size() - 1);
    std::vector<uint32_t> having;
    for (const uint32_t b : batchesOf({3})) {
        const Batch& of = set.view().batches[b];
        for (uint32_t i = of.first; i < of.first + of.count; ++i)
            for (int corner = 0; corner < 3; ++corner)
                if (t.triangles[set.view().triangles[i]][corner] == last &&
                    (having.empty() || having.back() != b))
                    having.push_back(b);
    }
    ASSERT_EQ(having.size(), 1u);
    const uint32_t batch = having[0];
    const Box before = set.view().boxesWorld[batch];
    t.positions[last].y += 50.0f;
    set.update(t.view(), {1, 3});
    EXPECT_EQ(set.movedBatches(), std::vector<uint32_t>{batch});
    EXPECT_EQ(set.updateCounts().comparedBatchCount, batchesOf({1, 3}).size());
    EXPECT_EQ(set.updateCounts().boxCount, 1u);
    EXPECT_LE(set.updateCounts().hierarchy.sortedKeyCount, batchesOf({1, 3}).size());
    ASSERT_EQ(set.movedBoxesBefore().size(), 1u);
    EXPECT_TRUE(set.movedBoxesBefore()[0] == before);
    EXPECT_GE(set.view().boxesWorld[batch].max.y, 50.0f);
    set.update(t.view(), {});
    EXPECT_TRUE(set.movedBatches().empty());
}

// A copy that follows only the ranges is the view, whatever moves: few batches or many, within the
// grid of the movers' codes or out of it, and instances that never moved before.
TEST(BatchSet, MovedRangesHoldEverythingThatAnUpdateChanged) {
    Triangles t = heightField(40);
    BatchSet set(t.view(), t.instances, {8}, {0, 1, 1, 0});
    std::vector<Box> boxes, bvhBoxes;
    std::vector<uint32_t> items;
    const auto follow = [](auto& copy, const auto& view, const std::vector<ArrayRange>& ranges) {
        if (copy.size() != view.count)
            copy.assign(view.begin(), view.end());
        size_t next = 0, copied = 0;
        for (const ArrayRange& range : ranges) {
            EXPECT_LE(next, range.first);
            next = range.first + range.count;
            ASSERT_LE(next, view.count);
            std::copy_n(view.begin() + range.first, range.count, copy.begin() + range.first);
            copied += range.count;
        }
        for (size_t i = 0; i < view.count; ++i)
            ASSERT_TRUE(copy[i] == view[i])
                << i << " of " << view.count << ", " << copied << " copied";
    };
    const auto followAll = [&] {
        const MovedBatchRanges ranges = set.movedRanges();
        follow(boxes, set.view().boxesWorld, ranges.boxes);
        follow(bvhBoxes, set.view().bvh.boxes, ranges.bvhBoxes);
        follow(items, set.view().bvh.items, ranges.bvhItems);
        return ranges;
    };
    followAll();
    std::mt19937 random(7);
    for (int round = 0; round < 40; ++round) {
        SCOPED_TRACE("seed 7, round " + std::to_string(round));
        const uint32_t instance = round < 30 ? 1 + random() % 2 : random() % 4;
        const float reach = round % 7 == 6 ? 500.0f : 3.0f;
        for (size_t i = 0; i < t.triangles.size(); ++i)
            if (t.instances[i] == instance && random() % 4 == 0)
                t.positions[t.triangles[i][int(random() % 3)]] +=
                    glm::vec3(float(random() % 100) * 0.01f * reach, 0.0f,
                              float(random() % 100) * 0.01f * reach);
        set.update(t.view(), {0, 1, 2, 3}); // corners are shared between instances
        const MovedBatchRanges ranges = followAll();
        size_t copied = 0;
        for (const ArrayRange& range : ranges.boxes)
            copied += range.count;
        EXPECT_EQ(copied, set.movedBatches().size());
        if (testing::Test::HasFatalFailure())
            return;
    }
    set.update(t.view(), {0, 1, 2, 3});
    EXPECT_TRUE(set.movedRanges().boxes.empty());
    EXPECT_TRUE(set.movedRanges().bvhBoxes.empty());
}

TEST(BatchSet, ACancelledUpdateLosesNoMove) {
    Triangles t = heightField(40);
    BatchSet set(t.view(), t.instances, {8});
    const std::vector<uint32_t> all{0, 1, 2, 3};
    set.update(t.view(), all);
    for (glm::vec3& position : t.positions)
        position.y += 50.0f;
    static std::atomic<int> calls;
    calls = 0;
    setCpuPoll([](double) {
        if (++calls > 1)
            throw std::runtime_error("enough");
    });
    EXPECT_THROW(set.update(t.view(), all), std::runtime_error);
    setCpuPoll(nullptr);
    set.update(t.view(), all);
    EXPECT_EQ(set.movedBatches().size(), set.updateCounts().comparedBatchCount);
    EXPECT_GT(set.movedBatches().size(), 32u);
    for (size_t b = 0; b < set.size(); ++b)
        expectVertices(t, set.view(), b);
}

/// Small triangles at these points, one instance.
Triangles trianglesAt(const std::vector<glm::vec3>& points) {
    Triangles t;
    for (const glm::vec3& p : points) {
        const uint32_t first = uint32_t(t.positions.size());
        t.positions.insert(t.positions.end(), {p, p + glm::vec3(0.01f, 0, 0), p + 0.01f});
        t.triangles.push_back({first, first + 1, first + 2});
        t.instances.push_back(0);
    }
    return t;
}

/// Returns the batches as sorted sets of triangles.
std::vector<std::vector<uint32_t>> contents(const BatchSet& set) {
    std::vector<std::vector<uint32_t>> found;
    for (const Batch& batch : set.view().batches) {
        const uint32_t* const first = &set.view().triangles[batch.first];
        found.emplace_back(first, first + batch.count);
        std::sort(found.back().begin(), found.back().end());
    }
    std::sort(found.begin(), found.end());
    return found;
}

TEST(BatchSet, DissimilarityIsTheDiagonalNotTheSurfaceOfTheUnion) {
    // Diagonals: 0-1 is 10, 0-2 is 3.5, 1-2 is 8.5. The union of 0 and 1 is a needle almost without
    // surface.
    const Triangles t = trianglesAt({{0, 0, 0}, {10, 0, 0}, {2, 2, 2}});
    const BatchSet set(t.view(), t.instances, {2, BatchCut::kFull});
    EXPECT_EQ(contents(set), (std::vector<std::vector<uint32_t>>{{0, 2}, {1}}));
}

TEST(BatchSet, SubtreesAreCutFromTheWholeTreeAndFullBatchesMergeOnlyWhatFits) {
    // The tree joins 0-1 and 2-3 (diagonal 1), both (4; with 4 it would be 5), then all.
    const Triangles t = trianglesAt({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {4, 0, 0}, {8, 0, 0}});
    const auto cut = [&](uint32_t size, BatchCut kind) {
        return contents(BatchSet(t.view(), t.instances, {size, kind}));
    };
    using Sets = std::vector<std::vector<uint32_t>>;
    EXPECT_EQ(cut(3, BatchCut::kSubtree), (Sets{{0, 1}, {2, 3}, {4}}));
    EXPECT_EQ(cut(3, BatchCut::kFull), (Sets{{0, 1}, {2, 3, 4}}));
    EXPECT_EQ(cut(4, BatchCut::kSubtree), (Sets{{0, 1, 2, 3}, {4}}));
    EXPECT_EQ(cut(5, BatchCut::kSubtree), (Sets{{0, 1, 2, 3, 4}}));
    EXPECT_EQ(cut(1, BatchCut::kSubtree).size(), 5u);
}

TEST(BatchSet, EverySizeAndCutIsAPartition) {
    const Triangles t = heightField(48);
    for (const uint32_t size : {1u, 32u, 127u, 512u})
        for (const BatchCut cut : {BatchCut::kFull, BatchCut::kSubtree}) {
            SCOPED_TRACE(size);
            const BatchSet set(t.view(), t.instances, {size, cut});
            EXPECT_EQ(set.view().maxTriangleCount, size);
            expectPartition(t, set);
        }
}

TEST(BatchSet, SizesOutOfBoundsAreRefusedByName) {
    const Triangles t = heightField(2);
    for (const uint32_t size : {0u, 513u}) {
        try {
            BatchSet(t.view(), t.instances, {size});
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_NE(std::string(error.what()).find(std::to_string(size)), std::string::npos);
            EXPECT_NE(std::string(error.what()).find("choose 1 to 512"), std::string::npos);
        }
    }
}

TEST(BatchSet, AnimatedBatchesAreMovedOnlyWhileTheyMove) {
    // Node 1 stands until second 1, moves until 2, stands again; node 0 never moves.
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes.resize(1);
    for (uint32_t i = 0; i < 100; ++i) {
        const glm::vec3 p(float(i), 0, 0);
        scene.meshes[0].positions.insert(scene.meshes[0].positions.end(),
                                         {p, p + glm::vec3(1, 0, 0), p + glm::vec3(0, 1, 0)});
        scene.meshes[0].triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(0, 1, 2));
        scene.meshes[0].triangleMaterial.push_back(0);
    }
    scene.nodes.resize(2);
    scene.nodes[0].mesh = scene.nodes[1].mesh = 0;
    scene.roots = {0, 1};
    scene.animations.resize(1);
    scene.animations[0].channels.resize(1);
    AnimationChannel& channel = scene.animations[0].channels[0];
    channel.node = 1;
    channel.times = {0, 1, 2, 3};
    channel.values = {glm::vec4(0), glm::vec4(0), glm::vec4(0, 5, 0, 0), glm::vec4(0, 5, 0, 0)};

    World world(scene, {});
    BatchSet set(world, {32});
    ASSERT_EQ(set.size() % 2, 0u);
    const uint32_t moverCount = uint32_t(set.size() / 2);
    const auto movedAt = [&](float seconds) {
        set.update(world, world.setTime(seconds));
        for (const uint32_t b : set.movedBatches())
            EXPECT_EQ(set.view().batches[b].instance, 1u);
        EXPECT_EQ(set.updateCounts().comparedBatchCount, moverCount);
        EXPECT_EQ(set.updateCounts().boxCount, set.movedBatches().size());
        return uint32_t(set.movedBatches().size());
    };
    EXPECT_EQ(movedAt(0.5f), 0u);
    EXPECT_EQ(movedAt(1.5f), moverCount);
    EXPECT_EQ(movedAt(2.5f), moverCount);
    EXPECT_EQ(set.movedBoxesBefore()[0].min.y, 2.5f);
    EXPECT_EQ(movedAt(2.75f), 0u);
    EXPECT_EQ(set.updateCounts().hierarchy.boxCount, 0u);
    EXPECT_EQ(movedAt(0.0f), moverCount);
}

TEST(BatchSet, EmptyInputGivesNoBatches) {
    const Triangles t;
    const BatchSet set(t.view(), t.instances);
    EXPECT_EQ(set.size(), 0u);
    EXPECT_EQ(set.view().bvh.levelCount, 0u);
}

} // namespace
} // namespace shadowdag
