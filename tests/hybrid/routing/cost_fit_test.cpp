// SPDX-License-Identifier: Apache-2.0
// Fitted costs: the solver against closed forms and a search, planted costs found again, held-out
// regret by hand.
#include "hybrid/routing/cost_fit.h"

#include "cuda/error.h"
#include "hybrid/routing/cost_solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace shadowdag::test {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

double unit(std::mt19937_64& random) {
    return double(random() >> 11) * 0x1p-53;
}

double squaredError(const std::vector<std::vector<double>>& rows, const std::vector<double>& values,
                    const std::vector<double>& x) {
    double sum = 0;
    for (size_t r = 0; r < rows.size(); ++r) {
        double value = -values[r];
        for (size_t i = 0; i < x.size(); ++i)
            value += rows[r][i] * x[i];
        sum += value * value;
    }
    return sum;
}

TEST(SolveNonNegative, FindsTheLineThroughPointsOnIt) {
    const std::vector<double> x = solveNonNegative({{1, 1}, {1, 2}, {1, 10}}, {5, 7, 23});
    EXPECT_THAT(x, ElementsAre(DoubleNear(3, 1e-9), DoubleNear(2, 1e-9)));
}

TEST(SolveNonNegative, LeavesOutWhatWouldBeNegative) {
    // The best line is 6 - 2 t; without a falling slope the best is the mean.
    EXPECT_THAT(solveNonNegative({{1, 1}, {1, 2}, {1, 3}}, {4, 2, 0}),
                ElementsAre(DoubleNear(2, 1e-12), 0.0));
    EXPECT_THAT(solveNonNegative({{1.0}}, {-1}), ElementsAre(0.0));
}

TEST(SolveNonNegative, GivesZeroToColumnsThatAddNothing) {
    EXPECT_THAT(solveNonNegative({{0, 1, 1}, {0, 2, 2}}, {2, 4}),
                ElementsAre(0.0, DoubleNear(2, 1e-12), 0.0));
    EXPECT_THAT(solveNonNegative({}, {}), testing::IsEmpty());
}

TEST(SolveNonNegative, NoNeighbourHasASmallerError) {
    const uint64_t seed = 77;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    for (int trial = 0; trial < 50; ++trial) {
        std::vector<std::vector<double>> rows;
        std::vector<double> values;
        for (int r = 0; r < 12; ++r) {
            rows.push_back({1, unit(random), 1000 * unit(random), unit(random) - 0.5});
            values.push_back(4 * unit(random) - 1);
        }
        const std::vector<double> x = solveNonNegative(rows, values);
        const double least = squaredError(rows, values, x);
        for (size_t i = 0; i < x.size(); ++i)
            for (const double step : {-1e-3, 1e-3}) {
                std::vector<double> neighbour = x;
                neighbour[i] = std::max(0.0, neighbour[i] + step * (i == 2 ? 1e-3 : 1));
                EXPECT_GE(squaredError(rows, values, neighbour), least * (1 - 1e-12)) << trial;
            }
    }
}

MapQuantities mapOf(uint32_t light, uint64_t samples, uint32_t faceTexels, uint64_t triangles) {
    MapQuantities map;
    map.light = light;
    map.samples = samples;
    map.clusters = uint32_t(samples / 100 + 1);
    map.texels = float(faceTexels);
    map.faceTexels = faceTexels;
    map.triangles = triangles;
    map.batches = uint32_t(triangles / 100);
    map.pages = 1 + faceTexels / 16;
    map.range = 5;
    return map;
}

/// Frames of some scenes whose costs are a known sum: 2 us a sample by rays, by maps 0.3 ms and
/// 0.2 us a sample.
std::vector<ObservedFrame> plantedFrames(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<ObservedFrame> frames;
    for (const char* scene : {"a", "b", "c"})
        for (uint32_t f = 0; f < 4; ++f) {
            ObservedFrame frame;
            frame.scene = scene;
            frame.frame = f;
            frame.countMs.fill(1);
            for (uint32_t light = 0; light < 60; ++light) {
                const double samples = std::floor(10 + 1000 * unit(random) * unit(random));
                frame.maps.push_back(mapOf(light, uint64_t(samples),
                                           uint32_t(16 + 500 * unit(random)),
                                           uint64_t(20000 * unit(random))));
                frame.costs.push_back({light, 0, 2e-3 * samples, 0.3 + 2e-4 * samples});
            }
            frames.push_back(frame);
        }
    return frames;
}

TEST(CostFit, FindsPlantedCostsAndNoMoreTerms) {
    const CostFit fit = fitCosts(plantedFrames(5));
    EXPECT_EQ(fit.judgedBy, HeldOut::kScenes);
    ASSERT_EQ(fit.calibration.rays.size(), 1u);
    EXPECT_STREQ(fit.calibration.rays[0].term->name, "samples");
    EXPECT_NEAR(fit.calibration.rays[0].ms, 2e-3, 1e-9);
    EXPECT_EQ(fit.calibration.counts(), uint32_t(kCountsNothing));
    // Samples decide, whether or not the map's sum knows them: the border may be off without.
    ASSERT_TRUE(fit.byScene && fit.thresholdByScene);
    EXPECT_LT(fit.byScene->mean, 0.01);
    EXPECT_GT(fit.rays.mean, 10 * fit.byScene->mean);
    EXPECT_GT(fit.maps.mean, 10 * fit.byScene->mean);
    EXPECT_GT(fit.thresholdByScene->mean, 10 * fit.byScene->mean);
    for (const FitTrial& trial : fit.trials)
        EXPECT_EQ(trial.isKept,
                  &trial == &fit.trials[0] || trial.gain.mean > trial.gain.standardError);
}

TEST(CostFit, CountsOnlyUsefulQuantities) {
    // Maps cost as many triangles as they draw; counting these costs nothing, or more than it
    // saves.
    for (const double countMs : {0.0, 1e6}) {
        std::vector<ObservedFrame> frames = plantedFrames(6);
        for (ObservedFrame& frame : frames) {
            frame.countMs.fill(1e6);
            frame.countMs[1] = countMs; // triangles
            for (size_t m = 0; m < frame.maps.size(); ++m)
                frame.costs[m].mapMs = 5e-5 * double(frame.maps[m].triangles);
        }
        EXPECT_EQ(fitCosts(frames).calibration.counts(),
                  uint32_t(countMs == 0 ? kCountsTriangles : kCountsNothing));
    }
}

// Rays are dear where something moves, and maps where there is much to draw: neither term helps
// without the other.
TEST(CostFit, FindsTermsThatHelpTogetherOnly) {
    std::mt19937_64 random(11);
    std::vector<ObservedFrame> frames;
    for (const char* scene : {"a", "b", "c"})
        for (uint32_t f = 0; f < 4; ++f) {
            ObservedFrame frame;
            frame.scene = scene;
            frame.frame = f;
            for (uint32_t light = 0; light < 60; ++light) {
                MapQuantities map = mapOf(light, 1000, 100, uint64_t(1e5 * unit(random)));
                map.pairs = uint64_t(10 + 1000 * unit(random));
                map.movers = light % 2;
                frame.maps.push_back(map);
                frame.costs.push_back({light, 0, (light % 2 ? 2e-3 : 1e-5) * double(map.pairs),
                                       2e-5 * double(map.triangles)});
            }
            frames.push_back(frame);
        }
    const CostFit fit = fitCosts(frames);
    const auto has = [](const std::vector<CostSummand>& sum, const std::string& term) {
        return std::any_of(sum.begin(), sum.end(),
                           [&](const CostSummand& s) { return s.ms > 0 && s.term->name == term; });
    };
    EXPECT_TRUE(has(fit.calibration.rays, "mover_pairs"));
    EXPECT_TRUE(has(fit.calibration.map, "triangles") || has(fit.calibration.map, "batches"));
    ASSERT_TRUE(fit.byScene);
    EXPECT_LT(fit.byScene->mean, 0.02);
    EXPECT_GT(std::min(fit.rays.mean, fit.maps.mean), 0.2);
}

TEST(CostFit, IsTheSameTwice) {
    const CostFit a = fitCosts(plantedFrames(7)), b = fitCosts(plantedFrames(7));
    ASSERT_EQ(a.calibration.map.size(), b.calibration.map.size());
    for (size_t i = 0; i < a.calibration.map.size(); ++i)
        EXPECT_EQ(a.calibration.map[i].ms, b.calibration.map[i].ms);
    EXPECT_EQ(a.byScene->mean, b.byScene->mean);
}

TEST(CostFit, OneSceneIsJudgedByFrames) {
    std::vector<ObservedFrame> frames = plantedFrames(8);
    frames.resize(4);
    const CostFit fit = fitCosts(frames);
    EXPECT_EQ(fit.judgedBy, HeldOut::kFrames);
    EXPECT_FALSE(fit.byScene || fit.thresholdByScene || fit.trials[0].byScene);
    EXPECT_TRUE(fit.byFrame && fit.thresholdByFrame);
}

TEST(CostFit, ScenesWithoutGainDoNotJudge) {
    std::vector<ObservedFrame> frames = plantedFrames(8);
    for (ObservedFrame& frame : frames)
        if (frame.scene != "a")
            for (MapCost& cost : frame.costs)
                cost.mapMs = 2 * cost.raysMs;
    EXPECT_EQ(fitCosts(frames).judgedBy, HeldOut::kFrames);
}

TEST(CostFit, OneFrameGetsTheBetterMethodWithoutHeldOutRegret) {
    std::vector<ObservedFrame> frames = plantedFrames(8);
    frames.resize(1);
    frames.push_back(frames[0]); // another view of it
    frames[1].view = "larger";
    const CostFit fit = fitCosts(frames);
    EXPECT_FALSE(fit.judgedBy || fit.byFrame || fit.byScene || fit.thresholdByFrame);
    ASSERT_EQ(fit.trials.size(), 1u);
    const auto model = makeCostModelOf(fit.calibration);
    const std::vector<Route> routes = model->route(frames[0].maps);
    double raysMs = 0, mapsMs = 0;
    for (const MapCost& cost : frames[0].costs) {
        raysMs += cost.raysMs;
        mapsMs += cost.mapMs;
    }
    for (const Route route : routes)
        EXPECT_EQ(route == Route::kRays, raysMs < mapsMs);
}

TEST(CostFit, WithoutAnyMapIsRefused) {
    EXPECT_THROW(fitCosts({}), Error);
    EXPECT_THROW(fitCosts(std::vector<ObservedFrame>(3)), Error);
}

TEST(RoutingRegret, IsTheLossOverTheCheapestRoutes) {
    ObservedFrame frame;
    frame.maps.resize(3);
    frame.costs = {{0, 0, 1, 3}, {1, 0, 5, 2}, {2, 0, 1, 1}};
    frame.countMs = {2, 4, 8, 16};
    using enum Route;
    EXPECT_EQ(routingRegret(frame, {kRays, kMap, kMap}, kCountsNothing), 0.0);
    EXPECT_EQ(routingRegret(frame, {kRays, kRays, kMap}, kCountsNothing), 0.75);
    EXPECT_EQ(routingRegret(frame, {kMap, kMap, kMap}, kCountsNothing), 0.5);
    EXPECT_EQ(routingRegret(frame, {kRays, kMap, kRays}, kCountsPages), 0.5);
    EXPECT_EQ(routingRegret(frame, {kRays, kMap, kRays}, kCountsTriangles | kCountsMovers), 5.0);
    EXPECT_EQ(routingRegret(ObservedFrame{}, {}, kCountsAll), 0.0);
}

TEST(MeanRegret, HasTheStandardErrorOfTheMean) {
    const Regret regret = meanRegret({1, 2, 3, 6});
    EXPECT_EQ(regret.mean, 3.0);
    EXPECT_NEAR(regret.standardError, std::sqrt(14.0 / 3.0 / 4.0), 1e-12);
    EXPECT_EQ(meanRegret({0.5}).standardError, 0.0);
}

TEST(BestThreshold, IsTheLeastWithTheLeastRegret) {
    ObservedFrame frame;
    frame.maps = {mapOf(0, 1, 10, 0), mapOf(1, 1, 20, 0), mapOf(2, 1, 30, 0)};
    frame.costs = {{0, 0, 1, 9}, {1, 0, 2, 9}, {2, 0, 9, 1}};
    EXPECT_EQ(bestThreshold({&frame}), 30.0); // two traced, the third drawn
    frame.costs[2] = {2, 0, 1, 2};
    EXPECT_EQ(bestThreshold({&frame}), std::numeric_limits<double>::infinity());
    for (MapCost& cost : frame.costs)
        cost = {cost.light, 0, 2, 1};
    EXPECT_EQ(bestThreshold({&frame}), 0.0);
}

TEST(HeldOut, FitsToNothingThatIsHeldOut) {
    const std::vector<ObservedFrame> frames = plantedFrames(9);
    ObservedFrames all;
    for (const ObservedFrame& frame : frames)
        all.push_back(&frame);
    std::vector<size_t> counts;
    const auto count = [&](const ObservedFrames& fitted) {
        counts.push_back(fitted.size());
        return makeCostModel("texels:0");
    };
    EXPECT_EQ(heldOutRegret(all, HeldOut::kScenes, count).size(), 12u);
    EXPECT_THAT(counts, ElementsAre(8, 8, 8));
    counts.clear();
    heldOutRegret(all, HeldOut::kFrames, count);
    EXPECT_EQ(counts, std::vector<size_t>(12, 11));
}

TEST(CalibratedModel, RoutesByThePredictedCosts) {
    const CostCalibration calibration{
        {{findCostTerm("samples"), 1.0}},
        {{findCostTerm("maps"), 50.0}, {findCostTerm("triangles"), 0.5}}};
    EXPECT_EQ(calibration.counts(), uint32_t(kCountsTriangles));
    const auto model = makeCostModelOf(calibration);
    EXPECT_EQ(model->counts(), uint32_t(kCountsTriangles));
    EXPECT_FALSE(model->needsCalibration());
    using enum Route;
    EXPECT_EQ(model->route({mapOf(0, 99, 16, 100), mapOf(1, 100, 16, 100), mapOf(2, 101, 16, 100)}),
              (std::vector<Route>{kRays, kMap, kMap}));
}

TEST(CalibratedModel, RefusesToGuess) {
    const auto model = makeCostModel("cost");
    EXPECT_TRUE(model->needsCalibration());
    EXPECT_THROW(model->route({MapQuantities{}}), Error);
    EXPECT_THROW(model->setCalibration({}), Error);
    EXPECT_THROW(
        model->setCalibration({{{findCostTerm("maps"), -1.0}}, {{findCostTerm("maps"), 1}}}),
        Error);
    EXPECT_THROW(makeCostModel("cost:file.json"), Error);
    EXPECT_EQ(findCostTerm("moonlight"), nullptr);
}

} // namespace
} // namespace shadowdag::test
