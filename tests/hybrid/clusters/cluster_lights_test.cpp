// SPDX-License-Identifier: Apache-2.0
// Light assignment against brute force: no light lost, lists ascending, borders half open.
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/clusters/light_bvh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag::test {
namespace {

std::vector<Light> randomLights(uint64_t seed, int count) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> place(-10.0f, 10.0f), unit(0.0f, 1.0f);
    std::vector<Light> lights(count);
    for (Light& light : lights) {
        light.positionWorld = {place(random), place(random), place(random)};
        light.rangeWorld = 0.2f + 6.0f * unit(random) * unit(random);
        light.directionWorld =
            glm::normalize(glm::vec3(place(random), place(random), place(random)));
        if (unit(random) < 0.5f) {
            light.kind = Light::kSpot;
            light.cosOuter = std::cos(0.05f + 1.5f * unit(random));
        }
    }
    return lights;
}

std::vector<Box> randomBoxes(uint64_t seed, int count) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> place(-11.0f, 11.0f), unit(0.0f, 1.0f);
    std::vector<Box> boxes(count);
    for (Box& box : boxes) {
        box.add(glm::vec3(place(random), place(random), place(random)));
        const float size = unit(random) < 0.1f ? 0.0f : 3.0f * unit(random) * unit(random);
        box.max += glm::vec3(unit(random), unit(random), unit(random)) * size;
    }
    return boxes;
}

std::vector<std::vector<uint32_t>> assign(const std::vector<Box>& boxes,
                                          const std::vector<Light>& lights) {
    const WideBvh bvh = buildLightBvh(lights);
    ClusterLights lists(Backend::kCpu);
    assignLights(Backend::kCpu, viewOf(boxes), bvh.view(), viewOf(lights), lists);
    std::vector<std::vector<uint32_t>> result(boxes.size());
    for (size_t b = 0; b < boxes.size(); ++b)
        for (uint32_t i = lists.start.at(b); i < lists.start.at(b + 1); ++i)
            result[b].push_back(lists.lights.at(i));
    return result;
}

TEST(LightAssignment, EqualsTestingEveryLightAndAscends) {
    for (const int lightCount : {1, 31, 33, 400}) {
        const std::vector<Light> lights = randomLights(lightCount, lightCount);
        const std::vector<Box> boxes = randomBoxes(7, 300);
        const auto lists = assign(boxes, lights);
        for (size_t b = 0; b < boxes.size(); ++b) {
            std::vector<uint32_t> expected;
            for (uint32_t l = 0; l < lights.size(); ++l)
                if (mayReach(lights[l], boxes[b]))
                    expected.push_back(l);
            EXPECT_EQ(lists[b], expected) << lightCount << " lights, box " << b;
        }
    }
}

TEST(LightAssignment, LosesNoLightThatReachesAPointOfTheBox) {
    const std::vector<Light> lights = randomLights(3, 200);
    const std::vector<Box> boxes = randomBoxes(4, 400);
    const auto lists = assign(boxes, lights);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    size_t reachedCount = 0, listedCount = 0;
    for (size_t b = 0; b < boxes.size(); ++b) {
        listedCount += lists[b].size();
        for (int sample = 0; sample < 60; ++sample) {
            glm::vec3 t(unit(random), unit(random), unit(random));
            if (sample < 8) // corners
                t = glm::vec3(sample & 1, sample >> 1 & 1, sample >> 2 & 1);
            const glm::vec3 p =
                glm::clamp(glm::mix(boxes[b].min, boxes[b].max, t), boxes[b].min, boxes[b].max);
            for (uint32_t l = 0; l < lights.size(); ++l)
                if (lightReaches(lights[l], p)) {
                    ++reachedCount;
                    ASSERT_TRUE(std::binary_search(lists[b].begin(), lists[b].end(), l))
                        << "box " << b << " light " << l << " seed 3";
                }
        }
    }
    EXPECT_GT(reachedCount, 20000u);
    EXPECT_LT(listedCount, boxes.size() * lights.size() / 4); // and not by listing all
}

TEST(LightAssignment, ABoxThatTheSphereTouchesExactlyIsOut) {
    Light light;
    light.rangeWorld = 1.0f;
    Box box;
    box.min = {1.0f, -1.0f, -1.0f};
    box.max = {2.0f, 1.0f, 1.0f};
    EXPECT_TRUE(assign({box}, {light})[0].empty());
    EXPECT_FALSE(lightReaches(light, {1.0f, 0.0f, 0.0f}));
    box.min.x = std::nextafter(1.0f, 0.0f);
    EXPECT_EQ(assign({box}, {light})[0].size(), 1u);
    EXPECT_TRUE(lightReaches(light, {box.min.x, 0.0f, 0.0f}));
}

TEST(LightAssignment, DropsBoxesBehindAndBesideASpot) {
    Light light;
    light.kind = Light::kSpot;
    light.rangeWorld = 10.0f;
    light.directionWorld = {1, 0, 0};
    light.cosOuter = std::cos(0.5f);
    const auto boxAt = [](const glm::vec3& p) {
        Box box;
        box.add(p - 0.1f);
        box.add(p + 0.1f);
        return box;
    };
    EXPECT_TRUE(mayReach(light, boxAt({5, 0, 0})));
    EXPECT_TRUE(mayReach(light, boxAt({0, 0, 0})));
    EXPECT_FALSE(mayReach(light, boxAt({-1, 0, 0})));
    EXPECT_FALSE(mayReach(light, boxAt({1, 3, 0})));
    light.cosOuter = -0.5f; // wider than a half space: never dropped by the cone
    EXPECT_TRUE(mayReach(light, boxAt({-1, 0, 0})));
}

TEST(LightOrder, HasTheSameEntriesAlongTheHierarchysCurve) {
    const std::vector<Light> lights = randomLights(11, 333);
    const std::vector<Box> boxes = randomBoxes(12, 200);
    const WideBvh bvh = buildLightBvh(lights);
    ClusterLights lists(Backend::kCpu);
    assignLights(Backend::kCpu, viewOf(boxes), bvh.view(), viewOf(lights), lists);
    std::vector<uint32_t> records(lists.lights.size());
    for (size_t i = 0; i < records.size(); ++i)
        records[i] = i % 7 == 0 ? kProvenLit : uint32_t(1000 + i);
    lists.record.upload(records);
    OrderedLights memory(Backend::kCpu);
    const ClusterLightsView all = lists.view(),
                            ordered =
                                orderLights(Backend::kCpu, all, bvh.view(), lights.size(), memory);
    std::vector<uint32_t> place(lights.size());
    const WideBvhView curve = bvh.view();
    for (uint32_t i = 0; i < curve.items.count; ++i)
        if (curve.items[i] != kNoBvhItem)
            place[curve.items[i]] = i;
    double along = 0.0, ascending = 0.0; // how far it is from light to light
    for (size_t b = 0; b < boxes.size(); ++b) {
        std::vector<std::pair<uint32_t, uint32_t>> before, after;
        for (uint32_t i = all.start[b]; i < all.start[b + 1]; ++i) {
            before.emplace_back(all.lights[i], all.record[i]);
            after.emplace_back(ordered.lights[i], ordered.record[i]);
            if (i == all.start[b])
                continue;
            ASSERT_LT(place[ordered.lights[i - 1]], place[ordered.lights[i]]);
            const auto step = [&](const ClusterLightsView& list) {
                return glm::distance(lights[list.lights[i]].positionWorld,
                                     lights[list.lights[i - 1]].positionWorld);
            };
            along += step(ordered);
            ascending += step(all);
        }
        std::sort(after.begin(), after.end());
        ASSERT_EQ(before, after);
    }
    EXPECT_LT(along, 0.95 * ascending);
    RecordProperty("distance_of_ascending", std::to_string(along / ascending));
}

TEST(LightAssignment, WorksWithoutLightsAndWithoutBoxes) {
    EXPECT_TRUE(assign(randomBoxes(1, 3), {})[2].empty());
    EXPECT_TRUE(assign({}, randomLights(1, 3)).empty());
}

} // namespace
} // namespace shadowdag::test
