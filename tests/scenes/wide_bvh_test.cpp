// SPDX-License-Identifier: Apache-2.0
#include "scenes/wide_bvh.h"

#include "scenes/morton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

namespace shadowdag {
namespace {

std::vector<Box> randomBoxes(uint32_t seed, size_t count) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::vector<Box> boxes(count);
    for (size_t i = 0; i < count; ++i) {
        const glm::vec3 c = 10.0f * glm::vec3(unit(rng), unit(rng), unit(rng));
        if (i % 17 != 5) // some stay empty
            boxes[i] = {c, c + 0.5f * glm::vec3(unit(rng), unit(rng), unit(rng))};
    }
    return boxes;
}

std::vector<uint32_t> query(const WideBvhView& bvh, const glm::vec3& p, float radius) {
    std::vector<uint32_t> found;
    traverse(
        bvh,
        [&](const Box& box) { return !box.empty() && distanceSquared(box, p) < radius * radius; },
        [&](uint32_t i) { found.push_back(i); });
    return found;
}

void expectSameAsBruteForce(const WideBvh& bvh, const std::vector<Box>& boxes, uint32_t seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (int i = 0; i < 30; ++i) {
        const glm::vec3 p = 12.0f * glm::vec3(unit(rng), unit(rng), unit(rng)) - 1.0f;
        const float radius = 3.0f * unit(rng);
        std::vector<uint32_t> found = query(bvh.view(), p, radius), expected;
        std::sort(found.begin(), found.end());
        for (uint32_t k = 0; k < boxes.size(); ++k)
            if (!boxes[k].empty() && distanceSquared(boxes[k], p) < radius * radius)
                expected.push_back(k);
        ASSERT_EQ(found, expected);
    }
}

TEST(WideBvh, SphereQueriesEqualBruteForceForEveryNumberOfLevels) {
    for (const size_t count : {0u, 1u, 31u, 32u, 33u, 1024u, 1025u, 40000u}) {
        SCOPED_TRACE("seed 3, count " + std::to_string(count));
        const std::vector<Box> boxes = randomBoxes(3, count);
        WideBvh bvh;
        bvh.build(viewOf(boxes));
        expectSameAsBruteForce(bvh, boxes, 4);
    }
}

TEST(WideBvh, NoItemsMakeNoLevelsAndThirtyTwoMakeOne) {
    WideBvh bvh;
    EXPECT_EQ(topBoxCount(bvh.view()), 0u);
    bvh.build({});
    EXPECT_EQ(bvh.view().levelCount, 0u);
    std::vector<Box> boxes(32, Box{glm::vec3(0), glm::vec3(1)});
    bvh.build(viewOf(boxes));
    EXPECT_EQ(bvh.view().levelCount, 1u);
    boxes.resize(33, boxes[0]);
    bvh.build(viewOf(boxes));
    EXPECT_EQ(bvh.view().levelCount, 2u);
    EXPECT_EQ(topBoxCount(bvh.view()), 2u);
}

TEST(WideBvh, RefitAfterMotionEqualsAFreshOne) {
    std::vector<Box> boxes = randomBoxes(5, 3000);
    WideBvh bvh;
    bvh.build(viewOf(boxes));
    for (size_t i = 0; i < boxes.size(); i += 3) {
        boxes[i].min += glm::vec3(float(i % 7), -1, 2);
        boxes[i].max += glm::vec3(float(i % 7), -1, 2);
    }
    bvh.refit(viewOf(boxes));
    expectSameAsBruteForce(bvh, boxes, 6);
}

void expectSameArrays(const WideBvh& a, const WideBvh& b) {
    const WideBvhView x = a.view(), y = b.view();
    ASSERT_EQ(x.levelCount, y.levelCount);
    ASSERT_EQ(x.boxes.count, y.boxes.count);
    ASSERT_EQ(x.items.count, y.items.count);
    ASSERT_EQ(std::memcmp(x.boxes.data, y.boxes.data, x.boxes.count * sizeof(Box)), 0);
    ASSERT_EQ(std::memcmp(x.items.data, y.items.data, x.items.count * sizeof(uint32_t)), 0);
}

TEST(WideBvh, UpdateMakesTheArraysOfAFreshBuildAfterAnyMotion) {
    // count, every how many is a mover
    for (const auto& [count, stride] :
         {std::pair(1u, 1u), {33u, 2u}, {70u, 1u}, {1500u, 5u}, {40000u, 9u}}) {
        SCOPED_TRACE("seed 11, count " + std::to_string(count));
        std::mt19937 rng(11);
        std::normal_distribution<float> normal;
        std::vector<Box> boxes = randomBoxes(11, count);
        std::vector<uint8_t> isMover(count, 0);
        std::vector<uint32_t> movers;
        for (uint32_t i = 0; i < count; i += stride) {
            isMover[i] = 1;
            movers.push_back(i);
        }
        WideBvh bvh, fresh;
        bvh.build(viewOf(boxes), isMover);
        bool wasSorted = false, wasRebuilt = false;
        for (int step = 0; step < 40; ++step) {
            // From one mover to all of them, from a nudge to a leap; some become empty or equal.
            const float size = std::ldexp(1.0f, -18 + step / 2);
            std::vector<uint32_t> moved;
            for (const uint32_t i : movers)
                if (rng() % 8 <= uint32_t(step % 8)) {
                    const glm::vec3 by = size * glm::vec3(normal(rng), normal(rng), normal(rng));
                    boxes[i].min += by;
                    boxes[i].max += by;
                    if (step % 10 == 9)
                        boxes[i] = i % 3 ? Box{glm::vec3(1), glm::vec3(2)} : Box();
                    else if (boxes[i].empty())
                        boxes[i] = {by, by + 1.0f};
                    moved.push_back(i);
                }
            const BvhUpdateCounts counts = bvh.update(viewOf(boxes), moved);
            wasSorted |= counts.sortedKeyCount > 0 && !counts.isRebuilt;
            wasRebuilt |= counts.isRebuilt;
            fresh.build(viewOf(boxes), isMover);
            expectSameArrays(bvh, fresh);
        }
        EXPECT_TRUE(wasSorted || count == 1);
        EXPECT_TRUE(wasRebuilt || count == 1);
        expectSameAsBruteForce(bvh, boxes, 12);
    }
}

TEST(WideBvh, UpdateSortsOnlyItemsThatLeftTheirCellsAndWritesOnlyBoxesAboveThem) {
    // 64 that stand still, 1024 movers in a row: 32 boxes of level 1 above movers, 2 above others.
    std::vector<Box> boxes;
    std::vector<uint8_t> isMover;
    for (int i = 0; i < 64 + 1024; ++i) {
        const glm::vec3 corner(i < 64 ? -200.0f + float(i) : float(i - 64), 0, 0);
        boxes.push_back({corner, corner + 0.5f});
        isMover.push_back(i >= 64);
    }
    WideBvh bvh;
    bvh.build(viewOf(boxes), isMover);
    ASSERT_EQ(bvh.view().levelCount, 3u);
    EXPECT_EQ(bvh.update(viewOf(boxes), {}).boxCount, 0u);

    // It grows about its centre: the same place, its own box, two above.
    boxes[100].min.y -= 0.25f;
    boxes[100].max.y += 0.25f;
    BvhUpdateCounts counts = bvh.update(viewOf(boxes), {100});
    EXPECT_EQ(counts.sortedKeyCount, 0u);
    EXPECT_EQ(counts.boxCount, 3u);
    EXPECT_FALSE(counts.isRebuilt);

    // It steps beyond its neighbour: two change places under one box of level 1, whose own box
    // stays what it was when they stand in its middle.
    boxes[80].min.x += 1.25f;
    boxes[80].max.x += 1.25f;
    counts = bvh.update(viewOf(boxes), {80});
    EXPECT_EQ(counts.sortedKeyCount, 1u);
    EXPECT_EQ(counts.boxCount, 3u);
    EXPECT_FALSE(counts.isRebuilt);

    // From the first place to the last: every leaf of the movers shifts, none of the others.
    const Box first = boxes[64];
    boxes[64] = {glm::vec3(1022.6f, 0, 0), glm::vec3(1022.7f, 0.5f, 0.5f)};
    counts = bvh.update(viewOf(boxes), {64});
    EXPECT_EQ(counts.sortedKeyCount, 1u);
    EXPECT_GE(counts.boxCount, 1000u);
    EXPECT_LE(counts.boxCount, 1024u + 32u + 2u);
    EXPECT_FALSE(counts.isRebuilt);

    // Beyond the grid: all movers are sorted, and nothing else; one that stood still: everything.
    boxes[64] = {first.min - 5000.0f, first.max - 5000.0f};
    counts = bvh.update(viewOf(boxes), {64});
    EXPECT_TRUE(counts.isRebuilt);
    EXPECT_EQ(counts.sortedKeyCount, 1024u);
    boxes[3].max.y += 1.0f;
    counts = bvh.update(viewOf(boxes), {3});
    EXPECT_TRUE(counts.isRebuilt);
    EXPECT_EQ(counts.sortedKeyCount, 1088u);
    isMover[3] = 1;
    WideBvh fresh;
    fresh.build(viewOf(boxes), isMover);
    expectSameArrays(bvh, fresh);
}

/// Returns how many boxes of all levels a query looks at.
uint64_t visitedBoxes(const WideBvhView& bvh, const glm::vec3& p, float radius) {
    uint64_t count = 0;
    traverse(
        bvh,
        [&](const Box& box) {
            ++count;
            return !box.empty() && distanceSquared(box, p) < radius * radius;
        },
        [&](uint32_t) {});
    return count;
}

TEST(WideBvh, QueriesVisitHardlyMoreBoxesThanOneRunOfAllWhereRefitsDecay) {
    // One in eight of 20000 boxes wanders through the whole scene for 200 steps.
    std::mt19937 rng(21);
    std::normal_distribution<float> normal;
    std::vector<Box> boxes = randomBoxes(21, 20000);
    std::vector<uint8_t> isMover(boxes.size(), 0);
    std::vector<uint32_t> movers;
    for (uint32_t i = 0; i < boxes.size(); i += 8) {
        isMover[i] = 1;
        movers.push_back(i);
    }
    WideBvh updated, refitted, fresh;
    updated.build(viewOf(boxes), isMover);
    refitted.build(viewOf(boxes));
    for (int step = 0; step < 200; ++step) {
        for (const uint32_t i : movers) {
            const glm::vec3 by = 0.3f * glm::vec3(normal(rng), normal(rng), normal(rng));
            boxes[i].min += by;
            boxes[i].max += by;
        }
        updated.update(viewOf(boxes), movers);
    }
    refitted.refit(viewOf(boxes));
    fresh.build(viewOf(boxes));
    uint64_t byUpdated = 0, byRefitted = 0, byFresh = 0;
    for (int i = 0; i < 300; ++i) {
        const glm::vec3 p =
            10.0f * glm::vec3(float(rng() % 1000), float(rng() % 1000), float(rng() % 1000)) /
            1000.0f;
        byUpdated += visitedBoxes(updated.view(), p, 1.5f);
        byRefitted += visitedBoxes(refitted.view(), p, 1.5f);
        byFresh += visitedBoxes(fresh.view(), p, 1.5f);
    }
    RecordProperty("updated_over_fresh", std::to_string(double(byUpdated) / double(byFresh)));
    RecordProperty("refitted_over_fresh", std::to_string(double(byRefitted) / double(byFresh)));
    std::printf("boxes visited over a fresh build of all: updated %.3f, refitted %.3f\n",
                double(byUpdated) / double(byFresh), double(byRefitted) / double(byFresh));
    EXPECT_LT(byUpdated, 1.4 * double(byFresh));
    EXPECT_GT(byRefitted, 2.0 * double(byFresh));
}

TEST(WideBvh, PartsOfALevelAddUpToTheWhole) {
    const std::vector<Box> boxes = randomBoxes(8, 5000);
    WideBvh bvh;
    EXPECT_EQ(partsOf(bvh.view(), 1).count, 0u);
    bvh.build(viewOf(boxes));
    EXPECT_EQ(topBoxCount(bvh.view()), 5u);
    const BvhParts divided = partsOf(bvh.view(), 1000);
    EXPECT_EQ(divided.level, 1u);
    EXPECT_EQ(divided.count, 157u);
    EXPECT_EQ(partsOf(bvh.view(), kMostBvhParts / 157).count, 157u);
    EXPECT_EQ(partsOf(bvh.view(), kMostBvhParts / 157 + 1).count, 5u) << "their words are bounded";
    std::vector<uint32_t> parts, finer, whole;
    const auto all = [](const Box& box) { return !box.empty(); };
    for (uint32_t part = 0; part < topBoxCount(bvh.view()); ++part)
        traverseFrom(bvh.view(), part, part + 1, all, [&](uint32_t i) { parts.push_back(i); });
    for (uint32_t part = 0; part < divided.count; ++part)
        traverseBelow(bvh.view(), divided.level, part, part + 1, all,
                      [&](uint32_t i) { finer.push_back(i); });
    traverse(bvh.view(), all, [&](uint32_t i) { whole.push_back(i); });
    EXPECT_EQ(parts, whole);
    EXPECT_EQ(finer, whole);
}

TEST(Morton, BitsInterleaveXLowestAndPointsClampToTheGrid) {
    EXPECT_EQ(mortonCode(1, 0, 0), 1u);
    EXPECT_EQ(mortonCode(0, 1, 0), 2u);
    EXPECT_EQ(mortonCode(0, 0, 1), 4u);
    EXPECT_EQ(mortonCode(3, 0, 0), 9u);
    const uint32_t last = (1u << kMortonAxisBits) - 1;
    EXPECT_EQ(mortonCode(last, last, last), (1ull << 63) - 1);
    const Box unit{glm::vec3(0), glm::vec3(1)};
    EXPECT_EQ(mortonCode(glm::vec3(5), unit), (1ull << 63) - 1);
    EXPECT_EQ(mortonCode(glm::vec3(-5), unit), 0u);
    EXPECT_EQ(mortonCode(glm::vec3(std::nanf("")), unit), 0u);
    EXPECT_EQ(mortonCode(glm::vec3(5), Box()), 0u);
}

} // namespace
} // namespace shadowdag
