// SPDX-License-Identifier: Apache-2.0
// Cost models as texts, expressions above all.
#include "hybrid/routing/cost_model.h"
#include "tests/fuzz/fuzz_target.h"

#include <cmath>

namespace shadowdag::fuzz::expression {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const std::string text(data, data + size);
    const std::unique_ptr<CostModel> model = makeCostModel(text);
    if (model->needsCosts() || model->needsCalibration())
        return;
    MapQuantities map;
    map.texels = 96;
    map.samples = 1000;
    map.triangles = 1u << 20;
    const std::vector<double> ratios = model->weigh({MapQuantities{}, map, map});
    fuzzCheck(ratios.size() == 3, "every map is weighed");
    fuzzCheck(ratios[1] == ratios[2] || std::isnan(ratios[1]), "equal maps weigh the same");
    model->route({map}, 0.5);
}

std::vector<std::string> seeds() {
    return {"texels:96",
            "texels:inf",
            "cost",
            "oracle",
            "expr:texels-96",
            "expr:samples*2/(1+triangles)-pages>0 ? 1 : -range",
            "expr:min(texels,faceTexels)+sqrt(pairs)*log(movers+1)^2",
            "expr:clusters&&batches||lights!=moverCrossings"};
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "expression",
     .maxBytes = 1024,
     .fuzzOne = fuzzOne,
     .seeds = seeds,
     .words = {"expr:", "texels", "pages", "samples", "rnd", "sum(", "avg(", "sin(", "exp(", "(",
               ")",     ",",      "=",     "<=",      "?",   ":",    "_pi",  "\"",   "#",    "^"}});

} // namespace

} // namespace shadowdag::fuzz::expression
