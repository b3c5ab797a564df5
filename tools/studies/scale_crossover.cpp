// SPDX-License-Identifier: Apache-2.0
// Where a method becomes faster than Embree as triangles grow.
#include "tools/studies/scale.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

namespace shadowdag {

namespace {

/// Times of both at a number of triangles.
struct Both {
    double triangleCount, logRatio; ///< log(method / base), below 0 if the method is faster
};

std::vector<Both> partners(const std::vector<ScalePoint>& method,
                           const std::vector<ScalePoint>& base) {
    std::vector<Both> both;
    for (const ScalePoint& of : method)
        for (const ScalePoint& other : base)
            if (of.triangleCount == other.triangleCount && of.nsPerPair > 0 && other.nsPerPair > 0)
                both.push_back({of.triangleCount, std::log(of.nsPerPair / other.nsPerPair)});
    std::sort(both.begin(), both.end(),
              [](const Both& a, const Both& b) { return a.triangleCount < b.triangleCount; });
    return both;
}

/// Returns where the line between two points, of which one is below 0, crosses it.
double crossing(const Both& a, const Both& b) {
    const double share = a.logRatio / (a.logRatio - b.logRatio);
    return a.triangleCount * std::pow(b.triangleCount / a.triangleCount, share);
}

std::string countText(double count) {
    char text[32];
    if (count >= 1e6)
        std::snprintf(text, sizeof text, "%.3g M", count * 1e-6);
    else
        std::snprintf(text, sizeof text, "%.0f k", count * 1e-3);
    return count >= 1e4 ? text : std::to_string(std::llround(count));
}

std::string textOf(const Crossover& crossover) {
    switch (crossover.kind) {
    case CrossoverKind::kNever:
        return "slower than Embree up to " + countText(crossover.largest) + " triangles";
    case CrossoverKind::kFrom:
        return "faster than Embree from " + countText(crossover.triangleCount) + " triangles on";
    case CrossoverKind::kEverywhere:
        return crossover.least == crossover.largest
                   ? "faster than Embree at " + countText(crossover.largest) + " triangles"
                   : "faster than Embree at all numbers of triangles, " +
                         countText(crossover.least) + " to " + countText(crossover.largest);
    case CrossoverKind::kUpTo:
        return "faster than Embree up to " + countText(crossover.triangleCount) +
               " triangles, slower at " + countText(crossover.largest);
    case CrossoverKind::kNone:
        break;
    }
    return "not measured beside Embree";
}

} // namespace

Crossover crossoverOf(std::vector<ScalePoint> method, std::vector<ScalePoint> base) {
    const std::vector<Both> both = partners(method, base);
    Crossover crossover;
    if (both.empty())
        return crossover;
    crossover.least = both.front().triangleCount;
    crossover.largest = both.back().triangleCount;
    const auto isFaster = [&](size_t i) { return both[i].logRatio < 0; };
    size_t last = both.size() - 1; // the first of those at the end that are alike
    while (last > 0 && isFaster(last - 1) == isFaster(both.size() - 1))
        --last;
    if (last == 0) {
        crossover.kind = isFaster(0) ? CrossoverKind::kEverywhere : CrossoverKind::kNever;
        return crossover;
    }
    crossover.kind = isFaster(last) ? CrossoverKind::kFrom : CrossoverKind::kUpTo;
    crossover.triangleCount = crossing(both[last - 1], both[last]);
    return crossover;
}

Json crossoversOf(const Json& cells) {
    struct Series {
        std::string row, method;
        std::vector<ScalePoint> points;
        std::map<double, const Json*> cells; // by number of triangles
    };
    std::vector<Series> series; // in the order of the results
    for (const Json& cell : cells) {
        const std::string row = cell["row"], method = cell["method"];
        auto found = std::find_if(series.begin(), series.end(), [&](const Series& of) {
            return of.row == row && of.method == method;
        });
        if (found == series.end())
            found = series.insert(series.end(), {row, method, {}, {}});
        const double count = cell["triangle_count"].get<double>();
        found->points.push_back({count, cell["ns_per_pair"].get<double>()});
        found->cells[count] = &cell;
    }
    Json crossovers = Json::array();
    for (const Series& of : series) {
        const auto embree = std::find_if(series.begin(), series.end(), [&](const Series& other) {
            return other.row == of.row && other.method == "embree";
        });
        if (of.method == "embree" || embree == series.end())
            continue;
        const Crossover crossover = crossoverOf(of.points, embree->points);
        Json json = {{"row", of.row},
                     {"method", of.method},
                     {"kind", kCrossoverNames[size_t(crossover.kind)]},
                     {"triangle_count", nullptr},
                     {"text", textOf(crossover)}};
        if (crossover.triangleCount > 0)
            json["triangle_count"] = crossover.triangleCount;
        if (crossover.kind != CrossoverKind::kNone) {
            const Json &own = *of.cells.at(crossover.largest),
                       &other = *embree->cells.at(crossover.largest);
            json["least_triangle_count"] = crossover.least;
            json["largest_triangle_count"] = crossover.largest;
            json["ns_per_pair"] = own["ns_per_pair"];
            json["embree_ns_per_pair"] = other["ns_per_pair"];
            // A single time has no interval.
            json["are_apart"] = own["ns_per_pair_confidence"] > 0 &&
                                other["ns_per_pair_confidence"] > 0 &&
                                (own["ns_per_pair_high"] < other["ns_per_pair_low"] ||
                                 other["ns_per_pair_high"] < own["ns_per_pair_low"]);
        }
        crossovers.push_back(std::move(json));
    }
    return crossovers;
}

} // namespace shadowdag
