// SPDX-License-Identifier: Apache-2.0
// Stability over resolution: the error against voxel depth and against texel density, and the
// fitted rate.
#include "tools/studies/stability.h"
#include "tools/studies/stability_stage.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

FittedRate fitRate(const std::vector<std::pair<double, double>>& points) {
    std::vector<double> xs, ys;
    for (const auto& [x, y] : points)
        if (x > 0 && y > 0) {
            xs.push_back(std::log2(x));
            ys.push_back(std::log2(y));
        }
    const size_t n = xs.size();
    if (n < size_t(kRatePoints))
        throw Error(ErrorKind::kUsage, "fitRate: " + std::to_string(n) + " points of " +
                                           std::to_string(points.size()) +
                                           " are positive; a rate needs " +
                                           std::to_string(kRatePoints) + " or more");
    double meanX = 0, meanY = 0;
    for (size_t i = 0; i < n; ++i) {
        meanX += xs[i] / double(n);
        meanY += ys[i] / double(n);
    }
    double xx = 0, xy = 0;
    for (size_t i = 0; i < n; ++i) {
        xx += (xs[i] - meanX) * (xs[i] - meanX);
        xy += (xs[i] - meanX) * (ys[i] - meanY);
    }
    FittedRate fit;
    fit.pointCount = n;
    fit.slope = xy / xx;
    double residual = 0;
    for (size_t i = 0; i < n; ++i) {
        const double off = ys[i] - meanY - fit.slope * (xs[i] - meanX);
        residual += off * off;
    }
    fit.standardError = std::sqrt(residual / double(n - 2) / xx);
    for (size_t i = 0; i + 1 < n; ++i) {
        const double local = (ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i]);
        fit.leastLocal = i == 0 ? local : std::min(fit.leastLocal, local);
        fit.greatestLocal = i == 0 ? local : std::max(fit.greatestLocal, local);
    }
    return fit;
}

void measureResolution(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    const bool isFailure = group.scene.starts_with("builtin:fail-");
    const uint32_t width = isFailure ? table.width : table.width / 2;
    Workspace workspace(loadedScene(stabilityScene(group)), {table.backend, "", {}});
    Judge judge(workspace);
    const auto add = [&](MatrixMethod method, const StabilityFrame& result, double x, Json row) {
        const ErrorCounts& e = result.errors;
        const double pairs = double(e.pairCount);
        row.update({{"group", group.name}, {"method", kMatrixMethodNames[size_t(method)]}});
        requireEvidence(row, e.pairCount, e.occludedCount);
        row.update(
            {{"kind", group.kind},
             {"x", x},
             {"pair_count", e.pairCount},
             {"false_shadow_share", double(e.falseShadowCount) / pairs},
             {"false_light_share", double(e.falseLightCount) / pairs},
             {"wrong_share", double(e.falseShadowCount + e.falseLightCount) / pairs},
             {"mean_error", e.meanAbsVisibilityError()},
             {"contact_share", double(e.contactCount) / pairs},
             {"acne_share", double(e.acneCount) / pairs},
             {"unexplained_share",
              double(e.unexplainedFalseShadowCount + e.unexplainedFalseLightCount) / pairs}});
        results["resolution"].push_back(row);
    };
    const auto fit = [&](MatrixMethod method, const std::string& measure) {
        std::vector<std::pair<double, double>> points;
        for (const Json& row : results["resolution"])
            if (row["group"] == group.name && row["method"] == kMatrixMethodNames[size_t(method)] &&
                (method == MatrixMethod::kMaps || row["x"].get<double>() <= group.resolvedAt))
                points.push_back({row["x"].get<double>(), row[measure].get<double>()});
        const auto isError = [](const auto& point) { return point.second > 0; };
        if (group.isOnOtherScene &&
            std::count_if(points.begin(), points.end(), isError) < kRatePoints)
            return; // too few for a line
        const FittedRate rate = fitRate(points);
        Json row = {{"group", group.name},
                    {"case", measure},
                    {"kind", group.kind},
                    {"method", kMatrixMethodNames[size_t(method)]},
                    {"slope", rate.slope},
                    {"standard_error", rate.standardError},
                    {"least_local", rate.leastLocal},
                    {"greatest_local", rate.greatestLocal},
                    {"point_count", rate.pointCount}};
        BandInputs inputs;
        inputs.outlineCount = std::max(1, group.outlineCount);
        inputs.count = double(rate.pointCount);
        if (!group.isOnOtherScene)
            addChecks(table, results["checks"], group.part, row, measure + "_rate", rate.slope,
                      inputs);
        results["rates"].push_back(std::move(row));
    };
    const uint32_t finest = table.finestVoxelsLog2;
    for (uint32_t log2 = 6; log2 <= finest; ++log2) {
        const uint32_t resolution = 1u << log2;
        const StabilityMethod dag(MatrixMethod::kDagAll,
                                  {"resolution=" + std::to_string(resolution)}, width);
        const StabilityFrame frame = dag.measure(workspace, judge);
        add(MatrixMethod::kDagAll, frame, workspace.grid(log2).voxelSizeWorld,
            {{"case", std::to_string(resolution)}, {"resolution", resolution}});
        if (log2 < finest)
            workspace.drop(log2);
    }
    for (const double undersample : table.undersamples) {
        StabilityMethod maps(MatrixMethod::kMaps,
                             {"resolution=" + std::to_string(1u << finest) +
                              " pool=2G undersample=" + numberText(undersample)},
                             width);
        maps.setup().frame.maxFaceTexels = 8192;
        maps.setup().frame.minFaceTexels = 1;
        workspace.renderer(finest).reset();
        const StabilityFrame frame = maps.measure(workspace, judge);
        uint32_t largest = 0;
        for (const MapRecord& map : frame.frame.maps)
            largest = std::max(largest, map.quantities.faceTexels);
        add(MatrixMethod::kMaps, frame, undersample,
            {{"case", "u" + numberText(undersample)},
             {"undersample", undersample},
             {"largest_face_texels", largest},
             {"texel_count", frame.frame.counts.maps.texelCount},
             {"degrade_divisor", frame.frame.counts.maps.degradeDivisor}});
    }
    for (const MatrixMethod method : {MatrixMethod::kDagAll, MatrixMethod::kMaps})
        for (const char* measure : {"wrong_share", "mean_error"})
            fit(method, measure);
}

} // namespace shadowdag
