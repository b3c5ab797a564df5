// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/experiment.h"

#include "cuda/error.h"
#include "hybrid/gbuffer/tone_map.h"
#include "hybrid/routing/resolution.h"
#include "tools/settings/json_file.h"
#include "tools/settings/key_reader.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

namespace shadowdag {

namespace {

template <class T> Json jsonList(const std::vector<T>& values) {
    Json list = Json::array();
    for (const T& value : values)
        list.push_back(value);
    return list;
}

Json jsonPowers(const std::vector<uint32_t>& log2s) {
    Json list = Json::array();
    for (const uint32_t log2 : log2s)
        list.push_back(1u << log2);
    return list;
}

/// Writes 0.1f as 0.1, not as 0.10000000149.
double decimal(float value) {
    return std::stod(numberText(value));
}

Json jsonFloats(const std::vector<float>& values) {
    Json list = Json::array();
    for (const float value : values)
        if (std::isinf(value))
            list.push_back("inf");
        else
            list.push_back(decimal(value));
    return list;
}

/// Writes fixed levels as numbers, the others as their texts.
Json jsonLod(const LodChoice& lod) {
    return lod.rule == LodRule::kFixed ? Json(lod.level) : Json(lod.text());
}

Json jsonLods(const std::vector<LodChoice>& lods) {
    Json list = Json::array();
    for (const LodChoice& lod : lods)
        list.push_back(jsonLod(lod));
    return list;
}

/// Returns the text with '_' for all that a file name better lacks.
std::string plainName(std::string text) {
    for (char& c : text)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-')
            c = '_';
    return text;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

} // namespace

Experiment::Experiment() : thresholds{0, 8, 16, 32, 64, 96, 192, kInfinity} {}

std::string modelText(const std::string& method, const std::string& model) {
    if (method == "hybrid")
        return model.empty() ? "texels:96" : model;
    return method == "dag" || method == "dag-exact" ? "texels:inf" : "texels:0";
}

void checkMethod(const std::string& option, const std::string& method,
                 const std::vector<std::string>& allowed) {
    if (std::find(allowed.begin(), allowed.end(), method) != allowed.end())
        return;
    std::string names;
    for (const std::string& name : allowed)
        names += (names.empty() ? "" : ", ") + name;
    throw Error(ErrorKind::kUsage, option + " '" + method + "': must be one of " + names);
}

float Experiment::exposureOf(const std::vector<glm::vec3>& linear) const {
    return exposure > 0 ? float(exposure) : autoExposure(linear);
}

void addLod(std::vector<LodChoice>& lods, const std::string& option, const std::string& text) {
    const LodChoice lod = parseLod(option, text);
    if (std::find(lods.begin(), lods.end(), lod) != lods.end())
        throw Error(ErrorKind::kUsage, option + " '" + text + "': " + lod.text() +
                                           " stands there twice; name each value once");
    lods.push_back(lod);
}

Experiment experimentFromJson(const Json& json, const std::string& where) {
    Experiment e;
    KeyReader keys(json, where);
    // Texts that options take too are read by the same functions; their complaint becomes one about
    // the file.
    const auto parsed = [&](const char* key, const auto& parse) {
        std::string text;
        keys.text(key, text);
        if (keys.find(key) == nullptr)
            return;
        try {
            parse(text);
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, where + ": key " + error.what());
        }
    };
    keys.text("title", e.title);
    keys.texts("scenes", e.scenes);
    parsed("size", [&](const std::string& text) {
        std::tie(e.width, e.height) = parseSize("\"size\"", text);
    });
    keys.text("camera", e.camera);
    keys.number("exposure", e.exposure, 0, kMaxExposure);
    parsed("frames", [&](const std::string& text) {
        e.frames = parseFrames("\"frames\"", text);
        e.framesText = text;
    });
    keys.number("fps", e.fps, 0.001, 1e6);
    keys.number("lights", e.lightCount, -1, 100000);
    keys.number("light_seed", e.lightSeed, 0, 9e15);
    const auto powers = [&](const char* key, std::vector<uint32_t>& log2s, bool mayBeEmpty) {
        std::vector<uint32_t> values;
        if (const Json* found = keys.find(key)) {
            keys.numbers(key, values, 4, 131072, mayBeEmpty);
            log2s.clear();
            for (const uint32_t value : values) {
                if (!std::has_single_bit(value))
                    keys.refuse(key, *found, "must hold powers of two from 4 to 131072");
                log2s.push_back(uint32_t(std::countr_zero(value)));
            }
        }
    };
    powers("resolutions", e.resolutionLog2, false);
    powers("dag_resolutions", e.dagResolutionLog2, true);
    keys.texts("methods", e.methods);
    for (const std::string& method : e.methods)
        if (std::find(kMethods.begin(), kMethods.end(), method) == kMethods.end())
            keys.refuse("methods", method,
                        "must hold some of embree, dag, dag-exact, maps, hybrid");
    if (const Json* found = keys.find("thresholds")) {
        std::string joined;
        for (const Json& item : keys.list("thresholds", *found)) {
            if (!item.is_number() && item != "inf")
                keys.refuse("thresholds", item, "must hold numbers of texels or \"inf\"");
            joined += (joined.empty() ? "" : ",") +
                      (item.is_string() ? "inf" : numberText(item.get<double>()));
        }
        try {
            e.thresholds =
                joined.empty() ? std::vector<float>() : parseThresholds("\"thresholds\"", joined);
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, where + ": key " + error.what());
        }
    }
    keys.texts("models", e.models);
    for (const std::string& model : e.models)
        try {
            makeCostModel(model);
        } catch (const Error& error) {
            keys.refuse("models", model, std::string("is no cost model: ") + error.what());
        }
    keys.texts("variants", e.variants);
    if (!e.variants.empty()) {
        for (const char* key : {"thresholds", "models", "dag_resolutions"})
            if (const Json* found = keys.find(key); found != nullptr && !found->empty())
                keys.refuse(key, *found,
                            "contradicts \"variants\", which take its place: drop one");
        if (keys.find("methods") == nullptr)
            e.methods = {"embree"};
        for (const std::string& method : e.methods)
            if (method != "embree")
                keys.refuse("methods", method,
                            "contradicts \"variants\", which name their methods: use [\"embree\"], "
                            "[] or drop one");
        e.thresholds.clear();
        e.models.clear();
    }
    keys.flag("sequence", e.isSequence);
    keys.number("lead_in", e.leadIn, 0, 1000);
    keys.number("flicker_points", e.flickerPoints, 0, 10'000'000);
    keys.number("route_margin", e.routeMargin, 0, kMaxRouteMargin);
    if (e.routeMargin > 0 && !e.isSequence)
        keys.refuse("route_margin", decimal(e.routeMargin),
                    "is for frames in \"sequence\": elsewhere no frame knows the one before");
    keys.numbers("undersample", e.undersample, 1, 1024);
    keys.numbers("maps_per_light", e.mapsPerLight, 1, kMaxMapsPerLight);
    if (!e.variants.empty())
        for (const char* key : {"undersample", "maps_per_light"})
            if (const Json* found = keys.find(key);
                found != nullptr && *found != toJson(Experiment())[key])
                keys.refuse(key, *found, "contradicts \"variants\", whose names say it: drop one");
    keys.numbers("page_size", e.pageTexels, 16, 256);
    for (const uint32_t texels : e.pageTexels)
        if (!std::has_single_bit(texels))
            keys.refuse("page_size", texels, "must hold powers of two from 16 to 256");
    keys.number("pool_mib", e.poolMib, 1, 1 << 20);
    keys.number("max_face_texels", e.maxFaceTexels, 16, kMaxFaceTexels);
    keys.numbers("bias", e.bias, 0, 100);
    if (!e.variants.empty())
        e.taps = {kPaperTaps};
    keys.numbers("taps", e.taps, 1, 9);
    for (const uint32_t taps : e.taps)
        if (taps != 1 && taps != 4 && taps != 9)
            keys.refuse("taps", taps, "must be 1, 4 or 9");
    keys.numbers("polygon_lod", e.polygonLod, 0, 1024);
    keys.numbers("offset", e.offset, 0, 100);
    if (const Json* found = keys.find("lod")) {
        e.lod.clear();
        for (const Json& item : keys.list("lod", *found)) {
            if (!item.is_string() && !item.is_number_integer())
                keys.refuse("lod", item, "must hold levels from 0 to 17 or texts as --lod takes");
            const std::string text = item.is_string() ? item.get<std::string>() : item.dump();
            try {
                addLod(e.lod, "\"lod\"", text);
            } catch (const Error& error) {
                throw Error(ErrorKind::kInput, where + ": key " + error.what());
            }
        }
        if (e.lod.empty())
            keys.refuse("lod", *found, "must hold at least one value");
    }
    keys.number("repeats", e.repeats, 1, 1000);
    keys.number("warmups", e.warmups, 0, 1000);
    keys.number("error_seed", e.errorSeed, 0, 9e15);
    keys.finish();
    if (!e.variants.empty()) {
        try {
            e.variants = parseVariants("\"variants\"", e.variants, baseOptions(e));
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, where + ": key " + error.what());
        }
    }
    return e;
}

Experiment readExperiment(const std::string& path) {
    return experimentFromJson(
        readJsonFile(path, "give an experiment file, as in scenes/experiments/atrium.json"), path);
}

Json toJson(const Experiment& e) {
    return {{"title", e.title},
            {"scenes", e.scenes},
            {"size", std::to_string(e.width) + "x" + std::to_string(e.height)},
            {"camera", e.camera},
            {"exposure", e.exposure},
            {"frames", e.framesText},
            {"fps", e.fps},
            {"lights", e.lightCount},
            {"light_seed", e.lightSeed},
            {"resolutions", jsonPowers(e.resolutionLog2)},
            {"dag_resolutions", jsonPowers(e.dagResolutionLog2)},
            {"methods", e.methods},
            {"thresholds", jsonFloats(e.thresholds)},
            {"models", e.models},
            {"variants", e.variants},
            {"sequence", e.isSequence},
            {"lead_in", e.leadIn},
            {"flicker_points", e.flickerPoints},
            {"route_margin", decimal(e.routeMargin)},
            {"undersample", jsonFloats(e.undersample)},
            {"maps_per_light", jsonList(e.mapsPerLight)},
            {"page_size", jsonList(e.pageTexels)},
            {"pool_mib", e.poolMib},
            {"max_face_texels", e.maxFaceTexels},
            {"bias", jsonFloats(e.bias)},
            {"taps", jsonList(e.taps)},
            {"polygon_lod", jsonFloats(e.polygonLod)},
            {"offset", jsonFloats(e.offset)},
            {"lod", jsonLods(e.lod)},
            {"repeats", e.repeats},
            {"warmups", e.warmups},
            {"error_seed", e.errorSeed}};
}

Json RunParameters::toJson() const {
    Json json = Json::object();
    if (!variant.empty())
        json["variant"] = variant;
    if (usesRays()) {
        json["resolution"] = resolution;
    }
    if (usesVoxelRays()) {
        json["offset"] = decimal(frame.rays.offset);
        json["lod"] = jsonLod(LodChoice(frame.rays));
    }
    if (usesMaps()) {
        json["undersample"] = decimal(frame.undersample);
        json["maps_per_light"] = frame.mapsPerLight;
        json["page_size"] = frame.maps.pageTexels;
        json["pool_bytes"] = frame.maps.poolBytes;
        json["max_face_texels"] = frame.maxFaceTexels;
        json["bias"] = decimal(frame.bias.constantTexels);
        json["taps"] = frame.bias.taps;
        json["polygon_lod"] = decimal(frame.maps.lodTexels);
    }
    if (method == "hybrid")
        json["route_margin"] = decimal(frame.routeMargin);
    if (model.starts_with("texels:")) {
        const std::string threshold = model.substr(7);
        json["threshold_texels"] = threshold == "inf" ? Json("inf") : Json(std::stod(threshold));
    }
    return json;
}

std::string RunParameters::label() const {
    if (!variant.empty())
        return variant;
    std::string text = method;
    if (method == "hybrid")
        text += " " + model;
    const FrameOptions usual;
    if (usesRays()) {
        text += " " + std::to_string(resolution) + "^3";
    }
    if (usesVoxelRays()) {
        if (frame.rays.offset != usual.rays.offset)
            text += " offset " + numberText(frame.rays.offset);
        if (const LodChoice lod(frame.rays); lod != LodChoice(usual.rays))
            text += " lod " + lod.text();
    }
    if (usesMaps()) {
        if (frame.undersample != usual.undersample)
            text += " u" + numberText(frame.undersample);
        if (frame.mapsPerLight != usual.mapsPerLight)
            text += " " + std::to_string(frame.mapsPerLight) + "SM";
        if (frame.maps.pageTexels != usual.maps.pageTexels)
            text += " pages " + std::to_string(frame.maps.pageTexels);
        if (frame.bias.constantTexels != usual.bias.constantTexels)
            text += " bias " + numberText(frame.bias.constantTexels);
        if (frame.bias.taps != usual.bias.taps)
            text += " taps " + std::to_string(frame.bias.taps);
        if (frame.maps.lodTexels != usual.maps.lodTexels)
            text += " polygon lod " + numberText(frame.maps.lodTexels);
    }
    if (method == "hybrid" && frame.routeMargin != usual.routeMargin)
        text += " margin " + numberText(frame.routeMargin);
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
    // Only an expression can differ in nothing but what a file name cannot hold.
    const std::string name = plainName(label());
    return model.starts_with("expr:") || !variant.empty() || name.size() > 60 ? fileSlug(label())
                                                                              : name;
}

FrameOptions baseOptions(const Experiment& e) {
    FrameOptions base;
    base.width = e.width;
    base.height = e.height;
    base.routeMargin = e.routeMargin;
    base.maps.poolBytes = uint64_t(e.poolMib) << 20;
    base.maxFaceTexels = e.maxFaceTexels;
    base.undersample = e.undersample[0];
    base.mapsPerLight = e.mapsPerLight[0];
    base.maps.pageTexels = e.pageTexels[0];
    base.bias.constantTexels = e.bias[0];
    base.bias.taps = base.maps.taps = e.taps[0];
    base.maps.lodTexels = e.polygonLod[0];
    base.rays.offset = e.offset[0];
    e.lod[0].apply(base.rays);
    return base;
}

void refuseDeepLods(const std::vector<RunParameters>& runs) {
    for (const RunParameters& run : runs)
        if (run.usesVoxelRays() && run.frame.rays.lod == LodRule::kFixed && run.resolution > 0 &&
            (run.resolution >> run.frame.rays.level) == 0)
            throw Error(ErrorKind::kUsage, "--lod '" + std::to_string(run.frame.rays.level) +
                                               "': " + std::to_string(run.resolution) +
                                               "^3 voxels have levels 0 to " +
                                               std::to_string(std::countr_zero(run.resolution)) +
                                               "; give one of them, or more --resolution");
}

std::vector<uint32_t> allResolutions(const Experiment& e) {
    std::vector<uint32_t> all = e.resolutionLog2;
    for (const uint32_t log2 : e.dagResolutionLog2)
        if (std::find(all.begin(), all.end(), log2) == all.end())
            all.push_back(log2);
    return all;
}

std::vector<RunParameters>
configurations(const Experiment& e, const std::vector<uint32_t>& dagResolutions, size_t fullCount) {
    const auto has = [&](const char* method) {
        return std::find(e.methods.begin(), e.methods.end(), method) != e.methods.end();
    };
    std::vector<RunParameters> runs;
    std::set<std::string> seen;
    const auto add = [&](RunParameters run) {
        if (has(run.method.c_str()) && seen.insert(run.label()).second)
            runs.push_back(std::move(run));
    };
    const FrameOptions base = baseOptions(e);
    add({"embree", "", 0, 0, base, ""});
    if (!e.variants.empty()) {
        for (const auto& [key, count] :
             {std::pair<const char*, size_t>{"page_size", e.pageTexels.size()},
              {"bias", e.bias.size()},
              {"taps", e.taps.size()},
              {"polygon_lod", e.polygonLod.size()},
              {"offset", e.offset.size()},
              {"lod", e.lod.size()},
              {"resolutions", dagResolutions.size()}})
            if (count > 1)
                throw Error(ErrorKind::kUsage, std::string(key) + " names " +
                                                   std::to_string(count) +
                                                   " values; beside variants it takes one, since a "
                                                   "variant is one configuration");
        for (const std::string& name : e.variants) {
            RunParameters run = variantRun(parseVariant("variants", name), base);
            run.resolution = run.usesRays() && !dagResolutions.empty() ? dagResolutions[0] : 0;
            runs.push_back(std::move(run));
        }
        return runs;
    }
    const size_t dagCount = dagResolutions.size();
    const auto resolutionOf = [&](size_t dag) { return dag < dagCount ? dagResolutions[dag] : 0; };
    const auto addThreshold = [&](float threshold, size_t dag, const FrameOptions& frame) {
        const std::string model = "texels:" + numberText(threshold);
        const std::string method = threshold == 0          ? "maps"
                                   : std::isinf(threshold) ? "dag"
                                                           : "hybrid";
        add({method, model, uint32_t(dag), method == "maps" ? 0 : resolutionOf(dag), frame, ""});
    };
    std::vector<float> thresholds = e.thresholds;
    thresholds.push_back(0); // the two pure methods belong to every comparison that names them
    thresholds.push_back(kInfinity);
    std::sort(thresholds.begin(), thresholds.end());
    thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());

    for (size_t dag = 0; dag < std::max<size_t>(fullCount, 1); ++dag)
        for (const float undersample : e.undersample)
            for (const uint32_t mapsPerLight : e.mapsPerLight)
                for (const uint32_t page : e.pageTexels)
                    for (const float bias : e.bias)
                        for (const uint32_t taps : e.taps)
                            for (const float polygonLod : e.polygonLod)
                                for (const float offset : e.offset)
                                    for (const LodChoice& lod : e.lod)
                                        for (const float threshold : thresholds) {
                                            FrameOptions frame = base;
                                            frame.undersample = undersample;
                                            frame.mapsPerLight = mapsPerLight;
                                            frame.maps.pageTexels = page;
                                            frame.bias.constantTexels = bias;
                                            frame.bias.taps = frame.maps.taps = taps;
                                            frame.maps.lodTexels = polygonLod;
                                            frame.rays.offset = offset;
                                            lod.apply(frame.rays);
                                            addThreshold(threshold, dag, frame);
                                        }
    for (size_t dag = fullCount; dag < dagCount; ++dag)
        addThreshold(kInfinity, dag, base);
    for (size_t dag = 0; dag < dagCount; ++dag) {
        RunParameters exact{"dag-exact",         "texels:inf", uint32_t(dag),
                            dagResolutions[dag], base,         ""};
        exact.frame.rays.kind = RayKind::kExact;
        add(std::move(exact));
    }
    for (const std::string& model : e.models)
        add({"hybrid", model, 0, resolutionOf(0), base, ""});
    return runs;
}

} // namespace shadowdag
