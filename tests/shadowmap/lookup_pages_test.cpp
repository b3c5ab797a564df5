// SPDX-License-Identifier: Apache-2.0
// Marks of pages against what lookups read: a page is marked if and only if the lookup misses it,
// and boxes mark at least these.
#include "shadowmap/page_mask.h"

#include "tests/hybrid/random.h"

#include <gtest/gtest.h>

#include <bit>
#include <string>
#include <vector>

namespace shadowdag {
namespace {

constexpr uint64_t kSeed = 20261129;
constexpr uint32_t kPageTexelsLog2 = 4;

using test::Random;

/// Returns a cube map around a random light, or the window of a random direction; its page table
/// does not start at 0.
ShadowMapInfo randomMap(Random& random, bool isWindow) {
    ShadowMapInfo map{};
    map.lightPositionWorld = random.inCube(1);
    map.rangeWorld = 4.0f;
    map.faceTexels = 1 + random.below(random.below(2) ? 40 : 100);
    map.facePages = (map.faceTexels + (1u << kPageTexelsLog2) - 1) >> kPageTexelsLog2;
    map.pageTableStart = 32;
    if (isWindow) {
        const glm::dvec3 toLight = glm::normalize(glm::dvec3(random.inCube(1)));
        map.window.u = glm::normalize(glm::cross(toLight, glm::dvec3(random.inCube(1))));
        map.window.v = glm::cross(toLight, map.window.u);
        map.window.w = 0.25 * toLight;
        map.window.w0 = -1.5;
    }
    return map;
}

/// A lookup in a random map, often at an edge between faces; within a window, as MapRequest has it.
struct RandomLookup {
    ShadowMapInfo map;
    uint32_t taps;
    glm::vec3 position, normal;
};
RandomLookup randomLookup(Random& random, bool isWindow, int round) {
    const ShadowMapInfo map = randomMap(random, isWindow);
    glm::vec3 d = random.inCube(1);
    if (random.below(2))
        d[int(random.below(3))] = d[0] * (1.0f + 0.02f * float(2 * random() - 1));
    return {map,
            round % 3 == 0   ? 1u
            : round % 3 == 1 ? 4u
                             : 9u,
            isWindow ? 0.55f * d : map.lightPositionWorld + d, -glm::normalize(d)};
}

/// Returns the entries of a page table that ends with a map, and its words as bits.
size_t entriesOf(const ShadowMapInfo& map) {
    return map.pageTableStart + size_t(kFaceCount) * map.facePages * map.facePages;
}
size_t wordsOf(const ShadowMapInfo& map) {
    return (entriesOf(map) + 31) / 32;
}

PageDemand demandOf(const ShadowMapInfo& map, std::vector<uint32_t>& pages, uint32_t taps) {
    return {{&map, 1}, 1, 1, {pages.data(), pages.size()}, kPageTexelsLog2, taps};
}

class LookupPagesOf : public testing::TestWithParam<bool> {
protected:
    /// Calls test(random, lookup) with `count` lookups, until a test fails fatally.
    template <class Test> void forLookups(int count, const Test& test) {
        RecordProperty("seed", std::to_string(kSeed));
        Random random(kSeed);
        for (int round = 0; round < count && !HasFatalFailure(); ++round) {
            const RandomLookup lookup = randomLookup(random, GetParam(), round);
            SCOPED_TRACE("round " + std::to_string(round) + ", " +
                         std::to_string(lookup.map.faceTexels) + " texels, " +
                         std::to_string(lookup.taps) + " taps");
            test(random, lookup);
        }
    }
};

TEST_P(LookupPagesOf, AreMarkedIfAndOnlyIfALookupMissesThem) {
    size_t readTotal = 0, twoFaceCount = 0;
    forLookups(600, [&](Random&, const RandomLookup& lookup) {
        const auto& [map, taps, position, normal] = lookup;
        std::vector<uint32_t> marks(wordsOf(map));
        markLookup(demandOf(map, marks, taps), 0, position, normal);

        // Pages that are there hold no surface: page 0. One after the other is taken away.
        std::vector<uint32_t> pageTable(entriesOf(map), 0);
        const std::vector<uint32_t> depths(size_t(1) << 2 * kPageTexelsLog2, 0);
        const ShadowMapView view{{&map, 1},
                                 {pageTable.data(), pageTable.size()},
                                 {depths.data(), depths.size()},
                                 kPageTexelsLog2};
        uint32_t faces = 0;
        for (uint32_t entry = map.pageTableStart; entry < pageTable.size(); ++entry) {
            pageTable[entry] = kNoPage;
            ShadowMapTrace trace;
            lookupVisibility(view, 0, position, normal, {0.5f, taps}, &trace);
            pageTable[entry] = 0;
            const bool isRead = trace.missingTapCount > 0;
            ASSERT_EQ(marks[entry / 32] >> entry % 32 & 1u, isRead)
                << "entry " << entry - map.pageTableStart;
            readTotal += isRead;
            if (isRead)
                faces |= 1u << (entry - map.pageTableStart) / (map.facePages * map.facePages);
        }
        ASSERT_EQ(marks[0], 0u) << "a mark of another map";
        twoFaceCount += (faces & (faces - 1)) != 0;
    });
    EXPECT_GT(readTotal, 600u);
    EXPECT_EQ(twoFaceCount > 20, !GetParam());
}

// By a margin of the filter, also at edges of faces; without it, some tap lies outside.
TEST_P(LookupPagesOf, LieWithinThoseOfTheirBox) {
    size_t boxTotal = 0, lookupTotal = 0;
    forLookups(3000, [&](Random& random, const RandomLookup& lookup) {
        const auto& [map, taps, position, normal] = lookup;
        const glm::vec3 reach = glm::abs(random.inCube(random.below(2) ? 0.001 : 0.1));
        const Box box{position - reach, position + reach};
        const MapReceiver receiver{0, 0};
        std::vector<uint32_t> ofBox(wordsOf(map)), ofLookup(wordsOf(map));
        BoxPageMarker(Backend::kCpu, {&box, 1}, {&receiver, 1}).mark(demandOf(map, ofBox, taps));
        markLookup(demandOf(map, ofLookup, taps), 0, position, normal);
        for (size_t word = 0; word < ofBox.size(); ++word) {
            ASSERT_EQ(ofLookup[word] & ~ofBox[word], 0u);
            boxTotal += size_t(std::popcount(ofBox[word]));
            lookupTotal += size_t(std::popcount(ofLookup[word]));
        }
    });
    EXPECT_GT(lookupTotal, 3000u);
    EXPECT_LT(lookupTotal, boxTotal);
}

INSTANTIATE_TEST_SUITE_P(BothKinds, LookupPagesOf, testing::Bool(),
                         [](const auto& info) { return info.param ? "Window" : "Cube"; });

} // namespace
} // namespace shadowdag
