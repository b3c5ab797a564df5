// SPDX-License-Identifier: Apache-2.0
// Experiment files: read, written again, and expanded to their configurations.
#include "tests/fuzz/json_seeds.h"
#include "tools/settings/experiment.h"

namespace shadowdag::fuzz::experiment {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const Experiment experiment = experimentFromJson(inputJson(data, size), "input.json");
    const Json written = toJson(experiment);
    fuzzCheck(toJson(experimentFromJson(written, "written")) == written,
              "an experiment is written as it is read");
    const std::vector<uint32_t> dags = allResolutions(experiment);
    for (const RunParameters& run :
         configurations(experiment, dags, experiment.resolutionLog2.size()))
        fuzzCheck(run.slug().size() < 200, "a label is a file name");
}

std::vector<std::string> seeds() {
    Json all = toJson(Experiment{}), routes = Json::object();
    routes["sequence"] = true;
    routes["route_margin"] = {0.1, 0.5};
    routes["frames"] = "0:9:3";
    return {jsonLine(all), jsonLine(routes),
            R"({"variants":["PMCD-EB-SO","Hybrid:texels:9","RT"]})",
            jsonLine(sourceJson("scenes/experiments/atrium.json", 4))};
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "experiment", .maxBytes = 4096, .fuzzOne = fuzzOne, .seeds = seeds});

} // namespace

} // namespace shadowdag::fuzz::experiment
