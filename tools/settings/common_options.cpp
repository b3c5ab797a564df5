// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/common_options.h"

#include "cuda/error.h"
#include "hybrid/routing/resolution.h"
#include "shadowmap/gl_pages.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <tuple>

namespace shadowdag {

void GlobalOptions::declare(CommandLine& commandLine) {
    commandLine.heading("Everywhere");
    commandLine.flag(
        "--json", json,
        "Write exactly one JSON object to standard output, all else to standard error");
    commandLine.text("--threads", threads, "N",
                     "Processor threads, 0 for all; never changes a result [0]");
    commandLine.text("--backend", backend, "auto|cpu|cuda|gl",
                     "Where frames are made; auto says what it chose, cuda without a device and gl "
                     "without OpenGL 4.5 are errors; with gl, what draws no frames runs on the "
                     "processor [auto]");
    commandLine.text("--gl-pages", glPages, "auto|sparse|atlas",
                     "Where --backend gl keeps pages of maps: sparse textures, whose pages the "
                     "driver commits, or one atlas; auto takes sparse where it is [auto]");
}

Backend GlobalOptions::apply(const Console& console, bool announce, bool drawsFrames) const {
    if (glPages != "auto" && glPages != "sparse" && glPages != "atlas")
        throw Error(ErrorKind::kUsage, "--gl-pages '" + glPages + "': use auto, sparse or atlas");
    if (glPages != "auto" && backend != "gl")
        throw Error(ErrorKind::kUsage, "--gl-pages is for --backend gl; drop it");
    if (glPages != "auto" && !drawsFrames)
        throw Error(
            ErrorKind::kUsage,
            "--gl-pages says where frames keep pages, and nothing draws frames here; drop it");
    const Backend chosen = drawsFrames || backend != "gl" ? chooseBackend(backend) : Backend::kCpu;
    if (chosen == Backend::kGl) {
        setGlPages(glPages == "sparse"  ? GlPages::kSparse
                   : glPages == "atlas" ? GlPages::kAtlas
                                        : GlPages::kAuto);
        console.note("backend gl: " + describeGlPages(askedGlPages(), glDeviceInfo()));
    }
    setThreadCount(int(parseInteger("--threads", threads, 0, 4096)));
    if (announce && backend == "auto")
        console.note(std::string("backend auto: ") + backendName(chosen) + ", " +
                     std::to_string(threadCount()) + (threadCount() == 1 ? " thread" : " threads"));
    return chosen;
}

void followGlPages(Experiment& experiment, Backend backend, const CommandLine& commandLine) {
    const uint32_t side = backend == Backend::kGl ? askedGlPageTexels() : 0;
    if (side == 0)
        return;
    const std::vector<uint32_t> own{side};
    if (commandLine.declares("--page-size") && commandLine.given("--page-size") &&
        experiment.pageTexels != own)
        throw Error(ErrorKind::kUsage, "--page-size: sparse textures have pages of " +
                                           std::to_string(own[0]) +
                                           " texels a side here; drop it, or use --gl-pages atlas");
    experiment.pageTexels = own;
}

void CommonOptions::declareView(CommandLine& commandLine, bool isSweep) {
    commandLine.heading("View");
    commandLine.text("--size", size, "WxH",
                     isWindow ? "Size of the window in pixels; the picture has what the panel "
                                "leaves [" +
                                    size + "]"
                              : "Picture size in pixels [" + size + "]");
    commandLine.text("--camera", camera, "auto|NAME|NUMBERS",
                     "auto places one; NAME is a camera of the scene; NUMBERS are "
                     "px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]]: position, target, "
                     "vertical angle, planes in metres, by how much its up leans to its right [the "
                     "scene's first, else auto]");
    if (!isSweep)
        commandLine.text("--time", time, "SECONDS", "Time of the scene's animations [0]");
    const std::string from = " [" + (frames.empty() ? "0" : frames) + "]";
    commandLine.text("--frames", frames, isWindow ? "F" : "A:B",
                     (isWindow ? "Frame that the window starts at"
                               : "Frames A to B, both included, or A:B:STEP") +
                         from);
    commandLine.text("--fps", fps, "RATE", "Frame f shows the scene at f / RATE seconds [30]");
}

void CommonOptions::declareExposure(CommandLine& commandLine) {
    commandLine.text("--exposure", exposure, "E",
                     "What pictures multiply radiance by before they are tone mapped; 0: what puts "
                     "the log-average luminance at 0.18 [0]");
}

void CommonOptions::declareLights(CommandLine& commandLine) {
    commandLine.heading("Lights");
    commandLine.text("--lights", lights, "N",
                     "Replace the scene's lights by N placed ones [-1: keep the scene's]");
    commandLine.text("--seed", seed, "S", "Where they are placed [1]");
}

void CommonOptions::declareVoxels(CommandLine& commandLine, bool isSweep) {
    commandLine.heading("Voxels");
    commandLine.texts("--voxels", voxels, "F.svdag",
                      isSweep ? "A built asset instead of --resolution; may be given several times"
                              : "A built asset instead of --resolution");
    commandLine.text(
        "--resolution", resolution, isSweep ? "N,..." : "N",
        "Voxels an axis, a power of two up to 131072; built when needed and cached [1024]");
    if (isSweep)
        commandLine.text("--dag-resolution", dagResolution, "N,...",
                         "More resolutions, for method dag alone: how its error falls");
    commandLine.text(
        "--cache", cache, "DIR",
        "Where built assets are kept [$XDG_CACHE_HOME/shadowdag or ~/.cache/shadowdag]");
    commandLine.flag("--allow-stale", allowStale,
                     "Accept an asset that was built from another scene");
}

void CommonOptions::declareMaps(CommandLine& commandLine, bool isSweep) {
    const std::string list = isSweep ? ",..." : "";
    commandLine.heading("Maps");
    commandLine.text("--undersample", undersample, "U" + list,
                     "Divisor of the required resolution [" + undersample + "]");
    commandLine.text("--maps-per-light", mapsPerLight, "N" + list,
                     "The most maps a light may have, by what its clusters ask for, 1 to " +
                         std::to_string(kMaxMapsPerLight) + " [" + mapsPerLight + "]");
    commandLine.text("--page-size", pageSize, "TEXELS" + list,
                     "Side of a page, a power of two from 16 to 256 [" + pageSize + "]");
    commandLine.text("--pool", pool, "BYTES",
                     "Budget of the page pool, whole MiB, as in 256M [256M]");
    commandLine.text("--max-face", maxFace, "TEXELS",
                     "The most texels across a face of a map, 16 to " +
                         std::to_string(kMaxFaceTexels) + " [" + maxFace + "]");
    commandLine.text("--bias", bias, "B" + list, "Depth bias in texels [" + bias + "]");
    commandLine.text("--taps", taps, "1|4|9" + list,
                     "Taps of the percentage-closer filter [" + taps + "]");
    commandLine.text("--polygon-lod", polygonLod, "T" + list,
                     "Draw what is simplified by less than so many texels, 0 for full detail; "
                     "receivers are lifted by as much [" +
                         polygonLod + "]");
}

void CommonOptions::declareRays(CommandLine& commandLine, bool isSweep) {
    const std::string list = isSweep ? ",..." : "";
    commandLine.heading("Rays");
    commandLine.text("--offset", offset, "O" + list,
                     "How far a ray's ends leave the surface, in units of the derived offset [" +
                         offset + "]");
    commandLine.text("--lod", lod, "L" + list,
                     "Level of detail of rays: L for cells of 2^L voxels; footprint[:SCALE] for "
                     "cells as wide as the pixel's ray; coverage[:SHARE[:SCALE]] for those of them "
                     "of which that share is covered [" +
                         lod + "]");
}

void CommonOptions::declareRoutes(CommandLine& commandLine) {
    commandLine.heading("Routes");
    commandLine.text("--route-margin", routeMargin, "M",
                     "For hybrid, over frames in sequence: a map changes its method only when the "
                     "other is cheaper by more than the factor 1 + M, 0 to " +
                         numberText(kMaxRouteMargin) + " [" + routeMargin + "]");
}

Experiment CommonOptions::experiment(const CommandLine& commandLine, bool isSweep) const {
    // Commands declare what they can do: of several of these, none.
    const auto given = [&](const char* option) {
        return commandLine.declares(option) && commandLine.given(option);
    };
    const auto contradict = [&](const char* a, const char* b, const char* remedy) {
        if (given(a) && given(b))
            throw Error(ErrorKind::kUsage,
                        std::string(a) + " and " + b + " contradict each other: " + remedy);
    };
    contradict("--voxels", "--resolution", "an asset has its resolution; drop one of them");
    contradict("--voxels", "--cache", "an asset is read from where it is; drop one of them");
    if (!isSweep)
        contradict("--time", "--frames", "a frame has its time; drop one of them");
    const auto needs = [&](const char* a, const char* b) {
        if (given(a) && !given(b))
            throw Error(ErrorKind::kUsage,
                        std::string(a) + " says nothing without " + b + "; add that or drop it");
    };
    if (!isWindow)
        needs("--fps", "--frames");
    needs("--seed", "--lights");
    needs("--allow-stale", "--voxels");
    if (!isSweep && voxels.size() > 1)
        throw Error(ErrorKind::kUsage,
                    "--voxels '" + voxels[1] +
                        "': this command takes one asset; compare takes several");

    // A command that is no sweep takes one value where compare takes a list.
    const auto list = [&](const char* option, const std::string& text) {
        const std::vector<std::string> parts = parseList(option, text);
        if (!isSweep && parts.size() > 1)
            throw Error(ErrorKind::kUsage,
                        std::string(option) + " '" + text +
                            "': this command takes one value; compare takes a list");
        return parts;
    };
    const auto numbers = [&](const char* option, const std::string& text, double min, double max) {
        std::vector<float> values;
        for (const std::string& part : list(option, text)) {
            const float value = float(parseNumber(option, part, min, max));
            if (std::find(values.begin(), values.end(), value) != values.end())
                throw Error(ErrorKind::kUsage, std::string(option) + " '" + text +
                                                   "': " + numberText(value) +
                                                   " stands there twice; name each value once");
            values.push_back(value);
        }
        return values;
    };

    Experiment e;
    std::tie(e.width, e.height) = parseSize("--size", size);
    if (given("--camera") && camera.empty())
        throw Error(ErrorKind::kUsage,
                    "--camera '': is empty; give auto, a camera's name or px,py,pz,tx,ty,tz");
    if (camera.find(',') != std::string::npos)
        (void)cameraFromText(camera); // told before anything is opened
    e.camera = camera;
    e.exposure = parseNumber("--exposure", exposure, 0, kMaxExposure);
    if (!frames.empty()) {
        e.framesText = frames;
        e.frames = parseFrames("--frames", frames);
    }
    if (!time.empty())
        parseNumber("--time", time, -1e6, 1e6);
    e.fps = parseNumber("--fps", fps, 0.001, 1e6);
    e.lightCount = int(parseInteger("--lights", lights, -1, 100000));
    e.lightSeed = uint64_t(parseInteger("--seed", seed, 0, 9'000'000'000'000'000));
    e.resolutionLog2.clear();
    for (const std::string& part : list("--resolution", resolution))
        e.resolutionLog2.push_back(parsePowerOfTwo("--resolution", part, 4, 131072));
    if (!dagResolution.empty())
        for (const std::string& part : list("--dag-resolution", dagResolution))
            e.dagResolutionLog2.push_back(parsePowerOfTwo("--dag-resolution", part, 4, 131072));
    e.thresholds = parseThresholds("--thresholds", thresholds);
    e.undersample = numbers("--undersample", undersample, 1, 1024);
    e.mapsPerLight.clear();
    for (const std::string& part : list("--maps-per-light", mapsPerLight))
        e.mapsPerLight.push_back(
            uint32_t(parseInteger("--maps-per-light", part, 1, kMaxMapsPerLight)));
    e.pageTexels.clear();
    for (const std::string& part : list("--page-size", pageSize))
        e.pageTexels.push_back(1u << parsePowerOfTwo("--page-size", part, 16, 256));
    const uint64_t poolBytes = parseBytes("--pool", pool);
    if (poolBytes < (1u << 20) || poolBytes % (1u << 20) != 0 || poolBytes >> 20 > (1u << 20))
        throw Error(ErrorKind::kUsage,
                    "--pool '" + pool + "': must be whole MiB from 1M to 1024G, as in 256M");
    e.poolMib = uint32_t(poolBytes >> 20);
    e.maxFaceTexels = uint32_t(parseInteger("--max-face", maxFace, 16, kMaxFaceTexels));
    e.bias = numbers("--bias", bias, 0, 100);
    e.taps.clear();
    for (const std::string& part : list("--taps", taps)) {
        e.taps.push_back(uint32_t(parseInteger("--taps", part, 1, 9)));
        if (e.taps.back() != 1 && e.taps.back() != 4 && e.taps.back() != 9)
            throw Error(ErrorKind::kUsage, "--taps '" + part + "': must be 1, 4 or 9");
    }
    e.routeMargin = float(parseNumber("--route-margin", routeMargin, 0, kMaxRouteMargin));
    e.polygonLod = numbers("--polygon-lod", polygonLod, 0, 1024);
    e.offset = numbers("--offset", offset, 0, 100);
    e.lod.clear();
    for (const std::string& part : list("--lod", lod))
        addLod(e.lod, "--lod", part);
    if (!models.empty())
        e.models = models;
    for (const std::string& model : models)
        makeCostModel(model); // throws for an unknown one, before any work
    return e;
}

float CommonOptions::timeSeconds(const Experiment& experiment) const {
    if (!time.empty())
        return float(parseNumber("--time", time, -1e6, 1e6));
    return experiment.timeOfFrame(experiment.frames.front());
}

} // namespace shadowdag
