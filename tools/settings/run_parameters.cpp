// SPDX-License-Identifier: Apache-2.0
// The labels of configurations, and their parameters in results.
#include "cuda/error.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/setting.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cctype>
#include <limits>

namespace shadowdag {

namespace {

/// Returns the text with '_' for characters that file names should not contain.
std::string plainName(std::string text) {
    for (char& c : text)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-')
            c = '_';
    return text;
}

/// Calls `take` with the settings of frames that the run reads, those of rays first.
template <class Take> void forReadSettings(const RunParameters& run, const Take& take) {
    for (const ReadBy readBy : {ReadBy::kRays, ReadBy::kExactRays, ReadBy::kVoxels, ReadBy::kKept,
                                ReadBy::kMaps, ReadBy::kHybrid})
        for (const Setting* setting : frameSettings())
            if (setting->readBy == readBy && reads(run, readBy))
                take(*setting);
}

} // namespace

Json RunParameters::toJson() const {
    Json json = Json::object();
    if (!variant.empty())
        json["variant"] = variant;
    if (usesVoxels())
        json["resolution"] = resolution;
    forReadSettings(
        *this, [&](const Setting& setting) { json[setting.parameter] = setting.frameJson(frame); });
    if (model.starts_with("texels:") && !usesEmbree()) {
        const std::string threshold = model.substr(7);
        json["threshold_texels"] =
            threshold == "inf"
                ? Json("inf")
                : Json(parseNumber("threshold", threshold, 0, std::numeric_limits<double>::max()));
    }
    return json;
}

std::string RunParameters::label() const {
    if (!variant.empty())
        return variant;
    std::string text = method;
    if (isRouted())
        text += " " + model;
    if (usesVoxels())
        text += " " + std::to_string(resolution) + "^3";
    static const FrameOptions kUsual = baseOptions(Experiment());
    forReadSettings(*this, [&](const Setting& setting) {
        const std::string value = setting.frameText(frame);
        if (value == setting.frameText(kUsual) && !setting.isAlwaysInLabel)
            return;
        std::string part = setting.label;
        text += part.replace(part.find('#'), 1, value);
    });
    return text;
}

std::string fileSlug(const std::string& text) {
    constexpr size_t kLongest = 60, kHashDigits = 8;
    std::string name = plainName(text);
    if (name == text && name.size() <= kLongest)
        return name;
    name.resize(std::min(name.size(), kLongest - kHashDigits - 1));
    return name + "-" + textHash(text).substr(0, kHashDigits);
}

std::string RunParameters::slug() const {
    // Only expressions can differ in nothing but characters that file names cannot contain.
    const std::string name = plainName(label());
    return model.starts_with("expr:") || !variant.empty() || name.size() > 60 ? fileSlug(label())
                                                                              : name;
}

void refuseLods(const std::vector<RunParameters>& runs) {
    for (const RunParameters& run : runs) {
        const RayOptions& rays = run.frame.rays;
        if (run.usesRays() && rays.usesLevels() && !rays.believesAll() && !rays.believesNone())
            throw Error(ErrorKind::kUsage,
                        "'" + run.label() +
                            "': a number for --believe bounds how far voxels displace a shadow, "
                            "but with --lod rays meet larger cells; use --believe all, or drop "
                            "--lod");
        if (run.usesVoxels() && rays.lod == LodRule::kFixed && run.resolution > 0 &&
            (run.resolution >> rays.level) == 0)
            throw Error(ErrorKind::kUsage, "--lod '" + std::to_string(rays.level) +
                                               "': " + std::to_string(run.resolution) +
                                               "^3 voxels have levels 0 to " +
                                               std::to_string(std::countr_zero(run.resolution)) +
                                               "; choose one of them, or a higher --resolution");
    }
}

} // namespace shadowdag
