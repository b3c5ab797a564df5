// SPDX-License-Identifier: Apache-2.0
#include "scenes/wide_bvh.h"

#include "scenes/morton.h"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(WideBvh, RefitAfterMotionAnswersAsAFreshOneDoes) {
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

TEST(WideBvh, PartsOfTheTopLevelAddUpToTheWhole) {
    const std::vector<Box> boxes = randomBoxes(8, 5000);
    WideBvh bvh;
    bvh.build(viewOf(boxes));
    std::vector<uint32_t> parts, whole;
    const auto all = [](const Box& box) { return !box.empty(); };
    for (uint32_t part = 0; part < topBoxCount(bvh.view()); ++part)
        traverseFrom(bvh.view(), part, part + 1, all, [&](uint32_t i) { parts.push_back(i); });
    traverse(bvh.view(), all, [&](uint32_t i) { whole.push_back(i); });
    EXPECT_EQ(parts, whole);
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
