// SPDX-License-Identifier: Apache-2.0
// The table of settings. Its order is that of experiment files; settings of frames are varied in
// it, the first slowest.
#include "cuda/error.h"
#include "hybrid/routing/resolution.h"
#include "tools/settings/setting.h"
#include "tools/settings/setting_codec.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

namespace shadowdag {

namespace {

using Group = SettingGroup;
using Frame = FrameOptions;

constexpr uint32_t kMaxResolution = 131072;

Codec<float> thresholdCodec() {
    return {[](const std::string& name, const std::string& text) {
                return text == "auto" ? kAutomaticThreshold : parseThresholds(name, text).at(0);
            },
            [](const float& value) {
                return value == kAutomaticThreshold ? "auto" : numberText(double(value));
            },
            [](const float& value) {
                return value == kAutomaticThreshold ? Json("auto") : decimalJson(double(value));
            }};
}

/// Pixels by which a believed shadow may be displaced: all and none are infinity and 0.
Codec<float> believeCodec() {
    const auto textOf = [](float pixels) {
        return std::isinf(pixels) ? "all" : pixels == 0 ? "none" : numberText(double(pixels));
    };
    return {[](const std::string& name, const std::string& text) {
                if (text == "all" || text == "none")
                    return text == "all" ? std::numeric_limits<float>::infinity() : 0.0f;
                try {
                    return float(parseNumber(name, text, 0.001, 1e6));
                } catch (const Error&) {
                    throw Error(ErrorKind::kUsage,
                                name + " '" + text +
                                    "': must be all, none or a number of pixels from 0.001 to "
                                    "1000000");
                }
            },
            [=](const float& pixels) { return std::string(textOf(pixels)); },
            [=](const float& pixels) {
                return std::isinf(pixels) || pixels == 0 ? Json(textOf(pixels))
                                                         : decimalJson(pixels);
            }};
}

Codec<LodChoice> lodCodec() {
    return {[](const std::string& name, const std::string& text) { return parseLod(name, text); },
            [](const LodChoice& lod) { return lod.text(); },
            // Fixed levels as numbers, the others as their texts.
            [](const LodChoice& lod) {
                return lod.rule == LodRule::kFixed ? Json(lod.level) : Json(lod.text());
            }};
}

Codec<uint32_t> tapsCodec() {
    Codec<uint32_t> codec = wholeCodec<uint32_t>(1, 9);
    codec.parse = [](const std::string& name, const std::string& text) {
        const uint32_t taps = uint32_t(parseInteger(name, text, 1, 9));
        if (taps != 1 && taps != 4 && taps != 9)
            throw Error(ErrorKind::kUsage, name + " '" + text + "': must be 1, 4 or 9");
        return taps;
    };
    return codec;
}

/// MiB: numbers in files, bytes with a unit as options.
Codec<uint32_t> mebibytesCodec(uint32_t leastMib, uint32_t mostMib) {
    return {[leastMib, mostMib](const std::string& name, const std::string& text) {
                const bool isOption = name[0] == '-';
                if (!isOption)
                    return uint32_t(parseInteger(name, text, leastMib, mostMib));
                if (leastMib == 0 && text == "0")
                    return 0u;
                const uint64_t bytes = parseBytes(name, text);
                if (bytes < (1u << 20) || bytes % (1u << 20) != 0 || bytes >> 20 > mostMib)
                    throw Error(ErrorKind::kUsage,
                                name + " '" + text + "': must be " +
                                    (leastMib == 0 ? "0 or " : "") + "whole MiB from 1M to " +
                                    std::to_string(mostMib >> 10) + "G, as in 256M");
                return uint32_t(bytes >> 20);
            },
            [](const uint32_t& mib) { return mib == 0 ? "0" : std::to_string(mib) + "M"; },
            [](const uint32_t& mib) { return Json(mib); }};
}

Codec<std::string> methodCodec() {
    Codec<std::string> codec = textCodec();
    codec.parse = [](const std::string& name, const std::string& text) {
        checkMethod(name, text, measuredMethodNames());
        return text;
    };
    return codec;
}

Codec<std::string> modelCodec() {
    Codec<std::string> codec = textCodec();
    codec.parse = [](const std::string& name, const std::string& text) {
        try {
            makeCostModel(text); // throws for an unknown one, before any work
        } catch (const Error& error) {
            if (name[0] == '-')
                throw;
            throw Error(ErrorKind::kUsage,
                        name + " '" + text + "': is not a cost model: " + error.what());
        }
        return text;
    };
    return codec;
}

Codec<FrameStart> startCodec() {
    const auto textOf = [](FrameStart start) {
        return std::string(start == FrameStart::kWarm ? "warm" : "cold");
    };
    return {[=](const std::string& name, const std::string& text) {
                for (const FrameStart start : {FrameStart::kCold, FrameStart::kWarm})
                    if (text == textOf(start))
                        return start;
                throw Error(ErrorKind::kUsage, name + " '" + text + "': must be cold or warm");
            },
            [=](const FrameStart& start) { return textOf(start); },
            [=](const FrameStart& start) { return Json(textOf(start)); }};
}

Setting sizeSetting() {
    Setting row{.key = "size",
                .option = "--size",
                .group = Group::kView,
                .kind = "WxH",
                .help = "Picture size in pixels",
                .form = JsonForm::kText};
    row.set = [](Experiment& e, const std::string& name, const std::vector<std::string>& texts) {
        std::tie(e.width, e.height) = parseSize(name, texts.at(0));
    };
    row.texts = [](const Experiment& e) {
        return std::vector<std::string>{std::to_string(e.width) + "x" + std::to_string(e.height)};
    };
    row.json = [texts = row.texts](const Experiment& e) { return Json(texts(e)[0]); };
    return row;
}

Setting framesSetting() {
    Setting row{.key = "frames",
                .option = "--frames",
                .group = Group::kView,
                .kind = "A:B",
                .help = "Frames A to B, both included, or A:B:STEP",
                .form = JsonForm::kText};
    row.set = [](Experiment& e, const std::string& name, const std::vector<std::string>& texts) {
        e.frames = parseFrames(name, texts.at(0));
        e.framesText = texts.at(0);
    };
    row.texts = [](const Experiment& e) { return std::vector<std::string>{e.framesText}; };
    row.json = [](const Experiment& e) { return Json(e.framesText); };
    return row;
}

Setting sequenceSetting() {
    Setting row{.key = "sequence",
                .option = "--sequence",
                .group = Group::kSweep,
                .help = "Render frames in order and keep state between them; otherwise "
                        "frames are independent",
                .form = JsonForm::kFlag};
    row.set = [](Experiment& e, const std::string&, const std::vector<std::string>& texts) {
        e.isSequence = texts.at(0) == "true";
    };
    row.texts = [](const Experiment& e) {
        return std::vector<std::string>{e.isSequence ? "true" : "false"};
    };
    row.json = [](const Experiment& e) { return Json(e.isSequence); };
    return row;
}

std::vector<Setting> makeSettings() {
    std::vector<Setting> t;
    t.push_back(oneValue({.key = "title",
                          .option = "--title",
                          .group = Group::kSweep,
                          .kind = "TEXT",
                          .help = "Title of the report",
                          .form = JsonForm::kText},
                         &Experiment::title, textCodec()));
    t.push_back(
        listOf({.key = "scenes", .form = JsonForm::kText, .isList = true, .mayBeEmpty = true},
               &Experiment::scenes, textCodec()));
    t.push_back(sizeSetting());
    t.push_back(oneValue(
        {.key = "camera",
         .option = "--camera",
         .group = Group::kView,
         .kind = "auto|NAME|NUMBERS",
         .help = "auto places one, auto-2 to auto-" + std::to_string(kMaxViewCount) +
                 " another; NAME is a camera of the scene; NUMBERS are "
                 "px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]]: "
                 "position, target, vertical field of view, planes in metres, roll to the right",
         .shownDefault = "the scene's first, else auto",
         .form = JsonForm::kText},
        &Experiment::camera, textCodec()));
    t.push_back(oneValue({.key = "views",
                          .option = "--views",
                          .group = Group::kViews,
                          .kind = "N",
                          .help = "Automatic views of every scene, from 1 to " +
                                  std::to_string(kMaxViewCount) +
                                  ": auto, auto-2 and so on, each by itself",
                          .shownDefault = "1: the view of --camera"},
                         &Experiment::viewCount, wholeCodec<uint32_t>(1, kMaxViewCount)));
    t.push_back(oneValue({.key = "exposure",
                          .option = "--exposure",
                          .group = Group::kPictures,
                          .kind = "E",
                          .help = "Factor on radiance before tone mapping; 0: maps the median "
                                  "luminance of what is lit to 0.18"},
                         &Experiment::exposure, numberCodec<double>(0, kMaxExposure)));
    t.push_back(framesSetting());
    t.push_back(oneValue({.key = "fps",
                          .option = "--fps",
                          .group = Group::kView,
                          .kind = "RATE",
                          .help = "Frame f shows the scene at f / RATE seconds"},
                         &Experiment::fps, numberCodec<double>(0.001, 1e6)));
    t.push_back(oneValue({.key = "lights",
                          .option = "--lights",
                          .group = Group::kLights,
                          .kind = "N",
                          .help = "Replaces the scene's lights by N generated lights",
                          .shownDefault = "-1: keep the scene's"},
                         &Experiment::lightCount, wholeCodec<int>(-1, kMaxPlacedLightCount)));
    t.push_back(oneValue({.key = "light_seed",
                          .option = "--seed",
                          .group = Group::kLights,
                          .kind = "S",
                          .help = "Seed of the generated lights"},
                         &Experiment::lightSeed, wholeCodec<uint64_t>(0, 9'000'000'000'000'000)));
    t.push_back(listOf(
        {.key = "resolutions",
         .option = "--resolution",
         .group = Group::kVoxels,
         .kind = "N",
         .help = "Voxels per axis, a power of two up to 131072; built when needed and cached",
         .readBy = ReadBy::kRays,
         .isList = true,
         .isVaried = true},
        &Experiment::resolutionLog2, powerCodec(4, kMaxResolution, true)));
    t.push_back(
        listOf({.key = "dag_resolutions",
                .option = "--dag-resolution",
                .group = Group::kSweep,
                .kind = "N",
                .help = "More resolutions for method dag only, to show how its error decreases",
                .shownDefault = "none",
                .readBy = ReadBy::kVoxelsAlone,
                .isList = true,
                .isVaried = true,
                .mayBeEmpty = true,
                .isSetByVariant = true},
               &Experiment::dagResolutionLog2, powerCodec(4, kMaxResolution, true)));
    t.push_back(listOf({.key = "methods",
                        .option = "--methods",
                        .group = Group::kSweep,
                        .kind = "M",
                        .help = "Some of " + joinedNames(measuredMethodNames()),
                        .form = JsonForm::kText,
                        .isList = true,
                        .isVaried = true,
                        .mayBeEmpty = true,
                        .isSetByVariant = true},
                       &Experiment::methods, methodCodec()));
    t.push_back(listOf({.key = "thresholds",
                        .option = "--thresholds",
                        .group = Group::kSweep,
                        .kind = "T",
                        .help = "For hybrid: maps that require fewer texels are traced; 0 is maps "
                                "alone, inf rays alone; auto takes quantiles of what the maps of "
                                "a scene's first frame require",
                        .readBy = ReadBy::kHybrid,
                        .form = JsonForm::kNumberOrText,
                        .isList = true,
                        .isVaried = true,
                        .mayBeEmpty = true,
                        .isSetByVariant = true},
                       &Experiment::thresholds, thresholdCodec()));
    t.back().set = [set = t.back().set](Experiment& e, const std::string& name,
                                        const std::vector<std::string>& texts) {
        set(e, name, texts);
        std::sort(e.thresholds.begin(), e.thresholds.end());
        if (e.thresholds.size() > 1 && e.thresholds[0] == kAutomaticThreshold)
            throw Error(ErrorKind::kUsage, name + ": auto stands alone; drop it or the numbers");
    };
    t.push_back(listOf({.key = "models",
                        .option = "--model",
                        .group = Group::kSweep,
                        .kind = "M",
                        .help = "A further cost model for hybrid: texels:N, expr:EXPRESSION, cost, "
                                "oracle; may be given several times",
                        .readBy = ReadBy::kHybrid,
                        .form = JsonForm::kText,
                        .isList = true,
                        .mayBeEmpty = true,
                        .isSetByVariant = true},
                       &Experiment::models, modelCodec()));
    t.push_back(listOf({.key = "variants",
                        .option = "--variants",
                        .group = Group::kSweep,
                        .kind = "NAME",
                        .help = variantsHelp(),
                        .shownDefault = "none",
                        .form = JsonForm::kText,
                        .isList = true,
                        .isVaried = true,
                        .mayBeEmpty = true},
                       &Experiment::variants, textCodec()));
    t.push_back(sequenceSetting());
    t.push_back(
        oneValue({.key = "lead_in",
                  .option = "--lead-in",
                  .group = Group::kSweep,
                  .kind = "N",
                  .help = "For a sequence: frames rendered before each frame and not counted"},
                 &Experiment::leadIn, wholeCodec<uint32_t>(0, 1000)));
    t.push_back(
        oneValue({.key = "flicker_points",
                  .option = "--flicker-points",
                  .group = Group::kSweep,
                  .kind = "N",
                  .help = "For a sequence: number of surface points whose visibility is followed"},
                 &Experiment::flickerPoints, wholeCodec<uint32_t>(0, 10'000'000)));
    t.push_back(frameValue(
        {.key = "start",
         .option = "--start",
         .group = Group::kMaps,
         .kind = "cold|warm",
         .help = "What a single frame finds: cold for nothing, so that every map is drawn; warm "
                 "for the maps and beams of a frame of the same view",
         .readBy = ReadBy::kKept,
         .form = JsonForm::kText,
         .isList = true,
         .label = " #",
         .parameter = "start"},
        &Experiment::start, startCodec(), [](const Frame& f) { return f.start; },
        [](Frame& f, FrameStart start) { f.start = start; }));
    t.push_back(frameValue(
        {.key = "route_margin",
         .option = "--route-margin",
         .group = Group::kRoutes,
         .kind = "M",
         .help = "For hybrid, over frames in sequence: a map changes its "
                 "method only when the other is cheaper by more than the "
                 "factor 1 + M, 0 to " +
                 numberText(kMaxRouteMargin),
         .readBy = ReadBy::kHybrid,
         .isSettableByVariants = true,
         .label = " margin #",
         .parameter = "route_margin"},
        &Experiment::routeMargin, numberCodec<float>(0, kMaxRouteMargin),
        [](const Frame& f) { return f.routeMargin; },
        [](Frame& f, float margin) { f.routeMargin = margin; }));
    t.push_back(frameValue(
        {.key = "undersample",
         .option = "--undersample",
         .group = Group::kMaps,
         .kind = "U",
         .help = "Divisor of the required resolution",
         .readBy = ReadBy::kMaps,
         .isList = true,
         .isSetByVariant = true,
         .label = " u#",
         .parameter = "undersample",
         .choices = {"1", "2", "4", "8"},
         .panelLabel = "undersample"},
        &Experiment::undersample, numberCodec<float>(1, 1024),
        [](const Frame& f) { return f.undersample; },
        [](Frame& f, float divisor) { f.undersample = divisor; }));
    t.push_back(frameValue(
        {.key = "maps_per_light",
         .option = "--maps-per-light",
         .group = Group::kMaps,
         .kind = "N",
         .help = "Maximum number of maps per light, by its clusters' requests, 1 to " +
                 std::to_string(kMaxMapsPerLight),
         .readBy = ReadBy::kMaps,
         .isList = true,
         .isSetByVariant = true,
         .label = " #SM",
         .parameter = "maps_per_light",
         .choices = {"1", "2", "4", "8", "16"},
         .panelLabel = "maps a light"},
        &Experiment::mapsPerLight, wholeCodec<uint32_t>(1, kMaxMapsPerLight),
        [](const Frame& f) { return f.mapsPerLight; },
        [](Frame& f, uint32_t count) { f.mapsPerLight = count; }));
    t.push_back(frameValue(
        {.key = "page_size",
         .option = "--page-size",
         .group = Group::kMaps,
         .kind = "TEXELS",
         .help = "Side of a page, a power of two from 16 to 256",
         .readBy = ReadBy::kMaps,
         .isList = true,
         .label = " pages #",
         .parameter = "page_size",
         .choices = {"16", "32", "64", "128", "256"},
         .panelLabel = "page texels"},
        &Experiment::pageTexels, powerCodec(16, 256, false),
        [](const Frame& f) { return f.maps.pageTexels; },
        [](Frame& f, uint32_t side) { f.maps.pageTexels = side; }));
    t.push_back(frameValue(
        {.key = "pool_mib",
         .option = "--pool",
         .group = Group::kMaps,
         .kind = "BYTES",
         .help = "Budget of the page pool, whole MiB, as in 256M",
         .readBy = ReadBy::kMaps,
         .label = " pool #",
         .parameter = "pool_bytes",
         .choices = {"16M", "64M", "256M", "1024M"},
         .panelLabel = "pool"},
        &Experiment::poolMib, mebibytesCodec(1, 1 << 20),
        [](const Frame& f) { return uint32_t(f.maps.poolBytes >> 20); },
        [](Frame& f, uint32_t mib) { f.maps.poolBytes = uint64_t(mib) << 20; }));
    t.back().frameJson = [](const Frame& f) { return Json(f.maps.poolBytes); };
    t.push_back(frameValue(
        {.key = "max_face_texels",
         .option = "--max-face",
         .group = Group::kMaps,
         .kind = "TEXELS",
         .help = "Maximum number of texels across a face of a map, 16 to " +
                 std::to_string(kMaxFaceTexels),
         .readBy = ReadBy::kMaps,
         .label = " max face #",
         .parameter = "max_face_texels"},
        &Experiment::maxFaceTexels, wholeCodec<uint32_t>(16, kMaxFaceTexels),
        [](const Frame& f) { return f.maxFaceTexels; },
        [](Frame& f, uint32_t texels) { f.maxFaceTexels = texels; }));
    t.push_back(frameValue(
        {.key = "bias",
         .option = "--bias",
         .group = Group::kMaps,
         .kind = "B",
         .help = "Depth bias in texels",
         .readBy = ReadBy::kMaps,
         .isList = true,
         .label = " bias #",
         .parameter = "bias"},
        &Experiment::bias, numberCodec<float>(0, 100),
        [](const Frame& f) { return f.bias.constantTexels; },
        [](Frame& f, float texels) { f.bias.constantTexels = texels; }));
    t.push_back(frameValue(
        {.key = "taps",
         .option = "--taps",
         .group = Group::kMaps,
         .kind = "1|4|9",
         .help = "Taps of the percentage-closer filter",
         .readBy = ReadBy::kMaps,
         .isList = true,
         .isSettableByVariants = true,
         .label = " taps #",
         .parameter = "taps",
         .choices = {"1", "4", "9"},
         .panelLabel = "taps"},
        &Experiment::taps, tapsCodec(), [](const Frame& f) { return f.bias.taps; },
        [](Frame& f, uint32_t taps) { f.bias.taps = f.maps.taps = taps; }));
    t.push_back(frameValue(
        {.key = "polygon_lod",
         .option = "--polygon-lod",
         .group = Group::kMaps,
         .kind = "T",
         .help = "Draw simplified triangles whose error is below T texels, 0 for full detail; "
                 "receivers are lifted by as much",
         .readBy = ReadBy::kMaps,
         .isList = true,
         .label = " polygon lod #",
         .parameter = "polygon_lod"},
        &Experiment::polygonLod, numberCodec<float>(0, 1024),
        [](const Frame& f) { return f.maps.lodTexels; },
        [](Frame& f, float texels) { f.maps.lodTexels = texels; }));
    t.push_back(frameValue(
        {.key = "believe",
         .option = "--believe",
         .group = Group::kRays,
         .kind = "all|none|PIXELS",
         .help = "Which voxels block a ray without a test of the triangles: all; none, so rays are "
                 "exact; or those whose shadow is displaced by at most PIXELS pixels",
         .shownDefault = "none; all with --backend gl and for variants",
         .readBy = ReadBy::kRays,
         .form = JsonForm::kNumberOrText,
         .isList = true,
         .label = " believe #",
         .isAlwaysInLabel = true,
         .parameter = "believe",
         .choices = {"none", "2", "all"},
         .panelLabel = "believe",
         .onGl = "all"},
        &Experiment::believe, believeCodec(), [](const Frame& f) { return f.rays.believe; },
        [](Frame& f, float pixels) { f.rays.believe = pixels; }));
    t.push_back(frameValue(
        {.key = "beams_mib",
         .option = "--beams",
         .group = Group::kRays,
         .kind = "BYTES",
         .help = "Memory for beams, whole MiB, as in 256M; 0 for none: exact rays on the CPU keep "
                 "which triangles may block a light from a cell of surface, while the view stands "
                 "still",
         .readBy = ReadBy::kExactRays,
         .isList = true,
         .label = " beams #",
         .parameter = "beam_bytes",
         .choices = {"0", "64M", "256M"},
         .panelLabel = "beams"},
        &Experiment::beamsMib, mebibytesCodec(0, 1 << 14),
        [](const Frame& f) { return uint32_t(f.rays.beamBytes >> 20); },
        [](Frame& f, uint32_t mib) { f.rays.beamBytes = uint64_t(mib) << 20; }));
    t.back().frameJson = [](const Frame& f) { return Json(f.rays.beamBytes); };
    t.push_back(frameValue(
        {.key = "offset",
         .option = "--offset",
         .group = Group::kRays,
         .kind = "O",
         .help = "Distance of a ray's ends from the surface, in units of the derived offset",
         .readBy = ReadBy::kVoxels,
         .isList = true,
         .label = " offset #",
         .parameter = "offset"},
        &Experiment::offset, numberCodec<float>(0, 100),
        [](const Frame& f) { return f.rays.offset; },
        [](Frame& f, float offset) { f.rays.offset = offset; }));
    t.push_back(frameValue(
        {.key = "lod",
         .option = "--lod",
         .group = Group::kRays,
         .kind = "L",
         .help = "Level of detail of rays: L for cells of 2^L voxels; "
                 "footprint[:SCALE] for cells as wide as the pixel's ray; "
                 "coverage[:SHARE[:SCALE]] for those of them that are covered to at least SHARE; "
                 "with --believe all",
         .readBy = ReadBy::kVoxels,
         .form = JsonForm::kNumberOrText,
         .isList = true,
         .label = " lod #",
         .parameter = "lod"},
        &Experiment::lod, lodCodec(), [](const Frame& f) { return LodChoice(f.rays); },
        [](Frame& f, const LodChoice& lod) { lod.apply(f.rays); }));
    t.push_back(oneValue({.key = "repeats",
                          .option = "--repeats",
                          .group = Group::kSweep,
                          .kind = "N",
                          .help = "Timed runs of every configuration, interleaved"},
                         &Experiment::repeats, wholeCodec<int>(1, 1000)));
    t.push_back(oneValue({.key = "warmups",
                          .option = "--warmups",
                          .group = Group::kSweep,
                          .kind = "N",
                          .help = "Warm-up runs before them, not counted"},
                         &Experiment::warmups, wholeCodec<int>(0, 1000)));
    t.push_back(oneValue({.key = "error_seed"}, &Experiment::errorSeed,
                         wholeCodec<uint64_t>(0, 9'000'000'000'000'000)));
    return t;
}

} // namespace

const std::vector<Setting>& settings() {
    static const std::vector<Setting> kTable = makeSettings();
    return kTable;
}

const Setting& settingOf(const std::string& option) {
    for (const Setting& setting : settings())
        if (setting.option == option)
            return setting;
    throw std::logic_error("no setting has the option " + option);
}

const std::vector<const Setting*>& frameSettings() {
    static const std::vector<const Setting*> kOfFrames = [] {
        std::vector<const Setting*> list;
        for (const Setting& setting : settings())
            if (setting.isOfFrame())
                list.push_back(&setting);
        return list;
    }();
    return kOfFrames;
}

std::string Setting::defaultText() const {
    std::string joined;
    for (const std::string& text : texts(Experiment()))
        joined += (joined.empty() ? "" : ",") + text;
    return joined;
}

bool reads(const RunParameters& run, ReadBy readBy) {
    switch (readBy) {
    case ReadBy::kAll:
        return true;
    case ReadBy::kRays:
        return run.usesRays();
    case ReadBy::kVoxels:
        return run.usesVoxels();
    case ReadBy::kExactRays:
        return run.usesRays() && run.frame.rays.believesNone();
    case ReadBy::kVoxelsAlone:
        return run.usesVoxels() && !run.usesMaps();
    case ReadBy::kMaps:
        return run.usesMaps();
    case ReadBy::kKept:
        return run.usesMaps() || (run.usesRays() && run.frame.rays.keepsBeams());
    case ReadBy::kHybrid:
        return run.isRouted();
    }
    return false;
}

} // namespace shadowdag
