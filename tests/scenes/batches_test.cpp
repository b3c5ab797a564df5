// SPDX-License-Identifier: Apache-2.0
#include "scenes/batches.h"

#include "cuda/backend.h"

#include <gtest/gtest.h>

#include <random>

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

void expectPartition(const Triangles& t, const BatchSet& set) {
    const BatchView view = set.view();
    std::vector<int> seen(t.triangles.size(), 0);
    uint32_t next = 0;
    for (size_t b = 0; b < view.batches.count; ++b) {
        const Batch& batch = view.batches[b];
        ASSERT_EQ(batch.first, next);
        ASSERT_GE(batch.count, 1u);
        ASSERT_LE(batch.count, kMaxBatchTriangleCount);
        next += batch.count;
        for (uint32_t i = 0; i < batch.count; ++i) {
            ++seen[view.triangles[batch.first + i]];
            ASSERT_EQ(t.instances[view.triangles[batch.first + i]], batch.instance);
        }
        ASSERT_TRUE(boxOf(t, view, batch) == view.boxesWorld[b]);
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
    EXPECT_LE(set.size(), 2 * 8192 / kMaxBatchTriangleCount);
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
        if (batch.instance == 2)
            EXPECT_TRUE(boxOf(t, set.view(), batch) == set.view().boxesWorld[b]);
        else
            EXPECT_TRUE(before[b] == set.view().boxesWorld[b]);
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
    BatchSet set(t.view(), t.instances);
    const auto batchesOf = [&](std::initializer_list<uint32_t> instances) {
        std::vector<uint32_t> found;
        for (uint32_t b = 0; b < set.size(); ++b)
            if (std::count(instances.begin(), instances.end(), set.view().batches[b].instance))
                found.push_back(b);
        return found;
    };
    set.update(t.view(), {3, 1});
    EXPECT_EQ(set.movedBatches(), batchesOf({1, 3})); // their corners were not known before
    set.update(t.view(), {1, 3});
    EXPECT_TRUE(set.movedBatches().empty()); // named, but at rest
    EXPECT_TRUE(set.movedBoxesBefore().empty());

    // One corner of one triangle of instance 3.
    const uint32_t batch = batchesOf({3}).back();
    const Box before = set.view().boxesWorld[batch];
    const uint32_t triangle = set.view().triangles[set.view().batches[batch].first];
    t.positions.push_back(t.positions[t.triangles[triangle].x] + glm::vec3(0, 50, 0));
    t.triangles[triangle].x = uint32_t(t.positions.size() - 1);
    set.update(t.view(), {1, 3});
    EXPECT_EQ(set.movedBatches(), std::vector<uint32_t>{batch});
    ASSERT_EQ(set.movedBoxesBefore().size(), 1u);
    EXPECT_TRUE(set.movedBoxesBefore()[0] == before);
    EXPECT_GE(set.view().boxesWorld[batch].max.y, 50.0f);
    set.update(t.view(), {});
    EXPECT_TRUE(set.movedBatches().empty());
}

TEST(BatchSet, NothingGivesNothing) {
    const Triangles t;
    const BatchSet set(t.view(), t.instances);
    EXPECT_EQ(set.size(), 0u);
    EXPECT_EQ(set.view().bvh.levelCount, 0u);
}

} // namespace
} // namespace shadowdag
