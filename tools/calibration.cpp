// SPDX-License-Identifier: Apache-2.0
#include "tools/calibration.h"

#include "cuda/statistics.h"
#include "tools/console.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace shadowdag {

namespace {

/// Every map by one method, with or without a need for geometry.
class OneMethod : public CostModel {
public:
    OneMethod(Route route, bool needsGeometry)
        : ratio_(route == Route::kRays ? 2.0 : 0.0), needsGeometry_(needsGeometry) {}
    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        return std::vector<double>(maps.size(), ratio_);
    }
    bool needsGeometryCounts() const override { return needsGeometry_; }

private:
    double ratio_;
    bool needsGeometry_;
};

/// Returns the time of the stages that routing decides about.
double servingMs(const StageTimes& stages) {
    double sum = 0;
    for (const auto& [name, timeMs] : stages.stagesMs)
        if (name == "shading" || std::find(std::begin(kShadowMapStages), std::end(kShadowMapStages),
                                           name) != std::end(kShadowMapStages))
            sum += timeMs;
    return sum;
}

double stageMs(const StageTimes& stages, const std::string& name) {
    for (const auto& [stage, timeMs] : stages.stagesMs)
        if (stage == name)
            return timeMs;
    return 0;
}

double scaleOf(double wholeMs, double sumMs) {
    return sumMs > 0 ? wholeMs / sumMs : 1;
}

} // namespace

CalibrationFrame measureCalibrationFrame(FrameRenderer& renderer, const Camera& camera,
                                         const FrameOptions& asked, int repeats) {
    FrameOptions options = asked;
    options.recordPairs = false;
    options.routeMargin = 0;
    CalibrationFrame result;
    renderer.reset();
    const FrameCosts isolated = renderer.measureCosts(camera, options, repeats);
    const auto render = [&](const CostModel& model) {
        checkInterrupted();
        renderer.reset();
        return renderer.render(camera, model, options);
    };

    ObservedFrame& observed = result.observed;
    for (const MapRecord& map : render(OneMethod(Route::kMap, false)).maps)
        observed.maps.push_back(map.quantities);
    SDAG_ASSERT(observed.maps.size() == isolated.maps.size());
    for (const MapCost& cost : isolated.maps) {
        result.raysSumMs += cost.raysMs;
        result.mapsSumMs += cost.mapMs;
        result.oracleSumMs += std::min(cost.raysMs, cost.mapMs);
    }

    // Whole frames by one method give the scales; routing with and without geometry what it costs.
    std::vector<double> raysMs, mapsMs, plainMs, countedMs;
    for (int repeat = 0; repeat < repeats; ++repeat) {
        const StageTimes rays = render(OneMethod(Route::kRays, false)).stages;
        raysMs.push_back(servingMs(rays));
        plainMs.push_back(stageMs(rays, "routing"));
        mapsMs.push_back(servingMs(render(OneMethod(Route::kMap, false)).stages));
        countedMs.push_back(stageMs(render(OneMethod(Route::kRays, true)).stages, "routing"));
    }
    result.raysMs = median(raysMs);
    result.mapsMs = median(mapsMs);
    observed.geometryMs = std::max(0.0, median(countedMs) - median(plainMs));
    const double raysScale = scaleOf(result.raysMs, result.raysSumMs),
                 mapsScale = scaleOf(result.mapsMs, result.mapsSumMs);
    FrameCosts scaled = isolated;
    for (MapCost& cost : scaled.maps) {
        cost.raysMs *= raysScale;
        cost.mapMs *= mapsScale;
        result.scaledSumMs += std::min(cost.raysMs, cost.mapMs);
    }
    observed.costs = scaled.maps;

    // What both oracles' routes take, beside what they promise.
    const std::unique_ptr<CostModel> byIsolated = makeCostModel("oracle"),
                                     byScaled = makeCostModel("oracle");
    byIsolated->setCosts(isolated);
    byScaled->setCosts(scaled);
    std::vector<double> oracleMs, scaledMs;
    for (int repeat = 0; repeat < repeats; ++repeat) {
        oracleMs.push_back(servingMs(render(*byIsolated).stages));
        scaledMs.push_back(servingMs(render(*byScaled).stages));
    }
    result.oracleMs = median(oracleMs);
    result.scaledMs = median(scaledMs);
    return result;
}

} // namespace shadowdag
