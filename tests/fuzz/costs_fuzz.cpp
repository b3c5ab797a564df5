// SPDX-License-Identifier: Apache-2.0
// Files for --costs, of both kinds: measured costs and calibrations.
#include "hybrid/routing/cost_model.h"
#include "tests/fuzz/json_seeds.h"
#include "tools/workspace/cost_file.h"

namespace shadowdag::fuzz::costs {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const CostSource source =
        readCostSource(fuzzFolder().write("costs.json", data, size), {{"cpu", "a processor"}});
    fuzzCheck(source.table.has_value() != source.calibration.has_value(),
              "a cost file is of one kind");
    RunParameters run;
    run.method = "hybrid";
    run.model = "cost";
    remarksOn(source, {run});
    if (source.calibration) {
        const auto model = makeCostModel("cost");
        giveCalibration(*model, source);
        for (const double ratio : model->weigh({MapQuantities{}}))
            fuzzCheck(!(ratio < 0), "no cost is negative");
    }
}

std::vector<std::string> seeds() {
    FrameCosts costs;
    costs.maps = {{0, 0, 1.5, 2.5}, {0, 1, 0.25, 4}, {3, 0, 0, 0}};
    FrameCosts whole = costs;
    whole.frame = 7;
    whole.wholeFrameTexels = 96.0f;
    return {jsonLine(toJson(CostTable{{{"atrium", 0}, costs}, {{"houses", 7}, whole}},
                            {{"cpu", "another"}}, Json::object())),
            jsonLine(sourceJson("tests/bench/results/calibration.json", 3))};
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "costs", .maxBytes = 8192, .fuzzOne = fuzzOne, .seeds = seeds});

} // namespace

} // namespace shadowdag::fuzz::costs
