// SPDX-License-Identifier: Apache-2.0
// Lookups in lanes: the bits and the missing taps of lookupVisibility, and the pages of markLookup,
// by every instruction set.
#include "hybrid/frame/lookup_lanes.h"

#include "hybrid/frame/sample_lanes.h"
#include "shadowmap/cell_depth.h"
#include "tests/hybrid/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <tuple>

namespace shadowdag::test {
namespace {

constexpr uint64_t kLookupSeed = 20261124;
constexpr uint32_t kPageTexels = 16;

/// Returns a number in [-1, 1).
float signedNumber(Random& random) {
    return float(2 * random() - 1);
}

/// A map with random depths, some of whose pages have no memory; of a cube, or the window of a
/// directional light.
struct RandomMap {
    RandomMap(Random& random, uint32_t faceTexels, float lodTexels, uint32_t missingInTen,
              bool isWindow) {
        info.lightPositionWorld = random.inCube(1);
        if (isWindow)
            info.window = windowOf(random);
        info.rangeWorld = 4.0f;
        info.faceTexels = faceTexels;
        info.facePages = (faceTexels + kPageTexels - 1) / kPageTexels;
        info.pageTableStart = 32;
        info.lodTexels = lodTexels;
        pageTable.assign(info.pageTableStart, kNoPage);
        uint32_t pageCount = 1; // the first page is another map's
        for (uint32_t i = 0; i < kFaceCount * info.facePages * info.facePages; ++i)
            pageTable.push_back(random.below(10) < missingInTen ? kNoPage : pageCount++);
        for (uint32_t i = 0; i < pageCount * kPageTexels * kPageTexels; ++i)
            depths.push_back(random.below(4) == 0 ? 0
                                                  : floatBits(1.0f + 0.9f * signedNumber(random)));
    }
    /// Returns a window around the origin, two wide and deep, in a random direction.
    static DirectionalWindow windowOf(Random& random) {
        const glm::dvec3 toLight = glm::normalize(glm::dvec3(random.inCube(1)));
        const glm::dvec3 right = glm::normalize(glm::cross(toLight, glm::dvec3(random.inCube(1))));
        const double scale = 1.0 + 0.5 * double(signedNumber(random));
        DirectionalWindow window;
        window.u = scale * right;
        window.v = scale * glm::cross(toLight, right);
        window.w = 0.25 * toLight;
        window.u0 = 0.2 * double(signedNumber(random));
        window.v0 = 0.2 * double(signedNumber(random));
        window.w0 = -1.5;
        return window;
    }
    ShadowMapView view() const {
        return {
            {&info, 1}, {pageTable.data(), pageTable.size()}, {depths.data(), depths.size()}, 4};
    }

    ShadowMapInfo info{};
    std::vector<uint32_t> pageTable, depths;
};

/// Receivers around a map, some of them at edges of faces, grazing, at the light or not numbers.
struct RandomReceivers {
    /// @param lanes receives them
    RandomReceivers(Random& random, const ShadowMapInfo& map, SampleLanes& lanes) {
        const bool isWindow = map.window.isDirectional();
        const uint32_t count = random.below(70);
        lanes.reset(count);
        for (uint32_t i = 0; i < count; ++i) {
            glm::vec3 d = random.inCube(1);
            if (random.below(4) == 0) // near an edge between faces
                d[int(random.below(3))] = d[0] * (1.0f + 0.05f * signedNumber(random));
            const glm::vec3 away = isWindow ? -glm::vec3(map.window.w) : d;
            glm::vec3 position = isWindow ? d : map.lightPositionWorld + d;
            glm::vec3 normal = glm::normalize(random.inCube(1));
            if (random.below(3) != 0 && glm::dot(normal, away) > 0.0f)
                normal = -normal;
            if (random.below(8) == 0) // grazing
                normal = glm::normalize(glm::cross(away, random.inCube(1)) - 0.01f * away);
            if (random.below(40) == 0)
                position = map.lightPositionWorld;
            if (random.below(40) == 0)
                position.y = std::nanf("");
            positions.push_back(position);
            normals.push_back(normal);
            lanes.set(i, position, normal);
            isAsked.push_back(random.below(5) != 0);
        }
    }

    std::vector<glm::vec3> positions, normals;
    std::vector<uint8_t> isAsked;
};

class LookupLanesOf : public testing::TestWithParam<std::tuple<StreamIsa, bool>> {
protected:
    void SetUp() override {
        RecordProperty("seed", std::to_string(kLookupSeed));
        if (!hasStreamIsa(isa()))
            GTEST_SKIP() << "this processor or build has no " << streamIsaName(isa());
    }
    static StreamIsa isa() { return std::get<0>(GetParam()); }
    static bool isWindow() { return std::get<1>(GetParam()); }
};

TEST_P(LookupLanesOf, EqualTheOneTextBitForBit) {
    Random random(kLookupSeed);
    LookupLanes lookups(isa());
    SampleLanes lanes(isa());
    uint32_t missingTotal = 0;
    std::array<uint32_t, 256> histogram{};
    for (int round = 0; round < 400; ++round) {
        const uint32_t faceTexels = 1 + random.below(round % 2 == 0 ? 24 : 300);
        const RandomMap map(random, faceTexels, round % 5 == 0 ? 2.0f : 0.0f,
                            std::array{0u, 0u, 2u, 10u}[size_t(round) % 4], isWindow());
        const ShadowMapBias bias{std::array{0.0f, 0.5f, 3.0f}[size_t(round) % 3],
                                 std::array{1u, 4u, 9u}[size_t(round / 3) % 3]};
        const RandomReceivers receivers(random, map.info, lanes);
        const auto& [positions, normals, isAsked] = receivers;
        const auto count = uint32_t(positions.size());
        std::vector<uint8_t> seen(count, 7);
        uint32_t missing = 0;
        std::vector<uint8_t> expected(count, 7);
        for (uint32_t i = 0; i < count; ++i)
            if (isAsked[i]) {
                ShadowMapTrace trace;
                expected[i] =
                    lookupVisibility(map.view(), 0, positions[i], normals[i], bias, &trace);
                missing += trace.missingTapCount;
                ++histogram[expected[i]];
            }
        const uint32_t counted =
            lookups.lookUp(map.view(), 0, bias, lanes.arrays(), {isAsked.data(), isAsked.size()},
                           {seen.data(), seen.size()});
        ASSERT_EQ(counted, missing) << "round " << round;
        ASSERT_EQ(seen, expected) << "round " << round << ", " << faceTexels << " texels, "
                                  << bias.taps << " taps";
        missingTotal += missing;
    }
    EXPECT_GT(missingTotal, 1000u);
    EXPECT_GT(histogram[0], 1000u);
    EXPECT_GT(histogram[255], 1000u);
    EXPECT_GT(std::count_if(histogram.begin(), histogram.end(), [](uint32_t n) { return n > 0; }),
              200);
}

TEST_P(LookupLanesOf, MarkThePagesOfTheOneText) {
    Random random(kLookupSeed);
    LookupLanes lookups(isa());
    SampleLanes lanes(isa());
    size_t markedTotal = 0;
    for (int round = 0; round < 400; ++round) {
        const uint32_t faceTexels = 1 + random.below(round % 2 == 0 ? 24 : 300);
        const RandomMap map(random, faceTexels, 0.0f, 0, isWindow());
        const RandomReceivers receivers(random, map.info, lanes);
        const auto& [positions, normals, isAsked] = receivers;
        std::vector<uint32_t> before((map.pageTable.size() + 31) / 32);
        for (uint32_t& word : before) { // as other clusters leave them: none, some or most marked
            const uint32_t some = random.below(~0u), others = random.below(~0u);
            word = std::array{0u, some, some | others}[size_t(round) % 3];
        }
        std::vector<uint32_t> expected = before, found = before;
        const auto demandOf = [&](std::vector<uint32_t>& pages) {
            return PageDemand{{&map.info, 1},
                              1,
                              1,
                              {pages.data(), pages.size()},
                              4,
                              std::array{1u, 4u, 9u}[size_t(round / 3) % 3]};
        };
        for (size_t i = 0; i < positions.size(); ++i)
            if (isAsked[i])
                markLookup(demandOf(expected), 0, positions[i], normals[i]);
        lookups.markPages(demandOf(found), 0, lanes.arrays(), {isAsked.data(), isAsked.size()});
        ASSERT_EQ(found, expected) << "round " << round << ", " << faceTexels << " texels";
        for (size_t i = 0; i < found.size(); ++i)
            markedTotal += size_t(std::popcount(found[i] & ~before[i]));
    }
    EXPECT_GT(markedTotal, 1000u);
}

INSTANTIATE_TEST_SUITE_P(EveryIsa, LookupLanesOf,
                         testing::Combine(testing::Values(StreamIsa::kPortable, StreamIsa::kAvx2,
                                                          StreamIsa::kAvx512),
                                          testing::Bool()),
                         [](const auto& info) {
                             const std::string name = streamIsaName(std::get<0>(info.param));
                             return (name == "AVX-512" ? std::string("AVX512") : name) +
                                    (std::get<1>(info.param) ? "Window" : "Cube");
                         });

} // namespace
} // namespace shadowdag::test
