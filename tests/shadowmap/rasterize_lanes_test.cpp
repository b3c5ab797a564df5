// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/directional_window.h"
#include "shadowmap/face_vertices_lanes.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

#if defined(SDAG_RASTERIZE_AVX2)

// Small whole numbers and no tolerance put the ends of rows exactly on texel centres, where a
// quotient rounds to either side: guesses are wrong there, and must be found out.
TEST(RasterizeLanes, RowsEndAsInTheSharedCode) {
    const uint32_t seed = 5;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    const auto whole = [&](int limit) {
        return double(std::uniform_int_distribution<int>(-limit, limit)(rng));
    };
    size_t covered = 0;
    for (int trial = 0; trial < 200000; ++trial) {
        const int32_t n = 1 + int32_t(rng() % 100);
        FaceTriangle t{};
        double rEx[3];
        for (int k = 0; k < 3; ++k) {
            t.ex[k] = whole(49);
            t.ey[k] = whole(49);
            t.e0[k] = whole(49 * n);
            t.tolerance[k] = trial % 3 ? 0.0 : 0.5;
            if (trial % 2) { // one edge across the rows, on a centre or between two
                t.ex[k] = k ? 0.0 : t.ex[k];
                t.ey[k] = 0.0;
                t.e0[k] = k ? 1.0 : t.ex[k] * whole(n);
            }
            rEx[k] = 1.0 / t.ex[k];
        }
        t.x0 = int32_t(rng() % uint32_t(n));
        t.x1 = t.x0 + int32_t(rng() % uint32_t(n - t.x0));
        const int32_t y = int32_t(rng() % uint32_t(n));
        const uint32_t edges = trial % 5 ? 7u : rng() % 8; // the others count as met everywhere
        avx2::RowSpans spans;
        avx2::spanRows(t, rEx, y, n, t.x0, t.x1, edges, spans);
        for (int i = 0; i < 4; ++i) {
            int32_t first = t.x0, last = t.x1;
            for (int k = 0; k < 3; ++k)
                if (edges >> k & 1u)
                    narrowSpan(t.ex[k], t.ey[k] * double(2 * (y + i) + 1 - n) + t.e0[k],
                               t.tolerance[k], rEx[k], n, first, last);
            const bool isEmpty = first > last;
            ASSERT_EQ(spans.first[i] > spans.last[i], isEmpty) << trial;
            if (isEmpty)
                continue;
            ASSERT_EQ(spans.first[i], first) << trial;
            ASSERT_EQ(spans.last[i], last) << trial;
            covered += size_t(last - first + 1);
        }
    }
    EXPECT_GT(covered, 1000000u);
}

TEST(RasterizeLanes, SetupEqualsTheSharedCodeBitForBit) {
    const uint32_t seed = 6;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    const ShadowMapInfo map{{0.1f, 0.2f, -0.3f}, 8.0f, 200, 4, 0};
    size_t ready = 0, left = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const test::SmallScene scene =
            test::randomScene(rng, 4, 2.0f, std::exp2(-float(trial % 12)) * 2.0f);
        const uint32_t triangles[4] = {0, 1, 2, 3};
        const uint32_t face = uint32_t(trial) % kFaceCount;
        avx2::Lanes3 corners[3];
        for (int corner = 0; corner < 3; ++corner)
            corners[corner] =
                avx2::faceFromWorld(avx2::vertices(scene.view(), triangles, corner), map, face);
        FaceTriangle four[4];
        uint32_t crossing = 0;
        const uint32_t set =
            avx2::setUpTriangles(corners[0], corners[1], corners[2], map, 15, crossing, four);
        ASSERT_EQ(set & crossing, 0u);
        for (uint32_t lane = 0; lane < 4; ++lane) {
            glm::dvec3 p[3];
            for (int corner = 0; corner < 3; ++corner)
                p[corner] = faceFromLight(face, cornerFromLight(scene.view(), lane, corner, map));
            FaceTriangle t;
            const bool isSet = setUpTriangle(p[0], p[1], p[2], map, t);
            if (crossing >> lane & 1u) {
                left += isSet;
                continue;
            }
            ASSERT_EQ(set >> lane & 1u, isSet) << trial;
            if (!isSet)
                continue;
            ++ready;
            const FaceTriangle& own = four[lane];
            ASSERT_EQ(memcmp(own.ex, t.ex, 4 * sizeof(double)), 0);
            ASSERT_EQ(memcmp(own.ey, t.ey, 4 * sizeof(double)), 0);
            ASSERT_EQ(memcmp(own.e0, t.e0, 4 * sizeof(double)), 0);
            ASSERT_EQ(memcmp(own.tolerance, t.tolerance, 3 * sizeof(double)), 0);
            ASSERT_EQ(own.wMin, t.wMin);
            ASSERT_EQ(own.wMax, t.wMax);
            ASSERT_LE(t.wMax, t.wNear); // why the lanes do not test the near plane
            ASSERT_EQ(memcmp(&own.x0, &t.x0, 4 * sizeof(int32_t)), 0);
        }
    }
    EXPECT_GT(ready, 5000u);
    EXPECT_GT(left, 500u);
}

/// A face of a map whose pages have memory or not, and hold anything.
struct RandomFace {
    ShadowMapInfo map{};
    uint32_t face = 0;
    std::vector<uint32_t> pageTable, depths;
    std::vector<PageFloor> floors;
    RasterView view{};

    /// @param isLargest has 8192 texels a side, and memory for few of them
    RandomFace(std::mt19937& rng, bool isDirectional, bool isLargest) {
        const uint32_t log2 = isLargest ? 8 : 4 + rng() % 2;
        map.faceTexels = isDirectional ? 64u << rng() % 3 : isLargest ? 8192 : 1 + rng() % 500;
        if (isDirectional) {
            const Light light = sun(rng);
            const DirectionalFrame frame = makeDirectionalFrame(light);
            DirectionalRect rect;
            rect.add(frame, {glm::vec3(-0.5f), glm::vec3(0.5f)});
            const FittedWindow fit = fitDirectionalWindow(frame, rect, 16, map.faceTexels);
            map.window = fit.window;
            map.faceTexels = fit.faceTexels;
            face = kDirectionalFace;
        } else {
            map.lightPositionWorld = test::randomDirection(rng) * 0.5f;
            map.rangeWorld = 8.0f;
            face = rng() % kFaceCount;
        }
        map.facePages = (map.faceTexels + (1u << log2) - 1) >> log2;
        const uint32_t pageTexels = 1u << (2 * log2);
        for (uint32_t i = 0; i < kFaceCount * map.facePages * map.facePages; ++i) {
            const bool hasMemory = isLargest ? rng() % 128 == 0 : rng() % 3 != 0;
            pageTable.push_back(hasMemory ? uint32_t(floors.size()) : kNoPage);
            floors.resize(floors.size() + hasMemory);
        }
        std::uniform_real_distribution<float> stored(0.0f, 4.0f);
        for (PageFloor& floor : floors) {
            floor = {0xffffffffu, 0};
            const float around = stored(rng);
            for (uint32_t t = 0; t < pageTexels; ++t) {
                depths.push_back(floatBits(around + 0.4f * float(t * 0x9e3779b9u >> 8) * 0x1p-24f));
                floor.least = std::min(floor.least, depths.back());
            }
        }
        view.maps = {&map, 1};
        view.pageTable = viewOf(pageTable);
        view.depths = {depths.data(), depths.size()};
        view.pageTexelsLog2 = log2;
    }

    /// Moves points to where the face projects them to the centre of a texel, but for rounding.
    void moveToCentres(std::vector<glm::vec3>& positions) const {
        const auto centreOf = [&](float u) {
            return faceCellCentre(int32_t(faceCell(u, map.faceTexels)), map.faceTexels);
        };
        for (glm::vec3& p : positions) {
            const glm::vec3 q = faceFromLight(face, p - map.lightPositionWorld);
            if (q.z > 0.1f)
                p = map.lightPositionWorld +
                    lightFromFace(face,
                                  q.z * glm::vec3(centreOf(q.x / q.z), centreOf(q.y / q.z), 1.0f));
        }
    }

    static Light sun(std::mt19937& rng) {
        Light light{};
        light.kind = Light::kSun;
        light.directionWorld = test::randomDirection(rng);
        light.rangeWorld = 4.0f;
        return light;
    }
    /// Returns whether a triangle of this set-up could change a texel of its rectangle, as far as
    /// the depths stored there tell.
    bool mayChange(const FaceTriangle& t) const {
        const uint32_t log2 = view.pageTexelsLog2;
        const int32_t side = 1 << log2;
        for (int32_t py = t.y0 >> log2; py <= t.y1 >> log2; ++py)
            for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
                const uint32_t page =
                    pageTable[pageTableIndex(map, face, uint32_t(px), uint32_t(py))];
                if (page == kNoPage)
                    continue;
                for (int32_t y = std::max(t.y0, py * side);
                     y <= std::min(t.y1, py * side + side - 1); ++y)
                    for (int32_t x = std::max(t.x0, px * side);
                         x <= std::min(t.x1, px * side + side - 1); ++x)
                        if (depths[(size_t(page) << (2 * log2)) +
                                   texelInPage(uint32_t(x), uint32_t(y), log2)] < floatBits(t.wMax))
                            return true;
            }
        return false;
    }
};

// What floats leave out could not have changed a texel: every triangle that the doubles set up and
// that could is bounded, within rectangles and depths that hold, and is not called hidden.
TEST(RasterizeLanes, BoundsInFloatsLoseNoTriangle) {
    const uint32_t seed = 8;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    size_t needed = 0, dropped = 0, hidden = 0, crossing = 0;
    for (int trial = 0; trial < 1500; ++trial) {
        const bool isDirectional = trial % 4 == 0;
        const bool isLargest = trial % 25 == 7 && !isDirectional;
        const RandomFace face(rng, isDirectional, isLargest);
        // One batch, of large triangles or of those between texels.
        test::SmallScene scene =
            test::randomScene(rng, 1 + rng() % 100, 1.5f, std::exp2(-float(trial % 10)));
        if (!isDirectional && trial % 3 == 0)
            face.moveToCentres(scene.positions);
        const BatchSet batches = scene.batches();
        const BatchView all = batches.view();
        std::vector<PageFloor> copy = face.floors;
        PageFloors floors({copy.data(), copy.size()});
        FacePages pages(face.view, floors);
        pages.set(face.map, face.face);
        const auto drawn = std::make_unique<avx2::BatchVertices>();
        for (uint32_t b = 0; b < all.batches.count; ++b) {
            const Batch& batch = all.batches[b];
            avx2::projectOnFace(&all.vertices.positions[all.vertices.first[b]],
                                all.vertices.count(b), face.map, face.face, *drawn);
            std::vector<avx2::TexelBounds> bounded;
            for (uint32_t first = 0; first < batch.count; first += 8) {
                avx2::TexelBounds eight[8];
                const uint32_t count =
                    avx2::boundTexelsOfEight(*drawn, &all.vertices.corners[batch.first], first,
                                             std::min(batch.count - first, 8u), pages, eight);
                bounded.insert(bounded.end(), eight, eight + count);
            }
            size_t next = 0;
            for (uint32_t i = 0; i < batch.count; ++i) {
                const avx2::TexelBounds* found = nullptr;
                if (next < bounded.size() && bounded[next].inBatch == i)
                    found = &bounded[next++];
                glm::dvec3 p[3];
                for (int corner = 0; corner < 3; ++corner)
                    p[corner] = faceFromLight(
                        face.face, cornerFromLight(scene.view(), all.triangles[batch.first + i],
                                                   corner, face.map));
                FaceTriangle t;
                const bool isSet = setUpTriangle(p[0], p[1], p[2], face.map, t);
                dropped += !found;
                const bool isHidden = found && avx2::isHidden(pages, *found);
                hidden += isHidden;
                if (!isSet || !face.mayChange(t))
                    continue;
                ++needed;
                ASSERT_NE(found, nullptr) << trial << " triangle " << i;
                ASSERT_FALSE(isHidden) << trial << " triangle " << i;
                ASSERT_LE(found->x0, t.x0);
                ASSERT_LE(found->y0, t.y0);
                ASSERT_GE(found->x1, t.x1);
                ASSERT_GE(found->y1, t.y1);
                ASSERT_GE(found->nearest, floatBits(t.wMax));
                crossing += t.wMax == kLargestInverseDepth;
            }
            ASSERT_EQ(next, bounded.size());
        }
    }
    EXPECT_GT(needed, 5000u);
    EXPECT_GT(dropped, 25000u);
    EXPECT_GT(hidden, 50u);
    EXPECT_GT(crossing, 200u);
}

#else

TEST(RasterizeLanes, NeedAvx2) {
    GTEST_SKIP() << "this build has no AVX2: the one text draws alone";
}

#endif

} // namespace
} // namespace shadowdag
