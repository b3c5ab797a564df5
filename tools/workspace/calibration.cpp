// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/calibration.h"

#include "cuda/statistics.h"
#include "tools/settings/console.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace shadowdag {

CalibrationFrame measureCalibrationFrame(FrameRenderer& renderer, const Camera& camera,
                                         const FrameOptions& asked, int repeats) {
    FrameOptions options = asked;
    options.recordPairs = false;
    options.routeMargin = 0;
    if (options.start == FrameStart::kCold)
        options.maps.useStaticOptimization = false;
    CalibrationFrame result;
    renderer.reset();
    FrameCosts costs = renderer.measureCosts(camera, options, repeats);
    costs.wholeFrameTexels.reset(); // the model predicts maps
    const auto render = [&](const CostModel& model) {
        checkInterrupted();
        return renderFrom(renderer, camera, model, options);
    };

    // The measured time of the oracle's routes beside the predicted one, and the time of counting.
    ObservedFrame& observed = result.observed;
    const std::unique_ptr<CostModel> oracle = makeCostModel("oracle");
    oracle->setCosts(costs);
    std::vector<double> oracleMs;
    std::array<std::vector<double>, kCountNameCount> countMs;
    for (int repeat = 0; repeat < repeats; ++repeat) {
        const FrameResult frame = render(*oracle);
        if (repeat == 0)
            for (const MapRecord& map : frame.maps)
                observed.maps.push_back(map.quantities);
        oracleMs.push_back(servingMs(frame.stages));
        for (size_t k = 0; k < kCountNameCount; ++k)
            countMs[k].push_back(frame.counting.stageMs(kCountNames[k]));
    }
    result.oracleMs = median(oracleMs);
    for (size_t k = 0; k < kCountNameCount; ++k)
        observed.countMs[k] = median(countMs[k]);
    SDAG_ASSERT(observed.maps.size() == costs.maps.size());
    observed.costs = costs.maps;
    result.raysScale = costs.raysScale;
    result.mapsScale = costs.mapsScale;
    result.degradeDivisor = costs.degradeDivisor;
    for (const MapCost& cost : costs.maps) {
        result.raysMs += cost.raysMs;
        result.mapsMs += cost.mapMs;
        result.oracleSumMs += std::min(cost.raysMs, cost.mapMs);
    }
    return result;
}

} // namespace shadowdag
