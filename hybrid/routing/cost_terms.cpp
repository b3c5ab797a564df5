// SPDX-License-Identifier: Apache-2.0
// The table of terms, and the model that adds them up.
#include "hybrid/routing/cost_terms.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

using Map = MapQuantities;

constexpr CostTerm kTerms[] = {
    {"maps", "every map", [](const Map&) { return 1.0; }, kCountsNothing, true, true},
    {"samples", "samples of its clusters", [](const Map& m) { return double(m.samples); },
     kCountsNothing, true, true},
    {"clusters", "its clusters", [](const Map& m) { return double(m.clusters); }, kCountsNothing,
     true, true},
    {"face_texels", "texels of a whole face",
     [](const Map& m) { return double(m.faceTexels) * double(m.faceTexels); }, kCountsNothing,
     false, true},
    {"face_side", "texels along a face's side", [](const Map& m) { return double(m.faceTexels); },
     kCountsNothing, false, true},
    {"range_samples", "samples x range: an upper bound of the rays' lengths",
     [](const Map& m) { return double(m.samples) * double(m.range); }, kCountsNothing, true, false},
    {"pairs", "its exact pairs, estimated", [](const Map& m) { return double(m.pairs); },
     kCountsPairs, true, true},
    {"mover_pairs", "pairs of lights with moving objects nearby",
     [](const Map& m) { return m.movers > 0 ? double(m.pairs) : 0.0; },
     kCountsPairs | kCountsMovers, true, false},
    {"mover_crossings", "pairs x moving boxes that a line through the light's sphere crosses",
     [](const Map& m) { return double(m.pairs) * double(m.moverCrossings); },
     kCountsPairs | kCountsMovers, true, false},
    {"pages", "pages that its lookups read", [](const Map& m) { return double(m.pages); },
     kCountsPages, false, true},
    {"triangles", "triangles in the light's sphere",
     [](const Map& m) { return double(m.triangles); }, kCountsTriangles, false, true},
    {"batches", "batches in the light's sphere", [](const Map& m) { return double(m.batches); },
     kCountsTriangles, false, true},
};

void checkSum(const std::vector<CostSummand>& sum, const char* what) {
    if (sum.empty())
        throw Error(ErrorKind::kUsage, std::string("cost model 'cost': there is no cost for ") +
                                           what + "; calibrate again");
    for (const CostSummand& summand : sum)
        if (!std::isfinite(summand.ms) || summand.ms < 0)
            throw Error(ErrorKind::kUsage, std::string("cost model 'cost': a unit of '") +
                                               summand.term->name + "' by " + what + " takes " +
                                               std::to_string(summand.ms) +
                                               " ms; use a number >= 0, or calibrate again");
}

// The cheaper method by predicted costs.
class CalibratedModel : public CostModel {
public:
    void setCalibration(const CostCalibration& calibration) override {
        checkSum(calibration.rays, "rays");
        checkSum(calibration.map, "maps");
        calibration_ = calibration;
    }
    bool needsCalibration() const override { return calibration_.rays.empty(); }
    uint32_t counts() const override { return calibration_.counts(); }

    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        if (needsCalibration())
            throw Error(ErrorKind::kUsage,
                        "cost model 'cost' routes by measured costs; give --costs C.json, which "
                        "shadowdag calibrate -o C.json writes");
        std::vector<double> ratios;
        ratios.reserve(maps.size());
        for (const MapQuantities& map : maps)
            ratios.push_back(
                costRatio(predictMs(calibration_.rays, map), predictMs(calibration_.map, map)));
        return ratios;
    }

private:
    CostCalibration calibration_;
};

} // namespace

std::span<const CostTerm> costTerms() {
    return kTerms;
}

const CostTerm* findCostTerm(const std::string& name) {
    const auto found = std::find_if(std::begin(kTerms), std::end(kTerms),
                                    [&](const CostTerm& term) { return name == term.name; });
    return found == std::end(kTerms) ? nullptr : &*found;
}

uint32_t CostCalibration::counts() const {
    uint32_t counts = kCountsNothing;
    for (const std::vector<CostSummand>* sum : {&rays, &map})
        for (const CostSummand& summand : *sum)
            if (summand.ms > 0)
                counts |= summand.term->counts;
    return counts;
}

double predictMs(const std::vector<CostSummand>& sum, const MapQuantities& map) {
    double ms = 0;
    for (const CostSummand& summand : sum)
        ms += summand.ms * summand.term->of(map);
    return ms;
}

std::unique_ptr<CostModel> makeCostModelOf(const CostCalibration& calibration) {
    auto model = std::make_unique<CalibratedModel>();
    model->setCalibration(calibration);
    return model;
}

std::unique_ptr<CostModel> makeCalibratedModel(const std::string& argument) {
    if (!argument.empty())
        throw Error(ErrorKind::kUsage, "cost model 'cost:" + argument +
                                           "': cost takes no argument; use 'cost' and give the "
                                           "file to --costs");
    return std::make_unique<CalibratedModel>();
}

} // namespace shadowdag
