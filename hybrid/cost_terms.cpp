// SPDX-License-Identifier: Apache-2.0
// The table of terms, and the model that adds them up.
#include "hybrid/cost_terms.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

using Map = MapQuantities;

constexpr CostTerm kTerms[] = {
    {"maps", "every map", [](const Map&) { return 1.0; }, false},
    {"samples", "samples of its clusters", [](const Map& m) { return double(m.samples); }, false},
    {"clusters", "its clusters", [](const Map& m) { return double(m.clusters); }, false},
    {"face_texels", "texels of a whole face",
     [](const Map& m) { return double(m.faceTexels) * double(m.faceTexels); }, false},
    {"face_side", "texels along a face's side", [](const Map& m) { return double(m.faceTexels); },
     false},
    {"range_samples", "samples x range: lengths of rays, at most",
     [](const Map& m) { return double(m.samples) * double(m.range); }, false},
    {"pages", "pages that its receivers touch", [](const Map& m) { return double(m.pages); }, true},
    {"triangles", "triangles in the light's sphere",
     [](const Map& m) { return double(m.triangles); }, true},
    {"batches", "batches in the light's sphere", [](const Map& m) { return double(m.batches); },
     true},
};

void checkSum(const std::vector<CostSummand>& sum, const char* what) {
    if (sum.empty())
        throw Error(ErrorKind::kUsage, std::string("cost model 'cost': no cost is known for ") +
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
    bool needsGeometryCounts() const override { return calibration_.needsGeometry(); }

    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        if (needsCalibration())
            throw Error(ErrorKind::kUsage,
                        "cost model 'cost' routes by measured costs; give --costs C.json, as "
                        "shadowdag calibrate -o C.json writes it");
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

bool CostCalibration::needsGeometry() const {
    const auto needs = [](const CostSummand& s) { return s.term->needsGeometry && s.ms > 0; };
    return std::any_of(rays.begin(), rays.end(), needs) ||
           std::any_of(map.begin(), map.end(), needs);
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
