// SPDX-License-Identifier: Apache-2.0
// `shadowdag render`: frames of one method as pictures with AOVs.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/variants.h"
#include "tools/workspace/frame_channels.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/frame_laps.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/single_frame.h"
#include "tools/workspace/timing.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct RenderOptions {
    GlobalOptions global;
    CommonOptions common;
    MethodOptions method{"hybrid"};
    std::string scene, output, laps = "0";
    bool perLight = false, truth = false, floatColor = false;
};

/// Returns the name of a frame's file: "a.exr", numbered "a.0007.exr" when there are several
/// frames, and "a.auto-2.exr" when there are several views.
std::string frameFile(const std::string& output, const std::string& view, uint32_t frame,
                      bool isNumbered) {
    std::filesystem::path path(output);
    char number[16] = "";
    if (isNumbered)
        std::snprintf(number, sizeof number, ".%04u", frame);
    const std::string name = path.stem().string() + (view.empty() ? "" : "." + view) + number +
                             path.extension().string();
    return (path.parent_path() / name).string();
}

/// Returns how many lights have maps, by the methods that serve them. @param lights lightsJson
std::string lightsText(const Json& lights) {
    std::string text = std::to_string(lights.size()) + (lights.size() == 1 ? " light" : " lights");
    const std::pair<const char*, const char*> routes[] = {
        {"rays", "by rays"}, {"map", "by maps"}, {"both", "by both"}};
    std::string by;
    for (const auto& [route, name] : routes) {
        const auto count = std::count_if(lights.begin(), lights.end(), [&](const Json& light) {
            return light["route"] == route;
        });
        if (count > 0)
            by += (by.empty() ? " (" : ", ") + std::to_string(count) + " " + name;
    }
    return by.empty() ? text : text + by + ")";
}

/// Adds one channel per light: the visibility of every pixel's pair with it, 1 where there is no
/// pair.
void addLightChannels(std::vector<ExrChannel>& channels, const PairList& pairs,
                      const std::vector<uint8_t>& visibility, size_t pixelCount,
                      size_t lightCount) {
    std::vector<ExrChannel> perLight(lightCount);
    for (size_t light = 0; light < lightCount; ++light) {
        char name[48];
        std::snprintf(name, sizeof name, "visibility.light%04zu", light);
        perLight[light] = {name, ExrChannel::Type::kHalf, std::vector<float>(pixelCount, 1.0f)};
    }
    for (size_t sample = 0; sample < pixelCount; ++sample)
        for (uint64_t pair = pairs.sampleStart[sample]; pair < pairs.sampleStart[sample + 1];
             ++pair)
            perLight[pairs.light[pair]].values[sample] = float(visibility[pair]) / 255.0f;
    for (ExrChannel& channel : perLight)
        channels.push_back(std::move(channel));
}

/// Returns the channels of a frame: colour, visibility, share of rays, and errors if the truth is
/// given.
std::vector<ExrChannel> channelsOf(const RenderOptions& options, const SingleFrames& frames,
                                   const PairResults& answers, const std::vector<glm::vec3>& color,
                                   const std::vector<uint8_t>& visibility,
                                   const std::vector<uint8_t>& truthVisibility) {
    const std::vector<Route> none;
    const FrameResult& result = answers.frame;
    std::vector<ExrChannel> channels = frameChannels(
        {"", color, options.floatColor ? ExrChannel::Type::kFloat : ExrChannel::Type::kHalf,
         answers.gbuffer, result.pairs, visibility,
         methodOf(options.method.method).isTruth() ? none : result.pairRoute, truthVisibility});
    if (options.perLight)
        addLightChannels(channels, result.pairs, visibility, color.size(),
                         frames.world().lights().size());
    return channels;
}

/// Returns the document of `render --laps`, and prints its table.
Json timesOnly(SingleFrames& frames, const Experiment& experiment, int laps,
               const Console& console) {
    const CpuUse use;
    Json rows = timeLaps(frames, experiment, laps, console.progress("time " + frames.sceneName()));
    const Json summary = summarizeLap(rows);
    char line[120];
    for (const auto& [stage, timeMs] : summary["stages_ms"].items()) {
        std::snprintf(line, sizeof line, "  %-24s %10.3f ms\n", stage.c_str(),
                      timeMs.get<double>());
        console.people() << line;
    }
    std::snprintf(line, sizeof line,
                  "%zu frames, lap %d: %.3f ms a frame by the wall clock (median; the slowest "
                  "%.3f), stages %.3f ms\n",
                  rows.size(), laps, summary["wall_ms"].get<double>(),
                  summary["wall_ms_max"].get<double>(), summary["time_ms"].get<double>());
    console.people() << line;
    Json document = frames.reproduction();
    for (const char* key : {"frame", "time_s", "camera_numbers"}) // of each frame
        document.erase(key);
    document["laps"] = laps;
    document.update(summary);
    document["frames"] = std::move(rows);
    document["other_cpu_share"] = otherShareJson(use.otherShare());
    if (const std::string busy = busyRemark(use.otherShare()); !busy.empty())
        console.note("warning: " + busy);
    return document;
}

void runRender(const RenderOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    Experiment experiment = options.common.experiment(commandLine, false);
    takeGlDefaults(experiment, options.global.backend, commandLine);
    options.method.check(commandLine, experiment, methodNames(), console);
    if (commandLine.given("--route-margin")) {
        if (!methodOf(options.method.method).needs().routing)
            throw Error(ErrorKind::kUsage, "--route-margin is for hybrid, not for '" +
                                               options.method.method + "'; drop it");
        if (!options.method.variant.empty() &&
            parseVariant("--variant", options.method.variant).routeMargin)
            throw Error(ErrorKind::kUsage, "--route-margin and --variant '" +
                                               options.method.variant +
                                               "' contradict each other: the name sets it; drop "
                                               "one of them");
        if (experiment.frames.size() < 2)
            throw Error(ErrorKind::kUsage,
                        "--route-margin is for sequences of frames; name several with "
                        "--frames, or drop it");
    }
    if (commandLine.given("--laps")) {
        const int laps = int(parseInteger("--laps", options.laps, 1, 1000));
        for (const char* option : {"--output", "--per-light", "--float", "--exposure", "--truth",
                                   "--views", "--start", "--time"})
            if (commandLine.declares(option) && commandLine.given(option))
                throw Error(ErrorKind::kUsage,
                            std::string(option) +
                                " and --laps contradict each other: frames follow --frames "
                                "as one sequence, and no picture is written; drop one of them");
        const Backend backend = options.global.apply(console, true);
        followGlPages(experiment, backend, commandLine);
        refuseOnGl(experiment, backend, options.method.variant);
        SingleFrames frames(options.scene, options.common, experiment, options.method, backend,
                            console);
        return console.emit(timesOnly(frames, experiment, laps, console));
    }
    if (options.output.empty())
        throw Error(ErrorKind::kUsage, "-o is missing: name the picture, or give --laps for times");
    checkExtension(options.output, {".exr", ".png"},
                   "pictures are .exr or .png; use one of these extensions");
    const std::string extension = std::filesystem::path(options.output).extension().string();
    for (const char* option : {"--per-light", "--float"})
        if (extension == ".png" && commandLine.given(option))
            throw Error(ErrorKind::kUsage,
                        std::string(option) +
                            " needs channels that a .png does not have; write an .exr");
    if (extension != ".png" && commandLine.given("--exposure"))
        throw Error(ErrorKind::kUsage, "--exposure is for a .png; an .exr contains the unexposed "
                                       "radiance; drop it");
    if (extension == ".png" && options.truth)
        throw Error(
            ErrorKind::kUsage,
            "--truth adds channels that a .png does not have; write an .exr, or see validate -o");
    if (options.truth && methodOf(options.method.method).isTruth())
        throw Error(ErrorKind::kUsage,
                    "--truth is for methods that can be wrong, not for 'truth'; drop it");
    const bool isNumbered = commandLine.given("--frames");
    const size_t frameCount = experiment.frames.size(), viewCount = experiment.viewCount;
    const auto viewOf = [&](size_t i) {
        return viewCount > 1 ? experiment.viewCamera(uint32_t(i / frameCount)) : "";
    };
    const auto fileOf = [&](size_t i) {
        return frameFile(options.output, viewOf(i), experiment.frames[i % frameCount], isNumbered);
    };
    std::vector<std::string> inputs = options.common.voxels;
    inputs.insert(inputs.end(), {options.scene, options.method.costs});
    for (size_t i = 0; i < frameCount * viewCount; ++i) {
        refuseSameFile(fileOf(i), inputs);
        checkWritable(fileOf(i));
    }
    const Backend backend = options.global.apply(console, true);
    followGlPages(experiment, backend, commandLine);
    refuseOnGl(experiment, backend, options.method.variant);

    const bool isTruth = methodOf(options.method.method).isTruth();
    SingleFrames frames(options.scene, options.common, experiment, options.method, backend,
                        console);
    const size_t lightCount = frames.world().lights().size();
    if (options.perLight && lightCount > 1000)
        throw Error(ErrorKind::kUsage,
                    "--per-light with " + std::to_string(lightCount) +
                        " lights: 1000 channels at most; place fewer with --lights");
    const Progress progress = console.progress("render " + frames.sceneName());
    const CpuUse use;
    Json list = Json::array(), reproduction;
    for (size_t i = 0; i < frameCount * viewCount; ++i) {
        progress(double(i) / double(frameCount * viewCount));
        const std::string view = viewOf(i);
        if (!view.empty() && i % frameCount == 0)
            frames.setView(view);
        const uint32_t frame = experiment.frames[i % frameCount];
        const float time =
            isNumbered ? experiment.timeOfFrame(frame) : options.common.timeSeconds(experiment);
        const PairResults& answers = frames.render(time, frame);
        const FrameResult& result = answers.frame;
        const std::vector<uint8_t> none,
            &truthVisibility = options.truth || isTruth ? frames.truthVisibility() : none;
        const std::vector<uint8_t>& visibility = isTruth ? truthVisibility : result.visibility;
        const std::vector<glm::vec3> color =
            isTruth ? shadePairs(answers.gbuffer, frames.world(), result.pairs, visibility)
                    : result.color;

        const std::string file = fileOf(i);
        if (extension == ".png")
            writePng(file, experiment.width, experiment.height,
                     toneMap(color, experiment.exposureOf(color)));
        else
            writeExr(file, experiment.width, experiment.height,
                     channelsOf(options, frames, answers, color, visibility, truthVisibility),
                     exrAttributes(frames.reproduction()));
        const double timeMs = result.stages.totalMs();
        reproduction = frames.reproduction();
        Json entry = {{"frame", frame},
                      {"time_s", time},
                      {"camera_numbers", reproduction["camera_numbers"]},
                      {"output", file}};
        if (!view.empty())
            entry["camera"] = view;
        if (!isTruth) { // the truth's picture has pairs, but no frame
            entry["time_ms"] = timeMs;
            entry["wall_ms"] = result.wallMs;
            entry["stages_ms"] = toJson(result.stages);
            entry.update(toJson(result.counts));
            // Like times they depend on earlier frames, so reports do not contain them.
            const HostCopyCounts& copies = result.counts.hostCopies;
            entry["host_copy_count"] = copies.uploadCount + copies.readbackCount;
            entry["host_readback_count"] = copies.readbackCount;
        }
        entry["pair_count"] = result.pairs.count();
        const std::string fewPairs = darkPictureWarning(
            file, result.pairs.count(), {experiment.lightCount >= 0, frames.isCameraAutomatic()});
        if (!fewPairs.empty())
            entry["warning"] = fewPairs;
        list.push_back(std::move(entry));
        console.people() << file << ": " << result.pairs.count() << " pairs, "
                         << (isTruth ? std::to_string(lightCount) + " lights"
                                     : lightsText(lightsJson(result.maps)));
        if (!isTruth)
            console.people() << ", " << timeMs << " ms";
        console.people() << "\n";
        if (const std::string note = poolNote(result.counts); !isTruth && !note.empty())
            console.people() << "  " << note << "; enlarge it with --pool\n";
        if (!fewPairs.empty())
            console.note("warning: " + fewPairs);
    }
    progress(1.0);
    reproduction["other_cpu_share"] = otherShareJson(use.otherShare());
    if (const std::string busy = busyRemark(use.otherShare()); !busy.empty() && !isTruth)
        console.note("warning: " + busy);
    reproduction["scene"] = sceneNames({options.scene}).front();
    for (const char* key : {"frame", "time_s", "camera_numbers"}) // of each frame
        reproduction.erase(key);
    reproduction["frames"] = std::move(list);
    console.emit(reproduction);
}

} // namespace

std::function<void()> declareRender(CommandLine& commandLine) {
    auto options = std::make_shared<RenderOptions>();
    commandLine.text("SCENE", options->scene, "", kSceneHelp, true);
    commandLine.text("-o,--output", options->output, "F.exr|F.png",
                     "The picture; with --frames numbered F.0007.exr, with --views F.auto-2.exr. "
                     "EXR channels: R G B (linear "
                     "radiance), visibility.mean, "
                     "method.rayShare, depth.Z; PNG: the colour, exposed and tone mapped");
    commandLine.text("--laps", options->laps, "N",
                     "Instead of -o: renders the frames N times in a row as one sequence, in which "
                     "maps of what stands still are kept, and reports the times of the last lap; "
                     "records nothing");
    commandLine.flag("--per-light", options->perLight,
                     "Add one channel per light: visibility.light0000, ...");
    commandLine.flag("--truth", options->truth,
                     "Add channels of the error against Embree: error.*");
    commandLine.flag("--float", options->floatColor,
                     "Colour as 32-bit floats instead of halves, which are at most 65504");
    options->method.declare(commandLine, "truth|dag|maps|hybrid|embree");
    options->common.declare(commandLine,
                            {SettingGroup::kRoutes, SettingGroup::kView, SettingGroup::kViews,
                             SettingGroup::kPictures, SettingGroup::kLights, SettingGroup::kVoxels,
                             SettingGroup::kRays, SettingGroup::kMaps},
                            false);
    options->global.declare(commandLine);
    return [options, &commandLine] {
        options->method.takeVariant(commandLine);
        runRender(*options, commandLine);
    };
}

} // namespace shadowdag
