// SPDX-License-Identifier: Apache-2.0
// Observations for `calibrate --from`: read, written again, and fitted.
#include "hybrid/routing/cost_fit.h"
#include "tests/fuzz/json_seeds.h"
#include "tools/workspace/cost_file.h"

#include <cmath>

namespace shadowdag::fuzz::calibration {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const std::vector<ObservedFrame> frames =
        observationsFromJson(inputJson(data, size), "input.json");
    const Json written = toJson(frames);
    fuzzCheck(toJson(observationsFromJson(written, "written")) == written,
              "observations are written as they are read");
    const CostFit fit = fitCosts(frames);
    for (const auto& sum : {fit.calibration.rays, fit.calibration.map})
        for (const CostSummand& summand : sum)
            fuzzCheck(summand.ms >= 0 && std::isfinite(summand.ms), "a coefficient is a cost");
    toJson(fit);
}

std::vector<std::string> seeds() {
    std::vector<ObservedFrame> frames(3);
    for (uint32_t f = 0; f < frames.size(); ++f) {
        frames[f].scene = f < 2 ? "atrium" : "houses";
        frames[f].view = "64x36";
        frames[f].frame = f;
        for (uint32_t light = 0; light < 3; ++light) {
            MapQuantities q;
            q.light = light;
            q.texels = 32.0f * float(1 + light + f);
            q.faceTexels = 128;
            q.pages = 3 + light;
            q.samples = 500u * (1 + f * light);
            q.triangles = 1000u + light;
            q.lights = 3;
            q.range = 4;
            frames[f].maps.push_back(q);
            frames[f].costs.push_back(
                {light, 0, 0.5 + 0.25 * double(q.samples) / 500, 1.0 + light});
        }
    }
    return {jsonLine(toJson(frames)), jsonLine(toJson(std::vector(1, frames[0])))};
}

[[maybe_unused]] const bool isAdded = addFuzzTarget({.name = "calibration",
                                                     .maxBytes = 4096,
                                                     .fuzzOne = fuzzOne,
                                                     .seeds = seeds,
                                                     .replayCount = 500});

} // namespace

} // namespace shadowdag::fuzz::calibration
