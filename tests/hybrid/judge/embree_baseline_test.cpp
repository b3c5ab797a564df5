// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/embree_baseline.h"

#include "cuda/error.h"
#include "hybrid/judge/truth.h"
#include "hybrid/rays/embree_version.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace shadowdag {
namespace {

using test::TriangleSoup;

constexpr uint64_t kSeed = 4711;

/// A heap of triangles and segments through it.
void makeHeap(TriangleSoup& soup, std::vector<WorldSegment>& segments) {
    std::mt19937_64 engine(kSeed);
    const auto point = [&](float half) {
        const auto next = [&] { return half * (float(engine() >> 40) * 0x1p-23f - 1.0f); };
        const float x = next(), y = next(), z = next();
        return glm::vec3(x, y, z);
    };
    for (int i = 0; i < 3000; ++i) {
        const glm::vec3 p = point(5.0f);
        soup.add(p, p + point(0.4f), p + point(0.4f));
    }
    for (int i = 0; i < 20003; ++i) { // not a multiple of any packet
        const glm::vec3 from = point(6.0f);
        segments.push_back({from, from + point(6.0f)});
    }
}

TEST(EmbreeBaseline, CallsAreThoseOfThisVersion) {
    std::vector<std::string> names;
    for (const EmbreeCall call : embreeCalls())
        names.emplace_back(embreeCallName(call));
    std::vector<std::string> expected = {"rtcOccluded1", "rtcOccluded8", "rtcOccluded16"};
    if (kHasEmbreeRayStreams)
        expected.emplace_back("rtcOccluded1M");
    EXPECT_EQ(names, expected);
}

TEST(EmbreeBaseline, RobustInterfacesAgreeWithEachOtherAndWithTheTruth) {
    TriangleSoup soup;
    std::vector<WorldSegment> segments;
    makeHeap(soup, segments);
    const EmbreeBaseline baseline(soup.view(), {.isRobust = true});
    const Truth truth(soup.view());
    std::vector<uint8_t> expected;
    for (const WorldSegment& s : segments)
        expected.push_back(truth.isBlocked(s.from, s.to));
    for (const EmbreeCall call : embreeCalls())
        EXPECT_EQ(baseline.occluded(call, segments), expected) << embreeCallName(call);
}

TEST(EmbreeBaseline, RatesComeWithVerifiedAnswers) {
    TriangleSoup soup;
    std::vector<WorldSegment> segments;
    makeHeap(soup, segments);
    const EmbreeBaseline baseline(soup.view());
    const std::vector<EmbreeRate> rates = baseline.measure(segments, 3);
    ASSERT_EQ(rates.size(), embreeCalls().size());
    for (const EmbreeRate& rate : rates) {
        EXPECT_GT(rate.megaraysPerSecond.value, 0.0) << embreeCallName(rate.call);
        EXPECT_LE(rate.megaraysPerSecond.low, rate.megaraysPerSecond.value);
        EXPECT_LE(rate.megaraysPerSecond.value, rate.megaraysPerSecond.high);
        EXPECT_NEAR(rate.megaraysPerSecond.confidence, 0.75, 1e-12) << "three repeats";
        EXPECT_LE(rate.disagreementCount, 2u) << embreeCallName(rate.call);
        EXPECT_GT(rate.occludedCount, segments.size() / 10);
        EXPECT_LT(rate.occludedCount, segments.size() * 9 / 10);
    }
}

TEST(EmbreeBaseline, RatesOfTenRepeatsHaveAnIntervalOf95PerCent) {
    TriangleSoup soup;
    std::vector<WorldSegment> segments;
    makeHeap(soup, segments);
    for (const EmbreeRate& rate : EmbreeBaseline(soup.view()).measure(segments))
        EXPECT_TRUE(rate.megaraysPerSecond.isWide()) << embreeCallName(rate.call);
}

TEST(EmbreeBaseline, NoSegmentsGiveNoRate) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 1.0f);
    const EmbreeBaseline baseline(soup.view());
    for (const EmbreeRate& rate : baseline.measure({}, 1)) {
        EXPECT_EQ(rate.megaraysPerSecond.value, 0.0);
        EXPECT_EQ(rate.occludedCount, 0u);
    }
}

TEST(EmbreeBaseline, CoordinatesThatEmbreeWouldIgnoreAreRefused) {
    TriangleSoup soup;
    soup.add({0, 0, 0}, {0, 1e19f, 0}, {1, 0, 0});
    try {
        const EmbreeBaseline baseline(soup.view());
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(e.what()).find("1e18"), std::string::npos) << e.what();
    }
}

} // namespace
} // namespace shadowdag
