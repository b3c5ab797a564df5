// SPDX-License-Identifier: Apache-2.0
// The table of cost models, and those that need no third-party code.
#include "hybrid/routing/cost_model.h"

#include "cuda/error.h"
#include "cuda/macros.h"
#include "hybrid/routing/cost_expression.h"
#include "hybrid/routing/cost_terms.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace shadowdag {

namespace {

// The paper's rule (sec. IV-I): maps below a number of texels are traced.
class TexelModel : public CostModel {
public:
    explicit TexelModel(double threshold) : threshold_(threshold) {}

    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        std::vector<double> ratios;
        ratios.reserve(maps.size());
        for (const MapQuantities& map : maps)
            ratios.push_back(threshold_ > 0 ? costRatio(map.texels, threshold_) : 0);
        return ratios;
    }
    uint32_t counts() const override { return kCountsNothing; }

private:
    double threshold_; // texels; infinity traces all
};

// The cheaper method by measured costs, or a threshold where that was measured to be faster.
class OracleModel : public CostModel {
public:
    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        std::vector<double> ratios;
        ratios.reserve(maps.size());
        for (const MapQuantities& map : maps) {
            const auto wanted = std::pair(map.light, map.octave);
            const auto cost = std::lower_bound(
                costs_.maps.begin(), costs_.maps.end(), wanted,
                [](const MapCost& c, const auto& w) { return std::pair(c.light, c.octave) < w; });
            if (cost == costs_.maps.end() || std::pair(cost->light, cost->octave) != wanted)
                throw Error(ErrorKind::kInput,
                            "the costs of frame " + std::to_string(costs_.frame) +
                                " do not contain light " + std::to_string(map.light) +
                                (map.octave ? ", octave " + std::to_string(map.octave) : "") +
                                ", which the frame needs; measure them again for this scene, "
                                "camera and size");
            ratios.push_back(costRatio(cost->raysMs, cost->mapMs));
        }
        return costs_.wholeFrameTexels ? TexelModel(*costs_.wholeFrameTexels).weigh(maps) : ratios;
    }
    bool needsCosts() const override { return true; }
    uint32_t counts() const override { return kCountsNothing; }
    void setCosts(const FrameCosts& costs) override {
        costs_ = costs;
        std::sort(costs_.maps.begin(), costs_.maps.end(), [](const MapCost& a, const MapCost& b) {
            return std::pair(a.light, a.octave) < std::pair(b.light, b.octave);
        });
    }

private:
    FrameCosts costs_;
};

std::unique_ptr<CostModel> makeNamedTexelModel(const std::string& argument) {
    double threshold = std::numeric_limits<double>::infinity();
    if (argument != "inf") {
        const char* const end = argument.data() + argument.size();
        const auto [stop, error] = std::from_chars(argument.data(), end, threshold);
        if (error != std::errc() || stop != end || !std::isfinite(threshold) || threshold < 0.0)
            throw Error(ErrorKind::kUsage, "cost model 'texels:" + argument + "': '" + argument +
                                               "' at position " +
                                               std::to_string(std::string("texels:").size()) +
                                               " is not a number of texels; use one >= 0, or inf");
    }
    return std::make_unique<TexelModel>(threshold);
}

std::unique_ptr<CostModel> makeOracleModel(const std::string& argument) {
    if (!argument.empty())
        throw Error(ErrorKind::kUsage,
                    "cost model 'oracle:" + argument + "': oracle takes no argument; use 'oracle'");
    return std::make_unique<OracleModel>();
}

// A model of your own: write makeMyModel in its own file, and add it here.
struct ModelEntry {
    const char* name;
    const char* usage;
    std::unique_ptr<CostModel> (*make)(const std::string& argument);
};
constexpr ModelEntry kModels[] = {
    {"texels", "texels:N", makeNamedTexelModel},
    {"expr", "expr:EXPRESSION", makeExpressionModel},
    {"cost", "cost", makeCalibratedModel},
    {"oracle", "oracle", makeOracleModel},
};

} // namespace

std::unique_ptr<CostModel> makeTexelModel(float threshold) {
    SDAG_ASSERT(threshold >= 0.0f);
    return std::make_unique<TexelModel>(threshold);
}

double costRatio(double raysMs, double mapMs) {
    if (raysMs > 0)
        return mapMs / raysMs;
    return mapMs > 0 ? std::numeric_limits<double>::infinity() : 1.0;
}

std::vector<Route> CostModel::route(const std::vector<MapQuantities>& maps, double margin) const {
    SDAG_ASSERT(margin >= 0);
    const std::vector<double> ratios = weigh(maps);
    SDAG_ASSERT(ratios.size() == maps.size());
    std::vector<Route> routes;
    routes.reserve(maps.size());
    for (size_t i = 0; i < maps.size(); ++i) {
        const PreviousRoute previous = maps[i].previous;
        const double least = previous == PreviousRoute::kMap    ? 1 + margin
                             : previous == PreviousRoute::kRays ? 1 / (1 + margin)
                                                                : 1;
        routes.push_back(routeOfRatio(ratios[i], least));
    }
    return routes;
}

std::unique_ptr<CostModel> makeCostModel(const std::string& text) {
    const size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    std::string known;
    for (const ModelEntry& model : kModels) {
        if (name == model.name)
            return model.make(colon == std::string::npos ? std::string() : text.substr(colon + 1));
        known += known.empty() ? model.usage : std::string(", ") + model.usage;
    }
    throw Error(ErrorKind::kUsage, "unknown cost model '" + text + "' (the name '" + name +
                                       "' at position 0); known are " + known);
}

} // namespace shadowdag
