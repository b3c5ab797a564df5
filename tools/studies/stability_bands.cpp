// SPDX-License-Identifier: Apache-2.0
// Compares a row's measure with the study's band for it, or with the recorded value instead.
//
// Terms used throughout. An outline is wrong by a strip whose width is its distance from the
// voxel's or texel's border: uniform between none and a whole one, so half of one on average with a
// standard deviation of sqrt(1/12), 0.577 of the mean. For K independently placed outlines the mean
// has 0.577 / sqrt(K); three of these, a = 1.73 / sqrt(K), is the change of the error when only the
// places change.
#include "tools/studies/stability.h"

#include "cuda/error.h"
#include "hybrid/routing/formula.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// Returns a row's group, case and method, for messages.
std::string nameOf(const Json& row) {
    return row["group"].get<std::string>() + ", " + row["case"].get<std::string>() + ", by " +
           row["method"].get<std::string>();
}

} // namespace

std::pair<double, double> limitsOf(const StabilityBand& band, MatrixMethod method,
                                   const BandInputs& inputs) {
    // Rounding in the method's unit: rays do not depend on texels, maps not on voxels.
    const double spacing = method == MatrixMethod::kMaps ? inputs.texelSpacing
                           : method == MatrixMethod::kHybrid
                               ? std::max(inputs.voxelSpacing, inputs.texelSpacing)
                               : inputs.voxelSpacing;
    const FormulaNames names = {{"base", inputs.base},
                                {"n", std::max(inputs.count, 1.0)},
                                {"a", 1.73 / std::sqrt(std::max(inputs.outlineCount, 1.0))},
                                {"s", spacing},
                                {"texel_spacing", inputs.texelSpacing},
                                {"voxel_spacing", inputs.voxelSpacing},
                                {"texel_ratio", inputs.texelRatio},
                                {"voxel_ratio", inputs.voxelRatio},
                                {"truth_change", inputs.truthChange},
                                {"reach_texels", inputs.reachTexels},
                                {"wrong_share", inputs.wrongShare}};
    return {evaluateFormula(band.low, names), evaluateFormula(band.high, names)};
}

void requireEvidence(const Json& row, uint64_t pairCount, uint64_t occludedCount) {
    if (occludedCount > 0 && occludedCount < pairCount)
        return;
    throw Error(ErrorKind::kInput,
                nameOf(row) + ": of " + std::to_string(pairCount) + " pairs " +
                    std::to_string(occludedCount) +
                    " are dark in the truth, so there is no shadow edge to judge; "
                    "give the group another scene or view");
}

double shareOf(const Json& row, const char* what, uint64_t part, uint64_t whole) {
    if (whole == 0)
        throw Error(ErrorKind::kInput, nameOf(row) + ": there are no " + what +
                                           ", and a share of nothing is in every band; give the "
                                           "group another scene or more pixels");
    return double(part) / double(whole);
}

std::vector<std::string> unmatchedLines(const StabilityTable& table, const Json& checks) {
    std::vector<std::string> lines;
    const auto isOf = [](const auto& names, const Json& name) {
        return std::find(names.begin(), names.end(), name.get<std::string>()) != names.end();
    };
    for (const StabilityBand& band : table.bands) {
        std::vector<std::string> methods;
        for (const MatrixMethod method : band.methods)
            methods.push_back(kMatrixMethodNames[size_t(method)]);
        if (std::none_of(checks.begin(), checks.end(), [&](const Json& check) {
                return check["part"] == kStabilityPartNames[size_t(band.part)] &&
                       check["measure"] == band.measure && isOf(band.kinds, check["kind"]) &&
                       isOf(methods, check["method"]);
            }))
            lines.push_back("band " + band.id +
                            ": matches no check; correct its \"part\", "
                            "\"kinds\", \"methods\" or \"measure\", or remove it");
    }
    for (const KnownBreak& known : table.known)
        if (std::none_of(checks.begin(), checks.end(), [&](const Json& check) {
                return check["group"] == known.group && check["kind"] == known.kind &&
                       check["method"] == known.method && check["measure"] == known.measure;
            }))
            lines.push_back("known " + known.group + ", " + known.kind + ", by " + known.method +
                            ", " + known.measure + ": matches no check; correct or remove it");
    return lines;
}

void addChecks(const StabilityTable& table, Json& checks, StabilityPart part, const Json& row,
               const std::string& measure, double value, const BandInputs& inputs) {
    const std::string kind = row["kind"], method = row["method"], group = row["group"];
    const auto add = [&](double low, double high, const std::string& band) {
        checks.push_back({{"part", kStabilityPartNames[size_t(part)]},
                          {"group", group},
                          {"case", row["case"]},
                          {"kind", kind},
                          {"method", method},
                          {"measure", measure},
                          {"value", value},
                          {"low", low},
                          {"high", high},
                          {"band", band},
                          {"holds", value >= low && value <= high}});
    };
    for (const KnownBreak& known : table.known)
        if (known.group == group && known.kind == kind && known.method == method &&
            known.measure == measure)
            return add(known.low, known.high, "known");
    for (const StabilityBand& band : table.bands) {
        const auto isMethod = [&](MatrixMethod m) {
            return kMatrixMethodNames[size_t(m)] == method;
        };
        if (band.part != part || band.measure != measure ||
            std::find(band.kinds.begin(), band.kinds.end(), kind) == band.kinds.end() ||
            std::none_of(band.methods.begin(), band.methods.end(), isMethod))
            continue;
        MatrixMethod of{};
        for (const MatrixMethod m : band.methods)
            if (isMethod(m))
                of = m;
        const auto [low, high] = limitsOf(band, of, inputs);
        return add(low, high, band.id);
    }
}

} // namespace shadowdag
