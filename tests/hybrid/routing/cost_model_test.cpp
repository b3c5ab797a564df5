// SPDX-License-Identifier: Apache-2.0
// Cost models: borders of the threshold, expressions and their errors, replayed costs.
#include "hybrid/routing/cost_model.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace shadowdag::test {
namespace {

using testing::HasSubstr;

std::vector<MapQuantities> mapsOf(const std::vector<float>& texels) {
    std::vector<MapQuantities> maps;
    for (const float t : texels) {
        MapQuantities map;
        map.light = uint32_t(10 * maps.size());
        map.texels = t;
        maps.push_back(map);
    }
    return maps;
}

std::string errorOf(const std::string& model) {
    try {
        makeCostModel(model);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        return error.what();
    }
    return "no error";
}

constexpr Route kRays = Route::kRays, kMap = Route::kMap;
using Routes = std::vector<Route>;

TEST(TexelModel, TracesMapsUnderTheThresholdOnly) {
    const auto maps =
        mapsOf({0.0f, std::nextafter(96.0f, 0.0f), 96.0f, std::nextafter(96.0f, 100.0f), 2000.0f});
    EXPECT_EQ(makeCostModel("texels:96")->route(maps), (Routes{kRays, kRays, kMap, kMap, kMap}));
    EXPECT_EQ(makeCostModel("texels:0")->route(maps), Routes(5, kMap));
    EXPECT_EQ(makeCostModel("texels:inf")->route(maps), Routes(5, kRays));
    EXPECT_EQ(makeCostModel("texels:96.5")->route(maps),
              (Routes{kRays, kRays, kRays, kRays, kMap}));
    EXPECT_FALSE(makeCostModel("texels:96")->needsCosts());
    EXPECT_TRUE(makeCostModel("texels:96")->route({}).empty());
}

TEST(TexelModel, RefusesInvalidNumbersOfTexels) {
    for (const char* bad : {"texels", "texels:", "texels:-1", "texels:nan", "texels:96x",
                            "texels: 96", "texels:1e999", "texels:infinity"})
        EXPECT_THAT(errorOf(bad), HasSubstr("is not a number of texels")) << bad;
}

TEST(CostModels, AnUnknownNameIsRefusedWithTheKnownOnes) {
    EXPECT_THAT(errorOf("magic:7"), AllOf(HasSubstr("magic"), HasSubstr("texels:N"),
                                          HasSubstr("expr:"), HasSubstr("oracle")));
    EXPECT_THAT(errorOf(""), HasSubstr("unknown cost model"));
    EXPECT_THAT(errorOf("oracle:x"), HasSubstr("takes no argument"));
}

TEST(ExpressionModel, AnOperatorWithoutOperandIsNamed) {
    for (const char* bad : {"expr:-", "expr:+", "expr:--"}) {
        EXPECT_THAT(errorOf(bad), HasSubstr("it may use texels")) << bad;
        EXPECT_THAT(errorOf(bad), testing::Not(HasSubstr("nternal error"))) << bad;
    }
}

TEST(ExpressionModel, TracesWhereTheExpressionIsPositive) {
    auto maps = mapsOf({50.0f, 200.0f});
    EXPECT_EQ(makeCostModel("expr:96 - texels")->route(maps), (Routes{kRays, kMap}));
    maps[0].samples = 10;
    maps[0].triangles = 2000;
    maps[1].samples = 5000;
    maps[1].triangles = 2000;
    EXPECT_EQ(makeCostModel("expr:0.5 * triangles - samples")->route(maps), (Routes{kRays, kMap}));
    EXPECT_EQ(makeCostModel("expr:0")->route(maps), (Routes{kMap, kMap}));
    EXPECT_EQ(makeCostModel("expr:sqrt(texels - 49)")->route(maps), (Routes{kRays, kRays}));
    EXPECT_THROW(makeCostModel("expr:sqrt(texels - 60)")->route(maps), Error);
    EXPECT_EQ(makeCostModel("expr:1")->counts(), uint32_t(kCountsNothing));
    EXPECT_EQ(makeCostModel("expr:texels - 96")->counts(), uint32_t(kCountsNothing));
    EXPECT_EQ(makeCostModel("expr:batches + moverCrossings > pages")->counts(),
              kCountsTriangles | kCountsMovers | kCountsPages);
}

TEST(ExpressionModel, HasEveryQuantity) {
    MapQuantities map;
    map.texels = 1, map.faceTexels = 2, map.pages = 3, map.samples = 4, map.clusters = 5,
    map.triangles = 6, map.batches = 7, map.lights = 8, map.range = 9, map.pairs = 1,
    map.movers = 2, map.moverCrossings = 3;
    const std::string sum = "texels + 10*faceTexels + 100*pages + 1000*samples + 1e4*clusters + "
                            "1e5*triangles + 1e6*batches + 1e7*lights + 1e8*range + 1e9*pairs + "
                            "1e10*movers + 1e11*moverCrossings";
    EXPECT_EQ(makeCostModel("expr:" + sum + " == 321987654321")->route({map}), Routes{kRays});
    EXPECT_EQ(makeCostModel("expr:" + sum + " == 321987654322")->route({map}), Routes{kMap});
}

TEST(ExpressionModel, ReportsThePositionOfAnError) {
    EXPECT_THAT(errorOf("expr:96 - texel"),
                AllOf(HasSubstr("texel"), HasSubstr("position 5"), HasSubstr("faceTexels")));
    EXPECT_THAT(errorOf("expr:(1 + 2"), HasSubstr("position"));
    EXPECT_THAT(errorOf("expr:"), HasSubstr("as in expr:96-texels"));
    EXPECT_THAT(errorOf("expr:1, 2"), HasSubstr("2 values"));
}

TEST(OracleModel, ReplaysTheCheaperMethodOfEveryMap) {
    const auto model = makeCostModel("oracle");
    EXPECT_TRUE(model->needsCosts());
    model->setCosts(
        {3, {{20, 0, 1.0, 2.0}, {0, 0, 2.0, 1.0}, {10, 0, 1.5, 1.5}, {99, 0, 0.0, 9.0}}});
    EXPECT_EQ(model->route(mapsOf({1, 1, 1})), (Routes{kMap, kMap, kRays}));
    FrameCosts whole{3, {{0, 0, 2.0, 1.0}, {10, 0, 1.0, 2.0}, {20, 0, 1.0, 1.0}}};
    whole.wholeFrameTexels = std::numeric_limits<float>::infinity();
    model->setCosts(whole);
    EXPECT_EQ(model->route(mapsOf({1, 1, 1})), (Routes{kRays, kRays, kRays}));
    whole.wholeFrameTexels = 0.0f;
    model->setCosts(whole);
    EXPECT_EQ(model->route(mapsOf({1, 1, 1})), (Routes{kMap, kMap, kMap}));
    whole.wholeFrameTexels = 5.0f; // as texels:5
    model->setCosts(whole);
    EXPECT_EQ(model->route(mapsOf({9, 1, 5})), (Routes{kMap, kRays, kMap}));
    model->setCosts({4, {{0, 0, 1.0, 2.0}}});
    EXPECT_EQ(model->route(mapsOf({1})), Routes{kRays});
    try {
        model->route(mapsOf({1, 1}));
        FAIL() << "light 10 has no costs";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_THAT(error.what(), AllOf(HasSubstr("light 10"), HasSubstr("frame 4")));
    }
}

} // namespace
} // namespace shadowdag::test
