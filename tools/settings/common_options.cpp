// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/common_options.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/scene_folder.h"
#include "shadowmap/gl_pages.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/parse.h"
#include "voxel/asset.h"

#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

/// Two options of which one contradicts or needs the other.
struct OptionRule {
    const char* option;
    const char* other;
    const char*
        text; ///< of a contradiction the remedy, else the effect of `option` without the other
};

constexpr OptionRule kContradictions[] = {
    {"--voxels", "--resolution", "an asset has its resolution; drop one of them"},
    {"--voxels", "--cache", "an asset is read from where it is; drop one of them"},
    {"--time", "--frames", "a frame has its time; drop one of them"},
};
constexpr OptionRule kNeeds[] = {
    {"--fps", "--frames", "has no effect without "},
    {"--seed", "--lights", "has no effect without "},
    {"--allow-stale", "--voxels", "has no effect without "},
    {"--lead-in", "--sequence", "is for "},
    {"--flicker-points", "--sequence", "is for "},
};

const char* headingOf(SettingGroup group) {
    switch (group) {
    case SettingGroup::kSweep:
        return "Sweep";
    case SettingGroup::kRoutes:
        return "Routes";
    case SettingGroup::kView:
    case SettingGroup::kViews:
    case SettingGroup::kPictures:
        return "View";
    case SettingGroup::kLights:
        return "Lights";
    case SettingGroup::kVoxels:
        return "Voxels";
    case SettingGroup::kRays:
        return "Rays";
    case SettingGroup::kMaps:
        return "Maps";
    case SettingGroup::kNone:
        break;
    }
    return "Options";
}

} // namespace

void GlobalOptions::declare(CommandLine& commandLine) {
    commandLine.heading("Everywhere");
    commandLine.flag(
        "--json", json,
        "Write exactly one JSON object to standard output, other text to standard error");
    commandLine.text("--threads", threads, "N",
                     "CPU threads, 0 for all cores; does not change results [0]");
    commandLine.text("--backend", backend, "auto|cpu|cuda|gl",
                     "Backend that renders frames; auto reports its choice; cuda without a device "
                     "and gl without "
                     "OpenGL 4.5 are errors; with gl, all other work runs on the CPU [auto]");
    commandLine.text("--gl-pages", glPages, "auto|sparse|atlas",
                     "Memory of pages of maps with --backend gl: sparse textures, whose pages the "
                     "driver commits, or one atlas; auto uses sparse textures if available [auto]");
    commandLine.flag("--allow-outside", allowOutside,
                     "Let a scene name buffers and images outside of its own folder, also behind "
                     "symbolic links");
}

Backend GlobalOptions::apply(const Console& console, bool announce, bool drawsFrames) const {
    if (glPages != "auto" && glPages != "sparse" && glPages != "atlas")
        throw Error(ErrorKind::kUsage, "--gl-pages '" + glPages + "': use auto, sparse or atlas");
    if (glPages != "auto" && backend != "gl")
        throw Error(ErrorKind::kUsage, "--gl-pages is for --backend gl; drop it");
    if (glPages != "auto" && !drawsFrames)
        throw Error(ErrorKind::kUsage, "--gl-pages is for commands that draw frames; drop it");
    const Backend chosen = drawsFrames || backend != "gl" ? chooseBackend(backend) : Backend::kCpu;
    if (chosen == Backend::kGl) {
        setGlPages(glPages == "sparse"  ? GlPages::kSparse
                   : glPages == "atlas" ? GlPages::kAtlas
                                        : GlPages::kAuto);
        console.note("backend gl: " + describeGlPages(requestedGlPages(), glDeviceInfo()));
    }
    allowOutsideFiles(allowOutside);
    setThreadCount(0);
    const int coreCount = threadCount();
    setThreadCount(int(parseInteger("--threads", threads, 0, kMaxThreadCount)));
    if (threadCount() > coreCount)
        console.note("warning: --threads '" + threads + "': this machine has " +
                     std::to_string(coreCount) + (coreCount == 1 ? " core" : " cores") +
                     ", which the threads share, so times are larger and vary more; use at most " +
                     std::to_string(coreCount));
    if (announce && backend == "auto")
        console.note(std::string("backend auto: ") + backendName(chosen) + ", " +
                     std::to_string(threadCount()) + (threadCount() == 1 ? " thread" : " threads"));
    return chosen;
}

void followGlPages(Experiment& experiment, Backend backend, const CommandLine& commandLine) {
    const uint32_t side = backend == Backend::kGl ? requestedGlPageTexels() : 0;
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

CommonOptions::CommonOptions() {
    for (const Setting& setting : settings())
        if (!setting.option.empty())
            texts_[setting.option] = setting.defaultText();
}

std::string& CommonOptions::text(const std::string& option) {
    return texts_.at(settingOf(option).option);
}

const std::string& CommonOptions::text(const std::string& option) const {
    return texts_.at(settingOf(option).option);
}

void CommonOptions::declare(CommandLine& commandLine, const Setting& setting, bool isSweep) {
    if (setting.form == JsonForm::kFlag) {
        commandLine.flag(setting.option, isSequence_, setting.help);
        return;
    }
    std::string& text = texts_.at(setting.option);
    const std::string shown = text == setting.defaultText() && !setting.shownDefault.empty()
                                  ? setting.shownDefault
                                  : text;
    std::string kind = setting.kind, help = setting.help;
    if (isWindow && setting.option == "--size")
        help = "Size of the window in pixels, including the panel";
    if (isWindow && setting.option == "--frames") {
        kind = "A";
        help = "First frame of the window";
    }
    if (!shown.empty())
        help += " [" + shown + "]";
    if (setting.option == "--model")
        commandLine.texts(setting.option, models_, kind, help);
    else
        commandLine.text(setting.option, text, kind + (isSweep && setting.isVaried ? ",..." : ""),
                         help);
}

void CommonOptions::declare(CommandLine& commandLine, const std::vector<SettingGroup>& groups,
                            bool isSweep) {
    for (const SettingGroup group : groups) {
        commandLine.heading(headingOf(group));
        if (group == SettingGroup::kVoxels)
            commandLine.texts("--voxels", voxels, "F.svdag",
                              isSweep
                                  ? "A built asset instead of --resolution; may be given several "
                                    "times"
                                  : "A built asset instead of --resolution");
        for (const Setting& setting : settings())
            if (setting.group == group && !setting.option.empty())
                declare(commandLine, setting, isSweep);
        if (group == SettingGroup::kView && !isSweep)
            commandLine.text("--time", time, "SECONDS", "Time of the scene's animations [0]");
        if (group == SettingGroup::kVoxels) {
            declareCache(commandLine);
            commandLine.flag("--allow-stale", allowStale,
                             commandLine.declares("--costs")
                                 ? "Accept an asset that was built from another scene, and costs "
                                   "that were measured of another scene, size, camera or lights"
                                 : "Accept an asset that was built from another scene");
        }
    }
}

void CommonOptions::declareCache(CommandLine& commandLine) {
    commandLine.text("--cache", cache, "DIR",
                     "Directory of built assets [$XDG_CACHE_HOME/shadowdag or ~/.cache/shadowdag]");
}

Experiment CommonOptions::experiment(const CommandLine& commandLine, bool isSweep) const {
    // Commands declare which of them they have; several may be absent.
    const auto given = [&](const std::string& option) {
        return commandLine.declares(option) && commandLine.given(option);
    };
    for (const auto& [option, other, remedy] : kContradictions)
        if (given(option) && given(other))
            throw Error(ErrorKind::kUsage, std::string(option) + " and " + other +
                                               " contradict each other: " + remedy);
    for (const auto& [option, other, what] : kNeeds)
        if (const bool isOfCosts =
                option == std::string("--allow-stale") && commandLine.declares("--costs");
            given(option) && !given(other) && !(isWindow && option == std::string("--fps")) &&
            !(isOfCosts && given("--costs")))
            throw Error(ErrorKind::kUsage, std::string(option) + " " + what + other +
                                               (isOfCosts ? " or --costs" : "") +
                                               "; add that or drop it");
    if (!isSweep && voxels.size() > 1)
        throw Error(ErrorKind::kUsage,
                    "--voxels '" + voxels[1] +
                        "': this command takes one asset; compare takes several");
    const std::string& camera = text("--camera");
    if (given("--camera") && camera.empty())
        throw Error(ErrorKind::kUsage,
                    "--camera '': is empty; give auto, a camera's name or px,py,pz,tx,ty,tz");
    if (camera.find(',') != std::string::npos)
        (void)cameraFromText(camera); // reported before anything is opened
    if (!time.empty())
        parseNumber("--time", time, -1e6, 1e6);

    Experiment e;
    for (const Setting& setting : settings()) {
        if (setting.option.empty() || setting.form == JsonForm::kFlag ||
            setting.option == "--model")
            continue;
        const std::string& text = texts_.at(setting.option);
        std::vector<std::string> values;
        if (!setting.isVaried)
            values = {text};
        else if (!text.empty())
            values = parseList(setting.option, text);
        // A command without a sweep takes one value where compare takes a list.
        if (!isSweep && values.size() > 1 && commandLine.declares(setting.option))
            throw Error(ErrorKind::kUsage,
                        setting.option + " '" + text +
                            "': this command takes one value; compare takes a list");
        if (setting.option != "--variants") // listed with the options that they may omit
            setting.set(e, setting.option, values);
    }
    e.isSequence = isSequence_;
    if (!models_.empty())
        settingOf("--model").set(e, "--model", models_);
    refuseCameraOfViews(e, "--views", "--camera");
    checkVoxels();
    return e;
}

void CommonOptions::checkVoxels() const {
    for (const std::string& path : voxels)
        if (const std::string why = whyNoInput(path, ~uint64_t(0)); !why.empty())
            throw Error(ErrorKind::kInput,
                        "--voxels '" + path + "': " + why + "; give an asset of voxelize");
        else if (!beginsAsAsset(path)) // also where no voxels are used
            throw Error(ErrorKind::kInput,
                        "--voxels '" + path + "': is no voxel asset; give an asset of voxelize");
}

float CommonOptions::timeSeconds(const Experiment& experiment) const {
    if (!time.empty())
        return float(parseNumber("--time", time, -1e6, 1e6));
    return experiment.timeOfFrame(experiment.frames.front());
}

} // namespace shadowdag
