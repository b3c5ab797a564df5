// SPDX-License-Identifier: Apache-2.0
// Evaluates routing expressions with muParser.
#include "hybrid/routing/cost_expression.h"

#include "cuda/error.h"

#include <muParser.h>

#include <cmath>
#include <cstdio>
#include <limits>

namespace shadowdag {

namespace {

struct Quantity {
    const char* name;
    double (*value)(const MapQuantities&);
    uint32_t counts = kCountsNothing;
};
constexpr Quantity kQuantities[] = {
    {"texels", [](const MapQuantities& m) { return double(m.texels); }},
    {"faceTexels", [](const MapQuantities& m) { return double(m.faceTexels); }},
    {"pages", [](const MapQuantities& m) { return double(m.pages); }, kCountsPages},
    {"samples", [](const MapQuantities& m) { return double(m.samples); }},
    {"clusters", [](const MapQuantities& m) { return double(m.clusters); }},
    {"triangles", [](const MapQuantities& m) { return double(m.triangles); }, kCountsTriangles},
    {"batches", [](const MapQuantities& m) { return double(m.batches); }, kCountsTriangles},
    {"lights", [](const MapQuantities& m) { return double(m.lights); }},
    {"range", [](const MapQuantities& m) { return double(m.range); }},
    {"pairs", [](const MapQuantities& m) { return double(m.pairs); }, kCountsPairs},
    {"movers", [](const MapQuantities& m) { return double(m.movers); }, kCountsMovers},
    {"moverCrossings", [](const MapQuantities& m) { return double(m.moverCrossings); },
     kCountsMovers},
};
constexpr size_t kQuantityCount = std::size(kQuantities);

/// Returns the quantities of a map as text.
std::string valuesOf(const double (&values)[kQuantityCount]) {
    std::string text;
    for (size_t q = 0; q < kQuantityCount; ++q) {
        char value[64];
        std::snprintf(value, sizeof value, "%s%s = %g", q == 0 ? "" : ", ", kQuantities[q].name,
                      values[q]);
        text += value;
    }
    return text;
}

class ExpressionModel : public CostModel {
public:
    explicit ExpressionModel(const std::string& expression) : expression_(expression) {
        if (expression.find_first_not_of(" \t\r\n") == std::string::npos)
            throw Error(ErrorKind::kUsage,
                        "cost model 'expr:' is empty; give an expression that is > 0 where rays "
                        "should be used, as in expr:96-texels");
        evaluate({MapQuantities{}}, 1.0);
        double value = 1.0;
        mu::Parser parser;
        for (const Quantity& quantity : kQuantities)
            parser.DefineVar(quantity.name, &value);
        parser.SetExpr(expression_);
        const mu::varmap_type used = parser.GetUsedVar();
        for (const Quantity& quantity : kQuantities)
            if (used.contains(quantity.name))
                counts_ |= quantity.counts;
    }
    uint32_t counts() const override { return counts_; }

    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        return evaluate(maps, 0.0);
    }

private:
    // A result without magnitude: an expression need not be a cost, so it has no certainty. A new
    // parser per call: weigh() is const, and muParser's evaluation is not.
    std::vector<double> evaluate(const std::vector<MapQuantities>& maps, double offset) const {
        std::vector<double> ratios;
        ratios.reserve(maps.size());
        try {
            double values[kQuantityCount] = {};
            mu::Parser parser;
            for (size_t q = 0; q < kQuantityCount; ++q)
                parser.DefineVar(kQuantities[q].name, &values[q]);
            parser.SetExpr(expression_);
            for (const MapQuantities& map : maps) {
                for (size_t q = 0; q < kQuantityCount; ++q)
                    values[q] = kQuantities[q].value(map) + offset;
                int resultCount = 0;
                const mu::value_type* const results = parser.Eval(resultCount);
                if (resultCount != 1)
                    throw Error(ErrorKind::kUsage,
                                "cost model 'expr:" + expression_ + "' has " +
                                    std::to_string(resultCount) +
                                    " values separated by commas; use one that is > 0 for rays");
                if (offset == 0.0 && std::isnan(results[0])) // of a map, not of the trial
                    throw Error(ErrorKind::kUsage,
                                "cost model 'expr:" + expression_ + "' is not a number where " +
                                    valuesOf(values) +
                                    "; guard it, as in texels/(pairs+1) or sqrt(max(0,texels-96))");
                ratios.push_back(results[0] > 0.0 ? std::numeric_limits<double>::infinity() : 0.0);
            }
        } catch (const mu::Parser::exception_type& error) {
            std::string names;
            for (const Quantity& quantity : kQuantities)
                names += names.empty() ? quantity.name : std::string(", ") + quantity.name;
            // muParser's word for what it did not expect, such as an operator without operands.
            const bool isUnexpected = error.GetCode() == mu::ecINTERNAL_ERROR;
            throw Error(ErrorKind::kUsage, "cost model 'expr:" + expression_ + "': " +
                                               (isUnexpected ? "an operator lacks an operand"
                                                             : error.GetMsg() + " (at position " +
                                                                   std::to_string(error.GetPos()) +
                                                                   " of the expression)") +
                                               "; it may use " + names);
        }
        return ratios;
    }

    uint32_t counts_ = kCountsNothing;
    std::string expression_;
};

} // namespace

std::unique_ptr<CostModel> makeExpressionModel(const std::string& expression) {
    return std::make_unique<ExpressionModel>(expression);
}

} // namespace shadowdag
