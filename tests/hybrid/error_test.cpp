// SPDX-License-Identifier: Apache-2.0
// The judge judged: frames built by hand in which every verdict is known.
#include "hybrid/error.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "hybrid/explain.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

namespace shadowdag {
namespace {

using test::pointLight;
using test::SampleRow;
using test::TriangleSoup;

/// Returns the DAG of a list of voxels, by the layout of dag.h, without merging (nothing here needs
/// it).
uint32_t addNode(std::vector<uint32_t>& words, const std::vector<glm::uvec3>& voxels,
                 const glm::uvec3& corner, uint32_t level) {
    const auto inside = [](const glm::uvec3& v, const glm::uvec3& c, uint32_t l) {
        return v.x >> l == c.x >> l && v.y >> l == c.y >> l && v.z >> l == c.z >> l;
    };
    if (level == kLeafLog2) {
        uint64_t bits = 0;
        for (const glm::uvec3& v : voxels)
            if (inside(v, corner, level)) {
                const uint32_t o = (v.x >> 1 & 1) | (v.y >> 1 & 1) << 1 | (v.z >> 1 & 1) << 2;
                const uint32_t s = (v.x & 1) | (v.y & 1) << 1 | (v.z & 1) << 2;
                bits |= 1ull << (8 * o + s);
            }
        words.push_back(uint32_t(bits));
        words.push_back(uint32_t(bits >> 32));
        return uint32_t(words.size() - 2);
    }
    uint32_t mask = 0;
    std::vector<uint32_t> children;
    for (uint32_t c = 0; c < 8; ++c) {
        const glm::uvec3 child = corner + (glm::uvec3(c & 1, c >> 1 & 1, c >> 2) << (level - 1));
        bool isThere = false;
        for (const glm::uvec3& v : voxels)
            isThere |= inside(v, child, level - 1);
        if (isThere) {
            mask |= 1u << c;
            children.push_back(addNode(words, voxels, child, level - 1));
        }
    }
    const auto address = uint32_t(words.size());
    words.push_back(mask);
    words.insert(words.end(), children.begin(), children.end());
    return address;
}

Dag makeDag(uint32_t resolutionLog2, const std::vector<glm::uvec3>& voxels) {
    Dag dag;
    dag.grid.resolutionLog2 = resolutionLog2;
    if (!voxels.empty())
        dag.rootAddress = addNode(dag.words, voxels, glm::uvec3(0), resolutionLog2);
    return dag;
}

/// Samples and lights of one pair each, and the method's and the truth's answers.
struct HandFrame {
    TriangleSoup soup;
    SampleRow row;
    std::vector<Light> lights;
    PairList pairs;
    std::vector<uint8_t> visibility;
    std::vector<Route> route;
    std::vector<int> pairMap;
    Dag dag;
    std::vector<ShadowMapInfo> maps;
    std::vector<uint32_t> pageTable, depths;
    uint32_t pageTexelsLog2 = 4;
    RayOptions rays;
    ShadowMapBias bias{0.0f, 1};

    HandFrame() { pairs.sampleStart.push_back(0); }
    void add(const glm::vec3& sample, const glm::vec3& light, uint32_t receiver, int map = -1) {
        row.add(sample, {0, 1, 0}, receiver);
        pairs.light.push_back(uint32_t(lights.size()));
        pairs.sampleStart.push_back(pairs.light.size());
        lights.push_back(pointLight(light));
        pairMap.push_back(map);
        route.push_back(map < 0 ? Route::kRays : Route::kMap);
    }
    ErrorInputs inputs() const {
        return {row.view(),
                soup.view(),
                viewOf(lights),
                pairs,
                visibility,
                route,
                pairMap,
                {RayInputs{dag.view(), rays},
                 {viewOf(maps), viewOf(pageTable), viewOf(depths), pageTexelsLog2},
                 bias}};
    }
    /// Asks the method, as the shading pass does.
    void answer() {
        VisibilityCounts counts;
        visibility.clear();
        for (size_t i = 0; i < lights.size(); ++i)
            visibility.push_back(answerPair(inputs().method, pairMap[i], uint32_t(i), lights[i],
                                            row.position[i], row.normal[i], row.triangle[i],
                                            counts));
    }
    ErrorReport judge(std::vector<uint8_t>* truthVisibility = nullptr, uint64_t seed = 1) const {
        const Truth truth(soup.view());
        const std::vector<uint8_t> right = truth.visibility(row.view(), lights, pairs);
        if (truthVisibility)
            *truthVisibility = right;
        ErrorOptions options;
        options.seed = seed;
        options.nullSampleCount = 500;
        return computeError(inputs(), truth, right, options);
    }
};

/// Voxels of 1 m, a floor at y = 0.5 and lights straight above the samples at y = 60. Eight pairs,
/// one of each kind.
HandFrame makeVoxelFrame() {
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    const auto pairAt = [&](float x, float z) { f.add({x, 0.5f, z}, {x, 60, z}, z >= x ? 0 : 1); };
    pairAt(5.5f, 10.5f);  // 0: nothing in between
    pairAt(17.5f, 10.5f); // 1: a plate just beside the ray shares its voxel
    f.soup.addLevelSquare({15.2f, 30.5f, 10.5f}, 2.2f);
    pairAt(29.5f, 10.5f); // 2: a voxel that nothing is in
    pairAt(41.5f, 10.5f); // 3: a plate 0.7 m over the floor, below the lifted start
    f.soup.addLevelSquare({41.5f, 1.2f, 10.5f}, 1.0f);
    pairAt(53.5f, 10.5f); // 4: a plate without voxels, wider than any shift
    f.soup.addLevelSquare({53.5f, 30.5f, 10.5f}, 3.5f);
    pairAt(5.5f, 40.5f); // 5: a plate without voxels, narrower than most shifts
    f.soup.addLevelSquare({5.5f, 30.5f, 40.5f}, 1.0f);
    pairAt(17.5f, 40.5f); // 6: a plate 1 m under the light, nearer than sqrt(3) voxels
    f.soup.addLevelSquare({17.5f, 59.0f, 40.5f}, 4.0f);
    pairAt(29.5f, 40.5f); // 7: a plate with its voxel
    f.soup.addLevelSquare({29.5f, 30.5f, 40.5f}, 3.5f);
    f.dag = makeDag(6, {{17, 30, 10}, {29, 30, 10}, {29, 30, 40}});
    f.answer();
    return f;
}

TEST(Error, VoxelPairsOfEveryKindAreToldApart) {
    const HandFrame f = makeVoxelFrame();
    std::vector<uint8_t> truthVisibility;
    const ErrorReport report = f.judge(&truthVisibility);
    EXPECT_EQ(f.visibility, (std::vector<uint8_t>{255, 0, 0, 255, 255, 255, 255, 0}));
    EXPECT_EQ(truthVisibility, (std::vector<uint8_t>{255, 255, 255, 0, 0, 0, 0, 0}));
    using V = PairVerdict;
    EXPECT_EQ(report.verdicts,
              (std::vector<V>{V::kRight, V::kExplained, V::kUnexplained, V::kContact,
                              V::kUnexplained, V::kExplained, V::kContact, V::kRight}));
    EXPECT_EQ(report.total.pairCount, 8u);
    EXPECT_EQ(report.total.occludedCount, 5u);
    EXPECT_EQ(report.total.falseShadowCount, 2u);
    EXPECT_EQ(report.total.falseLightCount, 4u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseLightCount, 1u);
    EXPECT_EQ(report.total.acneCount, 0u);
    EXPECT_EQ(report.total.contactCount, 2u);
    EXPECT_DOUBLE_EQ(report.total.absVisibilityErrorSum, 6.0);
    EXPECT_DOUBLE_EQ(report.total.meanAbsVisibilityError(), 0.75);
    EXPECT_EQ(report.visibilityHistogram[255], 5u);
    EXPECT_EQ(report.visibilityHistogram[0], 3u);
    // Of the two right pairs neither has an edge within a shift.
    EXPECT_EQ(report.nullRate, 0.0);
    EXPECT_EQ(report.nullSampleCount, 500u);
}

TEST(Error, CountsPerLightAddUpToTheTotal) {
    const HandFrame f = makeVoxelFrame();
    const ErrorReport report = f.judge();
    ASSERT_EQ(report.perLight.size(), 8u);
    ErrorCounts sum;
    for (size_t l = 0; l < 8; ++l) {
        EXPECT_EQ(report.perLight[l].pairCount, 1u);
        sum.add(report.perLight[l]);
    }
    EXPECT_EQ(report.perLight[2].unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.perLight[4].unexplainedFalseLightCount, 1u);
    EXPECT_EQ(report.perLight[6].contactCount, 1u);
    EXPECT_EQ(sum.falseLightCount, report.total.falseLightCount);
    EXPECT_EQ(sum.absVisibilityErrorSum, report.total.absVisibilityErrorSum);
}

TEST(Error, ABlockerBeyondTheOffsetIsNoContactThoughAnotherIsNear) {
    HandFrame f = makeVoxelFrame();
    // Over the contact pair 3 hangs a second plate, wide and without voxels.
    f.soup.addLevelSquare({41.5f, 30.5f, 10.5f}, 4.0f);
    f.answer();
    EXPECT_EQ(f.judge().verdicts[3], PairVerdict::kUnexplained);
}

TEST(Error, NullRateCountsRightAnswersNearAnEdge) {
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.soup.addLevelSquare({42.5f, 30.5f, 32}, 10.0f); // its edge is at x = 32.5
    f.dag = makeDag(6, {{50, 60, 50}});
    // A shift is at most sqrt(3) + 1 voxels and a little: 2 m beside the edge flips, 3 m does not.
    f.add({30.5f, 0.5f, 32}, {30.5f, 60, 32}, 0);
    f.add({29.5f, 0.5f, 32}, {29.5f, 60, 32}, 0);
    f.answer();
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount + report.total.falseLightCount, 0u);
    EXPECT_NEAR(report.nullRate, 0.5, 0.1);
}

TEST(Error, ShiftsBelowTheReceiversPlaneAreLiftedBack) {
    // At slanting light half of the shifts push the start under the floor, whose other triangle
    // would stop them.
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.dag = makeDag(6, {{60, 60, 2}});
    f.add({20, 0.5f, 20.1f}, {55, 20, 50}, 0);
    f.answer();
    ASSERT_EQ(f.visibility[0], kLit);
    EXPECT_EQ(f.judge().nullRate, 0.0);
}

TEST(Error, SpecksThatTheShiftsMissAreSettledByAnAimedOne) {
    // A speck of 1 cm in a voxel of 1 m that the ray crosses; the 32 shifts over a disc of more
    // than 20 square metres miss it, a shift aimed at it does not. Beside it an empty voxel.
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.soup.addLevelSquare({20.9f, 30.5f, 20.5f}, 0.01f);
    f.dag = makeDag(6, {{20, 30, 20}, {40, 30, 40}});
    f.add({20.3f, 0.5f, 20.4f}, {20.3f, 60, 20.4f}, 1);
    f.add({40.5f, 0.5f, 40.5f}, {40.5f, 60, 40.5f}, 0);
    f.answer();
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.verdicts,
              (std::vector<PairVerdict>{PairVerdict::kSettled, PairVerdict::kUnexplained}));
    EXPECT_EQ(report.total.settledFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 2u);
}

TEST(Error, HitsInTheReceiversOwnVoxelsAreAcne) {
    HandFrame f;
    f.rays.offset = 0.0f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f); // triangle 0: z >= x
    const auto pairAt = [&](float x, float z, float lightX) {
        f.add({x, 0.5f, z}, {lightX, 60.5f, z}, z >= x ? 0 : 1);
    };
    pairAt(5.5f, 10.5f, 5.5f); // 0: stopped by its own triangle's voxel
    pairAt(20.5f, 21.5f,
           20.5f); // 1: stopped by a voxel that only the coplanar neighbour touches, see below
    pairAt(40.5f, 50.5f, 40.5f); // 2: stopped by an empty voxel far above
    f.dag = makeDag(6, {{5, 0, 10}, {40, 30, 50}, {22, 0, 21}});
    // The ray of pair 1 leans over the diagonal: at y = 0.75 it is at x = 22.0 .. in voxel 22,
    // whose cell lies wholly at x > z.
    f.lights[1].positionWorld = {20.5f + 240.0f * 1.75f, 60.5f, 21.5f};
    f.lights[1].rangeWorld = 1e9f;
    f.answer();
    ASSERT_EQ(f.visibility, (std::vector<uint8_t>{0, 0, 0}));
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount, 3u);
    EXPECT_EQ(report.total.acneCount, 2u);
    EXPECT_EQ(report.verdicts[0], PairVerdict::kAcne);
    EXPECT_EQ(report.verdicts[1], PairVerdict::kAcne);
    EXPECT_EQ(report.verdicts[2], PairVerdict::kUnexplained);
}

/// A map of 16 x 16 texels a face around (0, 10, 0), a floor at y = 0: texels of 1.25 m on it.
/// Empty but for what tests put in.
struct MapFrame : HandFrame {
    static constexpr uint32_t kTexels = 16;

    MapFrame() {
        soup.addLevelSquare({0, 0, 0}, 9.9f);
        maps.push_back({{0, 10, 0}, 100.0f, kTexels, 1, 0});
        for (uint32_t face = 0; face < 6; ++face)
            pageTable.push_back(face);
        depths.assign(6 * kTexels * kTexels, 0);
        dag = makeDag(6, {});
    }
    /// Returns the texel of the face towards -Y that looks at (x, 0, z); u runs along z and v along
    /// x.
    uint32_t texel(float x, float z) const {
        const auto cell = [](float s) { return uint32_t((s / 10.0f + 1.0f) * 8.0f); };
        return 3 * kTexels * kTexels + cell(x) * kTexels + cell(z);
    }
    void addPair(float x, float z) { add({x, 0, z}, {0, 10, 0}, z >= x ? 0 : 1, 0); }
    /// Stores a surface at depth z below the light.
    void store(float x, float z, float depth) {
        const float w = 1.0f / depth;
        memcpy(&depths[texel(x, z)], &w, sizeof w);
    }
};

TEST(Error, MapPairsOfEveryKindAreToldApart) {
    MapFrame f;
    f.bias.constantTexels = 0.0f;
    f.addPair(-6.0f, -6.0f); // 0: an empty texel under an open sky
    f.addPair(-6.0f, 1.0f);  // 1: the floor itself, drawn 0.1 m too near
    f.store(-6.0f, 1.0f, 9.9f);
    f.addPair(1.0f, -6.0f); // 2: a surface that is not there, at half height
    f.store(1.0f, -6.0f, 5.0f);
    f.addPair(6.0f, 6.0f); // 3: a plate beside the ray (at (3, 5, 3)) that its texel sees; texels
                           // are 0.625 m there
    f.store(6.0f, 6.0f, 5.0f);
    f.soup.addLevelSquare({3.45f, 5.0f, 3.45f}, 0.4f);
    f.addPair(6.0f, -3.0f); // 4: a wide plate, drawn right
    f.store(6.0f, -3.0f, 5.0f);
    f.soup.addLevelSquare({3.0f, 5.0f, -1.5f}, 1.0f);
    f.addPair(-3.0f, 6.0f); // 5: a wide plate that the map lacks
    f.soup.addLevelSquare({-1.5f, 5.0f, 3.0f}, 1.0f);
    f.addPair(-7.0f, -2.0f); // 6: the same, narrower than a texel
    f.soup.addLevelSquare({-3.5f, 5.0f, -1.0f}, 0.3f);
    f.answer();
    std::vector<uint8_t> truthVisibility;
    const ErrorReport report = f.judge(&truthVisibility);
    EXPECT_EQ(f.visibility, (std::vector<uint8_t>{255, 0, 0, 0, 0, 255, 255}));
    EXPECT_EQ(truthVisibility, (std::vector<uint8_t>{255, 255, 255, 255, 0, 0, 0}));
    using V = PairVerdict;
    EXPECT_EQ(report.verdicts, (std::vector<V>{V::kRight, V::kAcne, V::kUnexplained, V::kExplained,
                                               V::kRight, V::kUnexplained, V::kExplained}));
    EXPECT_EQ(report.total.acneCount, 1u);
    EXPECT_EQ(report.total.contactCount, 0u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseLightCount, 1u);
}

TEST(Error, ABlockerCloseOverTheFloorIsNoAcne) {
    MapFrame f;
    f.bias.constantTexels = 0.0f;
    f.addPair(0.4f, 0.4f); // its texel is [0, 1.25]^2 with centre (0.625, 0.625)
    f.store(0.4f, 0.4f, 9.9f);
    f.soup.addLevelSquare({1.0f, 0.1f, 1.0f}, 0.5f); // over the centre, not over the sample
    f.answer();
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kExplained);
}

TEST(Error, BlockersWithinTheMapsBiasAreContact) {
    for (const float height : {1.0f, 2.0f}) { // the bias is one texel, 1.25 m
        MapFrame f;
        f.bias.constantTexels = 1.0f;
        f.addPair(0.4f, 0.4f);
        f.soup.addLevelSquare({0, height, 0}, 5.0f);
        f.answer();
        EXPECT_EQ(f.judge().verdicts[0],
                  height < 1.25f ? PairVerdict::kContact : PairVerdict::kUnexplained);
    }
}

TEST(Error, BlockersBeforeTheMapsBiasAreNoContactHoweverLowTheLight) {
    // The light is 10 m over the floor, 80 m away: a texel and with it the bias is 10 m there, all
    // of the light's height. The wall is drawn in neither case.
    for (const float x : {72.0f, 60.0f}) {
        MapFrame f;
        f.bias.constantTexels = 1.0f;
        f.soup.addLevelSquare({0, 0, 0}, 200.0f);
        f.add({80, 0, 0.1f}, {0, 10, 0}, 3, 0);
        f.soup.addQuad({x, -1, -90}, {x, 30, -90}, {x, 30, 90}, {x, -1, 90});
        f.answer();
        ASSERT_EQ(f.visibility[0], kLit);
        EXPECT_EQ(f.judge().verdicts[0],
                  x > 70.0f ? PairVerdict::kContact : PairVerdict::kUnexplained);
    }
}

TEST(Error, LightByATapsRayThatTheShiftsMissIsSettledByTheTruthAlongIt) {
    // A plate over the whole filter but for a pinhole of 2 cm around a texel's centre, 5 m below
    // the light, where a texel is 0.625 m. The map is right about that texel, and nothing else
    // agrees.
    const auto judged = [](bool hasHole, bool isDrawn) {
        MapFrame f;
        f.bias.constantTexels = 0.0f;
        f.addPair(0.4f,
                  0.5f); // its texel is [0, 1.25]^2, whose centre's ray is at (0.3125, 5, 0.3125)
        const glm::vec3 hole(0.3125f, 5.0f, 0.3125f);
        const float in = hasHole ? 0.01f : 0.0f;
        const glm::vec4 parts[4] = {// x0, x1, z0, z1 around the hole
                                    {-4, -in, -4, 4},
                                    {in, 4, -4, 4},
                                    {-in, in, -4, -in},
                                    {-in, in, in, 4}};
        for (const glm::vec4& p : parts)
            if (p.x < p.y)
                f.soup.addQuad(hole + glm::vec3(p.x, 0, p.z), hole + glm::vec3(p.y, 0, p.z),
                               hole + glm::vec3(p.y, 0, p.w), hole + glm::vec3(p.x, 0, p.w));
        if (isDrawn)
            f.store(0.4f, 0.5f, 5.0f);
        f.answer();
        const ErrorReport report = f.judge();
        EXPECT_EQ(report.total.settledFalseLightCount,
                  report.verdicts[0] == PairVerdict::kSettled ? 1u : 0u);
        EXPECT_EQ(report.total.unexplainedFalseLightCount, report.total.falseLightCount);
        return report.verdicts[0];
    };
    EXPECT_EQ(judged(true, false), PairVerdict::kSettled);
    EXPECT_EQ(judged(false, false), PairVerdict::kUnexplained); // a plate that the map lost
    EXPECT_EQ(judged(false, true), PairVerdict::kRight);
}

TEST(Error, LightThatOnlyTheBiasOnATapsRayLetsThroughIsContact) {
    // The pair's ray meets the low wall at x = 17, beyond the bias, an eighth of the ray. Its
    // texel's ray is flatter, passes over that wall and meets the high one at x = 19, within the
    // bias, and so do all shifted rays.
    MapFrame f;
    f.bias.constantTexels = 1.0f;
    f.soup.addLevelSquare({0, 0, 0}, 200.0f);
    f.add({20.2f, 0, 0.1f}, {0, 10, 0}, 3, 0);
    f.soup.addQuad({17, -1, -90}, {17, 1.9f, -90}, {17, 1.9f, 90}, {17, -1, 90});
    f.soup.addQuad({19, -1, -90}, {19, 90, -90}, {19, 90, 90}, {19, -1, 90});
    f.answer();
    ASSERT_EQ(f.visibility[0], kLit);
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kContact);
}

TEST(Error, DarknessForWantOfPagesIsNeverExplained) {
    MapFrame f;
    f.addPair(0.4f, 0.4f);
    f.soup.addLevelSquare({3.0f, 5.0f, 0.2f}, 2.6f); // near enough for a shift of a few texels
    f.pageTable[3] = kNoPage;
    f.answer();
    ASSERT_EQ(f.visibility[0], 0);
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kUnexplained);
}

TEST(Error, FractionalVisibilityIsDarkUnderOneHalf) {
    HandFrame f = makeVoxelFrame();
    f.visibility = {128, 127, 255, 0, 51, 255, 255, 0}; // by the truth: 3 lit, then 5 dark
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount, 1u);
    EXPECT_EQ(report.total.falseLightCount, 2u);
    EXPECT_NEAR(report.total.absVisibilityErrorSum, (127 + 128 + 0 + 0 + 51 + 255 + 255) / 255.0,
                1e-12);
    EXPECT_EQ(report.visibilityHistogram[51], 1u);
    EXPECT_EQ(report.visibilityHistogram[127], 1u);
}

TEST(Error, ReportsDependNeitherOnThreadsNorOnTheRun) {
    const HandFrame f = makeVoxelFrame();
    setThreadCount(1);
    const ErrorReport one = f.judge(nullptr, 7);
    setThreadCount(4);
    const ErrorReport four = f.judge(nullptr, 7);
    setThreadCount(0);
    EXPECT_EQ(one.verdicts, four.verdicts);
    EXPECT_EQ(one.nullRate, four.nullRate);
}

TEST(Error, MissingAnswersAreRefused) {
    HandFrame f = makeVoxelFrame();
    f.visibility.pop_back();
    try {
        f.judge();
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(e.what()).find("recordPairs"), std::string::npos) << e.what();
    }
}

TEST(Error, NoPairsGiveAnEmptyReport) {
    HandFrame f;
    f.soup.addLevelSquare({0, 0, 0}, 1.0f);
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.pairCount, 0u);
    EXPECT_EQ(report.total.meanAbsVisibilityError(), 0.0);
    EXPECT_EQ(report.nullRate, 0.0);
}

TEST(Shifts, FillTheDiscToItsRim) {
    for (const uint64_t seed : {1u, 2u, 99u}) {
        const auto shifts = makeShifts(seed);
        int rimCount = 0, quadrantCount[4] = {};
        for (const glm::dvec2& s : shifts) {
            EXPECT_LE(glm::length(s), 1.0 + 1e-12);
            rimCount += glm::length(s) > 1.0 - 1e-9;
            ++quadrantCount[(s.x > 0) + 2 * (s.y > 0)];
        }
        EXPECT_EQ(rimCount, 8);
        for (const int count : quadrantCount) {
            EXPECT_GE(count, 6);
            EXPECT_LE(count, 10);
        }
        // No point of the disc is farther than 0.4 from a shift.
        for (double x = -1; x <= 1; x += 0.05)
            for (double y = -1; y <= 1; y += 0.05) {
                if (x * x + y * y > 1)
                    continue;
                double nearest = 9;
                for (const glm::dvec2& s : shifts)
                    nearest = std::min(nearest, glm::length(s - glm::dvec2(x, y)));
                EXPECT_LT(nearest, 0.4) << x << " " << y;
            }
    }
    EXPECT_NE(makeShifts(1)[0], makeShifts(2)[0]);
}

} // namespace
} // namespace shadowdag
