// SPDX-License-Identifier: Apache-2.0
// `shadowdag validate`: compares one method's shadows with Embree, pair by pair and light by light.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/single_frame.h"

#include <cstdio>
#include <deque>
#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct ValidateOptions {
    GlobalOptions global;
    CommonOptions common;
    MethodOptions method{"dag"};
    std::string scene, output;
};

void printHeader(std::ostream& out) {
    char line[160];
    std::snprintf(line, sizeof line, "%8s %10s %8s %14s %13s %9s %12s %9s %8s %8s\n", "light",
                  "pairs", "dark %", "false shadow %", "false light %", "magnified", "unexplained",
                  "acne", "contact", "error");
    out << line;
}

void printCounts(std::ostream& out, const std::string& name, const ErrorCounts& c) {
    const double pairs = c.pairCount > 0 ? double(c.pairCount) : 1.0;
    char line[200];
    std::snprintf(
        line, sizeof line, "%8s %10llu %8.2f %14.3f %13.3f %9llu %12llu %9llu %8llu %8.5f\n",
        name.c_str(), static_cast<unsigned long long>(c.pairCount),
        100.0 * double(c.occludedCount) / pairs, 100.0 * double(c.falseShadowCount) / pairs,
        100.0 * double(c.falseLightCount) / pairs,
        static_cast<unsigned long long>(c.magnifiedCount),
        static_cast<unsigned long long>(c.unexplainedFalseShadowCount +
                                        c.unexplainedFalseLightCount),
        static_cast<unsigned long long>(c.acneCount),
        static_cast<unsigned long long>(c.contactCount), c.meanAbsVisibilityError());
    out << line;
}

/// In the order in which they are written.
constexpr const char* kMapFiles[] = {"truth.png", "method.png", "error.png", "errors.exr"};

/// Throws Error kUsage if a directory has one of the files that a validate writes, without one that
/// it writes before, so that it is of something else; kResource if one cannot be replaced. A
/// foreign truth.png alone is not noticed, as an interrupted validate may leave just that.
void refuseForeignMaps(const std::string& directory) {
    std::string absent;
    for (const std::string name : kMapFiles) {
        const std::string path = directory + "/" + name;
        checkWritable(path);
        if (!std::filesystem::exists(path))
            absent = name;
        else if (!absent.empty())
            throw Error(ErrorKind::kUsage,
                        "-o '" + directory + "': contains " + name + " and not " + absent +
                            ", so no validate wrote it and this one would replace it; move it "
                            "elsewhere, or choose another directory");
    }
}

/// Writes kMapFiles into the directory.
void writeMaps(const std::string& directory, SingleFrames& frames, const FrameResult& result,
               const Experiment& experiment) {
    const uint32_t width = experiment.width, height = experiment.height;
    const FrameTruth& truth = frames.truthPicture(float(experiment.exposure));
    PixelErrors errors = countPixelErrors(result.pairs, result.visibility, truth.visibility);
    writePng(directory + "/truth.png", width, height, truth.display);
    writePng(directory + "/method.png", width, height, toneMap(result.color, truth.exposure));
    writePng(directory + "/error.png", width, height, errorPicture(truth.display, errors));
    writeExr(directory + "/errors.exr", width, height,
             {{"error.pairCount", ExrChannel::Type::kFloat, std::move(errors.pairCount)},
              {"error.falseShadowCount", ExrChannel::Type::kFloat, std::move(errors.falseShadow)},
              {"error.falseLightCount", ExrChannel::Type::kFloat, std::move(errors.falseLight)}},
             exrAttributes(frames.reproduction()));
}

/// Prints the errors of a view, by light and in total, and what qualifies them.
void printReport(std::ostream& out, const ErrorReport& report, const FrameCounts& counts) {
    printHeader(out);
    for (size_t light = 0; light < report.perLight.size(); ++light)
        if (report.perLight[light].pairCount > 0)
            printCounts(out, std::to_string(light), report.perLight[light]);
    printCounts(out, "all", report.total);
    out << "null rate " << report.nullRate << ": share of " << report.nullSampleCount
        << " draws of right results that the 32 rays which explain errors would flip";
    if (report.outlineNullSampleCount > 0)
        out << "; " << report.outlineNullRate << " of " << report.outlineNullSampleCount
            << " near outlines, which the explained share is to be compared with";
    out << "\n";
    const ErrorCounts& total = report.total;
    const uint64_t wrong = total.falseShadowCount + total.falseLightCount;
    if (wrong > 0) {
        char text[160];
        std::snprintf(text, sizeof text, "explained: %.1f %% of %llu wrong pairs",
                      100.0 * double(report.explainedCount()) / double(wrong),
                      static_cast<unsigned long long>(wrong));
        out << text;
        if (report.outlineNullSampleCount > 0) {
            std::snprintf(text, sizeof text,
                          "; of right pairs near outlines %.1f %% would be explained as well%s",
                          100.0 * report.outlineNullRate,
                          report.explainingHasPower() ? "" : ": explaining has no power here");
            out << text;
        }
        out << "\n";
    }
    if (const std::string note = poolNote(counts); !note.empty())
        out << note << "; enlarge it with --pool\n";
    if (const uint64_t settled = total.settledFalseShadowCount + total.settledFalseLightCount)
        out << "of the unexplained, " << settled
            << " are settled: " << settled - total.tapSettledCount
            << " by a shift aimed at the blocker, " << total.tapSettledCount
            << " by the truth along the taps' own rays, which agrees with the method\n";
    if (report.tapNullSampleCount > 0)
        out << "null rate of the taps' rays " << report.tapNullRate << ": share of "
            << report.tapNullSampleCount
            << " right results by maps whose reverse they would settle; " << report.tapOnlyNullRate
            << " where none of the 32 rays would\n";
}

/// Returns the errors of a view, in total and by light.
Json jsonOf(const ErrorReport& report) {
    Json json = toJson(report.total);
    json.update(nullRatesJson(report));
    json["lights"] = Json::array();
    for (size_t light = 0; light < report.perLight.size(); ++light) {
        Json entry = {{"light", light}};
        entry.update(toJson(report.perLight[light]));
        json["lights"].push_back(std::move(entry));
    }
    return json;
}

void runValidate(const ValidateOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    Experiment experiment = options.common.experiment(commandLine, false);
    takeGlDefaults(experiment, options.global.backend, commandLine);
    options.method.check(commandLine, experiment, measuredMethodNames(), console);
    if (experiment.frames.size() > 1)
        throw Error(ErrorKind::kUsage, "--frames '" + experiment.framesText +
                                           "': validate takes one frame; compare takes several");
    if (options.output.empty() && commandLine.given("--exposure"))
        throw Error(
            ErrorKind::kUsage,
            "--exposure has no effect without -o; give a directory for pictures or drop it");
    std::vector<std::string> directories; // of pictures, by view
    std::deque<DirectoryGuard> guards;    // the last made is the first to go
    for (uint32_t view = 0; !options.output.empty() && view < experiment.viewCount; ++view) {
        directories.push_back(options.output);
        if (experiment.viewCount > 1)
            directories.back() += "/" + experiment.viewCamera(view);
        guards.emplace_front(directories.back());
        createDirectory(directories.back());
        refuseForeignMaps(directories.back());
    }
    const Backend backend = options.global.apply(console, true);
    followGlPages(experiment, backend, commandLine);
    refuseOnGl(experiment, backend, options.method.variant);
    SingleFrames frames(options.scene, options.common, experiment, options.method, backend,
                        console);
    ErrorCounts total;
    Json views = Json::array();
    for (uint32_t view = 0; view < experiment.viewCount; ++view) {
        if (experiment.viewCount > 1)
            frames.setView(experiment.viewCamera(view));
        const FrameResult& result =
            frames.render(options.common.timeSeconds(experiment), experiment.frames.front()).frame;
        checkInterrupted();
        const std::string fewPairs =
            fewPairsWarning(frames.sceneName(), result.pairs.count(),
                            {experiment.lightCount >= 0, frames.isCameraAutomatic()});
        const ErrorReport report = frames.judge();
        checkInterrupted();
        if (!directories.empty())
            writeMaps(directories[view], frames, result, experiment);
        if (experiment.viewCount > 1)
            console.people() << frames.sceneName() << "\n";
        printReport(console.people(), report, result.counts);
        Json json = jsonOf(report);
        if (backend != Backend::kGl) { // whose samples are rounded to its own grid
            const SelfChecks checks = frames.checkItself(report);
            json["self_checks"] = checks.json();
            if (const std::string wrong = checks.text(); !wrong.empty())
                console.note("warning: " + wrong);
        }
        json["camera_numbers"] = frames.reproduction()["camera_numbers"];
        if (!fewPairs.empty()) {
            console.note("warning: " + fewPairs);
            json["warning"] = fewPairs;
        }
        if (experiment.viewCount > 1)
            json["camera"] = experiment.viewCamera(view);
        total.add(report.total);
        views.push_back(std::move(json));
    }
    if (experiment.viewCount > 1) {
        console.people() << experiment.viewCount << " views together\n";
        printHeader(console.people());
        printCounts(console.people(), "all", total);
    }
    Json json = frames.reproduction();
    json["scene"] = sceneNames({options.scene}).front();
    json.update(toJson(total));
    if (experiment.viewCount > 1) {
        json.erase("camera_numbers"); // of each view
        json["views"] = std::move(views);
    } else {
        json.update(views.front());
    }
    console.emit(json);
}

} // namespace

std::function<void()> declareValidate(CommandLine& commandLine) {
    auto options = std::make_shared<ValidateOptions>();
    commandLine.text("SCENE", options->scene, "", kSceneHelp, true);
    commandLine.text("-o,--output", options->output, "DIR",
                     "Directory for error maps: error.png (vermilion: false shadow, blue: false "
                     "light), truth.png, method.png, errors.exr; of several views in DIR/auto, "
                     "DIR/auto-2 and so on");
    options->method.declare(commandLine, "dag|maps|hybrid|embree");
    options->common.declare(commandLine,
                            {SettingGroup::kView, SettingGroup::kViews, SettingGroup::kPictures,
                             SettingGroup::kLights, SettingGroup::kVoxels, SettingGroup::kRays,
                             SettingGroup::kMaps},
                            false);
    options->global.declare(commandLine);
    return [options, &commandLine] {
        options->method.takeVariant(commandLine);
        runValidate(*options, commandLine);
    };
}

} // namespace shadowdag
