// SPDX-License-Identifier: Apache-2.0
// The adjudicator against closed forms, against every segment of a family that was tried, with and
// without its tree; and its families against the set-up of the truth's rays.
#include "hybrid/judge/adjudicator.h"

#include "hybrid/judge/exact_sign.h"
#include "hybrid/judge/truth.h"
#include "tests/hybrid/random.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSeed = 20260101;

glm::dvec3 within(const PointBox& box, Random& random) {
    const glm::dvec3 share(random(), random(), random());
    return glm::clamp(box.low + (box.high - box.low) * share, box.low, box.high);
}

/// Returns c of docs/adjudicator.md for samples on a floor of half side 8 at y = 0.
double floorClearance(const TriangleSoup& soup) {
    Box bounds;
    for (const glm::vec3& p : soup.positions)
        bounds.add(p);
    return 0x1p-24 * (4.0 * 8.0 + 16.0 * glm::length(glm::dvec3(bounds.extent())));
}

/// Returns the sample on the floor y = 0 whose segment to the light passes through a point, and
/// the triangle of the floor that it lies on.
FloatPair below(const glm::dvec3& point, const Light& light, const TriangleSoup& soup) {
    const glm::dvec3 l(light.positionWorld);
    const double c = floorClearance(soup);
    const glm::dvec3 start = l + (point - l) * ((l.y - c) / (l.y - point.y));
    return {glm::vec3(glm::dvec3(start.x, 0.0, start.z)), {0, 1, 0}, start.z >= start.x ? 0u : 1u};
}

TEST(Adjudicator, AnUmbraHasItsClosedForm) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    soup.addLevelSquare(glm::vec3(0, 1, 0), 1.0f);
    const Adjudicator adjudicator(soup.view());
    const Light light = pointLight({0.5f, 3.0f, -0.25f});
    Random random(kSeed);
    uint64_t counts[3] = {};
    for (int i = 0; i < 20000; ++i) {
        // Half of the samples at most 4e-6 of the umbra's edge at x = 1.25.
        glm::vec3 p = random.inCube(6.0);
        if (i % 2 == 0)
            p = glm::vec3(1.25f + 4e-6f * float(2.0 * random() - 1.0), 0.0f, 0.3f * p.z);
        p.y = 0.0f;
        const double c = floorClearance(soup);
        const glm::dvec3 at(double(p.x), c, double(p.z)), l(light.positionWorld),
            crossing = at + (l - at) * ((1.0 - c) / (l.y - c));
        const double outside = std::max(std::fabs(crossing.x), std::fabs(crossing.z)) - 1.0;
        const uint32_t receiver = p.z >= p.x ? 0u : 1u;
        const Ruling ruling = adjudicator.rule({p, {0, 1, 0}, receiver}, light);
        ++counts[size_t(ruling.verdict)];
        if (ruling.verdict != Verdict::kAmbiguous) {
            ASSERT_EQ(ruling.verdict == Verdict::kLit, outside > 0.0) << "case " << i;
        } else { // u is 2^-24, the scene's diagonal 22.7: see docs/adjudicator.md
            ASSERT_LT(std::fabs(outside), 12.0 * 0x1p-24 * 22.7) << "case " << i;
        }
    }
    for (const uint64_t count : counts)
        EXPECT_GT(count, 100u);
}

TEST(Adjudicator, EdgesThatTrianglesShareAreNotAmbiguous) {
    TriangleSoup soup; // a fan of four around (0, 1, 0), and a floor
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    const glm::vec3 ring[] = {{1, 1, 1}, {1, 1, -1}, {-1, 1, -1}, {-1, 1, 1}};
    for (int i = 0; i < 4; ++i)
        soup.add({0, 1, 0}, ring[i], ring[(i + 1) % 4]);
    const Adjudicator adjudicator(soup.view());
    const Light light = pointLight({0, 2, 0});
    const auto verdictAt = [&](double x, double z) { // of the segment through (x, 1, z)
        return adjudicator.rule(below({x, 1, z}, light, soup), light).verdict;
    };
    EXPECT_EQ(verdictAt(0, 0), Verdict::kDark) << "through the corner that four share";
    EXPECT_EQ(verdictAt(0.25, 0.25), Verdict::kDark) << "through an edge that two share";
    EXPECT_EQ(verdictAt(0.75, -0.75), Verdict::kDark);
    EXPECT_EQ(verdictAt(1.0, 0.25), Verdict::kAmbiguous) << "through the border";
    EXPECT_EQ(verdictAt(1.5, 0.25), Verdict::kLit);
    // Families as narrow as 2^-40.
    const auto narrow = [&](double x, double z) {
        SegmentFamily family = exactSegment({1.5 * x, 0.5, 1.5 * z}, {0, 2, 0});
        for (PointBox* box : {&family.start, &family.end}) {
            box->low -= glm::dvec3(0x1p-40);
            box->high += glm::dvec3(0x1p-40);
        }
        return adjudicator.rule(family).verdict;
    };
    EXPECT_EQ(narrow(0, 0), Verdict::kDark);
    EXPECT_EQ(narrow(0.25, 0.25), Verdict::kDark);
    EXPECT_EQ(narrow(1.0 - 0x1p-36, 0.25), Verdict::kDark);
    EXPECT_EQ(narrow(1.0, 0.25), Verdict::kAmbiguous);
    EXPECT_EQ(narrow(1.0 + 0x1p-36, 0.25), Verdict::kLit);
}

TEST(Adjudicator, ASilhouetteIsAmbiguousAndHasWitnesses) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    soup.addBox({-1, 1, -1}, {1, 1.5f, 1}); // its silhouette from above is a fold, not a border
    const Adjudicator adjudicator(soup.view());
    const Light light = pointLight({0, 2.5f, 0});
    const auto rule = [&](double x) { // of the segment through (x, 1.5, 0.25)
        return adjudicator.rule(below({x, 1.5, 0.25}, light, soup), light);
    };
    EXPECT_EQ(rule(1.0).verdict, Verdict::kAmbiguous);
    EXPECT_TRUE(rule(1.0).isWitnessed);
    EXPECT_EQ(rule(1.0 - 1e-4).verdict, Verdict::kDark);
    EXPECT_EQ(rule(1.0 + 1e-4).verdict, Verdict::kLit);
}

TEST(Adjudicator, TrianglesWithoutAreaAndInTheReceiversPlaneDoNotBlock) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    soup.addLevelSquare(glm::vec3(0.0f), 2.0f);         // in the receiver's plane
    soup.add({-1, 1, 0}, {0, 1, 0}, {1, 1, 0});         // on a line
    soup.add({0.5f, 0, 0}, {0.5f, 2, 0}, {0.5f, 2, 1}); // ends at the plane of the next sample
    const Adjudicator adjudicator(soup.view());
    const Ruling lit = adjudicator.rule({{0, 0, 1}, {0, 1, 0}, 0}, pointLight({0, 3, -1}));
    EXPECT_EQ(lit.verdict, Verdict::kLit);
    EXPECT_EQ(lit.touchedCount, 0u);
    // A segment in the plane of the wall x = 0.5: its neighbours pass on both sides.
    const Ruling grazing =
        adjudicator.rule({{0.5f, 0, -1}, {0, 1, 0}, 1}, pointLight({0.5f, 2, 1.5f}));
    EXPECT_EQ(grazing.verdict, Verdict::kAmbiguous);
    EXPECT_EQ(grazing.touchedCount, 1u);
}

/// Triangles of all shapes around a place; every 17th is degenerate.
TriangleSoup soupAt(const glm::vec3& place, uint64_t seed) {
    TriangleSoup soup;
    Random random(seed);
    for (int i = 0; i < 160; ++i) {
        const glm::vec3 at = random.inCube(4.0);
        const double size = 3.0 * random() * random();
        const glm::vec3 a = at + random.inCube(size), b = at + random.inCube(size);
        soup.add(a, b, i % 17 == 0 ? b : at + random.inCube(size));
    }
    soup.addBox({-1, -1, -1}, {1, 1, 1});
    soup.addLevelSquare({0, -3, 0}, 5.0f);
    soup.move(place);
    return soup;
}

TEST(Adjudicator, VerdictsHoldForEverySegmentThatIsTriedAndTheTreeLosesNothing) {
    RecordProperty("seed", std::to_string(kSeed));
    for (const float far : {0.0f, 3000.0f}) {
        const TriangleSoup soup = soupAt(glm::vec3(far, 0, -far), kSeed);
        const Adjudicator adjudicator(soup.view());
        Random random(kSeed + 1);
        uint64_t counts[3] = {}, witnessed = 0;
        for (int i = 0; i < 3000; ++i) {
            // From pairs, and of wider families, which cross and miss many triangles at once.
            const uint32_t receiver = random.below(soup.triangles.size());
            glm::vec3 v[3];
            for (int k = 0; k < 3; ++k)
                v[k] = soup.view().vertex(receiver, k);
            const double s = random(), t = random() * (1.0 - s);
            const glm::dvec3 a(v[0]), b(v[1]), c(v[2]);
            const glm::vec3 sample(a + (b - a) * s + (c - a) * t);
            const Light light = pointLight(random.inCube(4.0) + glm::vec3(far, 0, -far));
            glm::dvec3 normal = glm::cross(b - a, c - a);
            if (glm::length(normal) == 0.0)
                continue;
            if (glm::dot(normal, glm::dvec3(light.positionWorld - sample)) < 0.0)
                normal = -normal;
            SegmentFamily family =
                adjudicator.family({sample, glm::vec3(glm::normalize(normal)), receiver}, light);
            if (i % 2 == 0)
                for (PointBox* box : {&family.start, &family.end}) {
                    box->low -= glm::dvec3(0.05 * random());
                    box->high += glm::dvec3(0.05 * random());
                }
            const Ruling ruling = adjudicator.rule(family), all = adjudicator.rule(family, false);
            ASSERT_EQ(ruling.verdict, all.verdict) << "seed " << kSeed << ", case " << i;
            ASSERT_EQ(ruling.touchedCount, all.touchedCount) << "seed " << kSeed << ", case " << i;
            ++counts[size_t(ruling.verdict)];
            witnessed += ruling.isWitnessed;
            for (int k = 0; k < 24 && ruling.verdict != Verdict::kAmbiguous; ++k) {
                const glm::dvec3 from = within(family.start, random),
                                 to = within(family.end, random);
                bool isCrossed = false;
                for (uint32_t o = 0; o < soup.triangles.size() && !isCrossed; ++o) {
                    glm::dvec3 other[3];
                    for (int j = 0; j < 3; ++j)
                        other[j] = glm::dvec3(soup.view().vertex(o, j));
                    isCrossed = o != receiver && crossesTriangle(from, to, other);
                }
                ASSERT_EQ(isCrossed, ruling.verdict == Verdict::kDark)
                    << "seed " << kSeed << ", case " << i << ", segment " << k;
            }
        }
        EXPECT_GT(counts[size_t(Verdict::kLit)], 200u);
        EXPECT_GT(counts[size_t(Verdict::kDark)], 200u);
        EXPECT_GT(counts[size_t(Verdict::kAmbiguous)], 100u);
        EXPECT_GT(witnessed, counts[size_t(Verdict::kAmbiguous)] / 3);
    }
}

TEST(Adjudicator, FamiliesContainTheRaysThatTheTruthMakes) {
    RecordProperty("seed", std::to_string(kSeed));
    // At 11 the coordinates are as large as they get in a local frame: no axis is moved to its
    // middle.
    for (const glm::vec3& place : {glm::vec3(0, 0, 0), glm::vec3(40, 12, -40),
                                   glm::vec3(3000, 900, -3000), glm::vec3(11, 11, -11)}) {
        const TriangleSoup soup = soupAt(place, kSeed + 2);
        const Adjudicator adjudicator(soup.view());
        const Truth truth(soup.view());
        Random random(kSeed + 3);
        for (int i = 0; i < 20000; ++i) {
            const uint32_t receiver = random.below(soup.triangles.size());
            glm::dvec3 v[3];
            for (int k = 0; k < 3; ++k)
                v[k] = glm::dvec3(soup.view().vertex(receiver, k));
            glm::dvec3 normal = glm::cross(v[1] - v[0], v[2] - v[0]);
            if (glm::length(normal) == 0.0)
                continue;
            double s = random(), t = random() * (1.0 - s);
            if (i % 4 == 0) // near an edge or a corner
                s *= 1e-6;
            if (i % 8 == 0)
                t *= 1e-6;
            const glm::vec3 sample(v[0] + (v[1] - v[0]) * s + (v[2] - v[0]) * t);
            Light light = pointLight(random.inCube(8.0) + place);
            if (i % 16 == 1) // grazing
                light.positionWorld = glm::vec3(v[0] + (v[1] - v[0]) * 2.0);
            if (i % 16 == 2) { // directional, beyond the scene
                light.kind = Light::kSun;
                light.directionWorld = glm::normalize(random.inCube(1.0));
                light.directionalDistanceWorld = 64.0f;
            }
            const glm::vec3 at = pointAtLight(light, sample);
            if (glm::dot(normal, glm::dvec3(at) - glm::dvec3(sample)) < 0.0)
                normal = -normal;
            const glm::vec3 unit(glm::normalize(normal));
            const SegmentFamily family = adjudicator.family({sample, unit, receiver}, light);
            const TruthRay ray = truth.pairRay(sample, unit, receiver, at);
            const glm::dvec3 start = glm::dvec3(ray.startLocal) + truth.originWorld();
            const glm::dvec3 end = start + glm::dvec3(ray.direction) * double(ray.tFar);
            if (ray.tFar > 0.0f) {
                ASSERT_TRUE(family.mayBeAsked);
            } else {
                ASSERT_FALSE(family.isSurelyAsked);
                continue;
            }
            for (int a = 0; a < 3; ++a) {
                ASSERT_GE(start[a], family.start.low[a]) << "case " << i << ", axis " << a;
                ASSERT_LE(start[a], family.start.high[a]) << "case " << i << ", axis " << a;
                ASSERT_GE(end[a], family.end.low[a]) << "case " << i << ", axis " << a;
                ASSERT_LE(end[a], family.end.high[a]) << "case " << i << ", axis " << a;
            }
        }
    }
}

TEST(Adjudicator, MasksAreOpaqueOpenOrAmbiguous) {
    TriangleSoup soup;
    AlphaMaskSet masks;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    AlphaMask mask = makeAlphaMask(2, 1); // the left half is opaque
    setOpaque(mask, 0, 0);
    const uint32_t index = masks.add(mask);
    masks.triangleCut.assign(soup.triangles.size(), kNotCut);
    soup.addLevelSquare({0, 1, 0}, 1.0f);
    for (size_t t = 2; t < soup.triangles.size(); ++t) {
        CutTriangle cut{index, {}};
        for (int corner = 0; corner < 3; ++corner) {
            const glm::vec3 p = soup.view().vertex(t, corner);
            cut.uv[corner] = (glm::vec2(p.x, p.z) + 1.0f) * 0.5f;
        }
        masks.triangleCut.push_back(uint32_t(masks.cuts.size()));
        masks.cuts.push_back(cut);
    }
    TriangleView view = soup.view();
    view.masks = masks.view();
    const Adjudicator adjudicator(view);
    const Light light = pointLight({0, 2, 0});
    const auto verdictAt = [&](double x, double z) { // of the segment through (x, 1, z)
        return adjudicator.rule(below({x, 1, z}, light, soup), light).verdict;
    };
    EXPECT_EQ(verdictAt(-0.5, 0.25), Verdict::kDark);
    EXPECT_EQ(verdictAt(-0.5, -0.5), Verdict::kDark) << "through the edge that two share";
    EXPECT_EQ(verdictAt(0.5, 0.25), Verdict::kLit) << "through the hole";
    EXPECT_EQ(verdictAt(0.0, 0.25), Verdict::kAmbiguous) << "through the border of a texel";
    EXPECT_EQ(verdictAt(-1.0, 0.25), Verdict::kAmbiguous) << "through the border of the board";
    EXPECT_EQ(verdictAt(1.0, 0.25), Verdict::kLit) << "through that of its open half";
}

TEST(Adjudicator, AReceiverWithoutAPlaneIsAmbiguousHoweverManyTrianglesThereAre) {
    TriangleSoup soup;
    const uint32_t sliver = soup.add({0, 0, 0}, {1, 0, 0}, {2, 0, 1e-30f});
    Random random(kSeed);
    for (int i = 0; i < 5000; ++i) {
        const glm::vec3 at = random.inCube(8.0);
        soup.add(at, at + random.inCube(0.1), at + random.inCube(0.1));
    }
    const Adjudicator adjudicator(soup.view());
    const Ruling ruling =
        adjudicator.rule({{0.5f, 0, 0}, {0, 1, 0}, sliver}, pointLight({0, 4, 0}));
    EXPECT_EQ(ruling.verdict, Verdict::kAmbiguous);
    EXPECT_GT(ruling.touchedCount, 500u);
    EXPECT_LT(ruling.touchedCount, 600u);
}

TEST(Adjudicator, ALightWithinTheClearanceIsLitAndASceneWithoutTrianglesToo) {
    TriangleSoup soup;
    soup.addLevelSquare(glm::vec3(0.0f), 8.0f);
    const Adjudicator adjudicator(soup.view());
    EXPECT_EQ(adjudicator.rule({{0, 0, 0.5f}, {0, 1, 0}, 0}, pointLight({0, 1e-6f, 0.5f})).verdict,
              Verdict::kLit);
    EXPECT_EQ(Adjudicator(TriangleView{}).rule(exactSegment({0, 0, 0}, {1, 1, 1})).verdict,
              Verdict::kLit);
}

} // namespace
} // namespace shadowdag::test
