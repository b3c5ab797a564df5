// SPDX-License-Identifier: Apache-2.0
// `shadowdag view`: the window.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/window/view_font.h"
#include "tools/window/view_window.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/scene_setup.h"

#include <algorithm>
#include <memory>

namespace shadowdag {

namespace {

struct ViewOptions {
    GlobalOptions global;
    CommonOptions common;
    std::string method = "dag", model, costs;
    std::string scene, right, saveDirectory = ".", log, target = "22";
    std::string show = "lit-scene", level = "0", light = "-1", fontScale, captionSeconds = "10";
    bool marksLights = false, noTruth = false, isDemo = false;
};

/// Returns the name of an overlay as an option has it.
std::string optionName(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

/// Returns the names of all overlays, separated.
std::string overlayNames(const char* separator) {
    std::string names;
    for (const char* name : kOverlayNames)
        names += (names.empty() ? "" : separator) + optionName(name);
    return names;
}

ViewOverlay parseOverlay(const std::string& text) {
    for (size_t i = 0; i < kOverlayNames.size(); ++i)
        if (text == optionName(kOverlayNames[i]))
            return ViewOverlay(i);
    throw Error(ErrorKind::kUsage, "--show '" + text + "': use one of " + overlayNames(", "));
}

/// Throws Error kUsage for options of the demo that contradict others.
void checkDemo(const ViewOptions& options, const CommandLine& commandLine) {
    if (!options.isDemo) {
        if (commandLine.given("--caption-seconds"))
            throw Error(ErrorKind::kUsage,
                        "--caption-seconds has no effect without --demo; add that or drop it");
        return;
    }
    if (options.scene.empty())
        throw Error(ErrorKind::kUsage, "--demo needs a SCENE, for example builtin:atrium");
    for (const char* option :
         {"--method", "--model", "--right", "--show", "--level", "--light", "--no-truth"})
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) +
                                               " and --demo contradict each other: the demo's "
                                               "captions set it; drop one of them");
}

/// Throws Error kUsage for an unknown method or model. Options of any method are accepted, because
/// the window can choose each method.
void checkSides(const ViewOptions& options) {
    checkMethod("--method", options.method);
    if (!options.right.empty())
        checkMethod("--right", options.right);
    const std::unique_ptr<CostModel> model =
        makeCostModel(methodOf("hybrid").modelText(options.model));
    if (options.costs.empty())
        giveCalibration(*model, {}); // missing input is reported before any work
}

void runView(const ViewOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    Experiment experiment = options.common.experiment(commandLine, false);
    checkSides(options);
    if (experiment.frames.size() > 1)
        throw Error(ErrorKind::kUsage, "--frames '" + options.common.text("--frames") +
                                           "': the window starts at one frame; give one");
    ViewWindowOptions view;
    view.scene = options.scene;
    view.width = experiment.width;
    view.height = experiment.height;
    checkDemo(options, commandLine);
    // Pictures of the demo should rather be large than come at the rate of a hand.
    constexpr double kDemoTargetMs = 80;
    view.targetMs = options.isDemo && !commandLine.given("--target")
                        ? kDemoTargetMs
                        : parseNumber("--target", options.target, 1, 10000);
    view.overlay = parseOverlay(options.show);
    view.voxelLevel = uint32_t(parseInteger("--level", options.level, 0, kMaxResolutionLog2));
    view.light = int(parseInteger("--light", options.light, -1, kMaxPlacedLightCount));
    view.marksLights = options.marksLights;
    view.wantsTruth = !options.noTruth;
    if (!options.fontScale.empty())
        view.fontScale =
            float(parseNumber("--font-scale", options.fontScale, kLeastFontScale, kMostFontScale));
    const double captionSeconds =
        parseNumber("--caption-seconds", options.captionSeconds, 0.1, 3600);
    view.captionSeconds = options.isDemo ? captionSeconds : 0;
    for (ViewSide& side : view.sides)
        side = {options.method, methodOf("hybrid").modelText(options.model)};
    view.sides[1].method = "truth";
    if (!options.right.empty()) {
        view.sides[1].method = options.right;
        view.isSplit = true;
    }
    view.settings.backend = options.global.apply(console, true);
    followGlPages(experiment, view.settings.backend, commandLine);
    takeGlDefaults(experiment, options.global.backend, commandLine);
    refuseOnGl(experiment, view.settings.backend, ""); // can be changed in the window
    view.frame = baseOptions(experiment);
    view.firstFrame = experiment.frames.front();
    view.resolutionLog2 = experiment.resolutionLog2.front();
    if (!options.common.voxels.empty())
        view.assetPath = options.common.voxels.front();
    view.saveDirectory = options.saveDirectory;
    if (commandLine.given("--save-to")) // otherwise the folder may be read-only
        checkWritable(view.saveDirectory + "/view-0000.experiment.json");
    view.logPath = options.log;
    view.settings.experiment = experiment;
    view.settings.cacheDirectory = options.common.cache;
    view.settings.allowStale = options.common.allowStale;
    if (!options.costs.empty()) {
        view.settings.costs = readCostSource(options.costs, buildProvenance(view.settings.backend));
        giveCalibration(*makeCostModel(methodOf("hybrid").modelText(options.model)),
                        view.settings.costs);
        if (!view.settings.costs.otherMachine.empty())
            console.note("warning: --costs " + options.costs + " are of " +
                         view.settings.costs.otherMachine);
    }
    runViewWindow(view);
    console.emit({{"scene", options.scene}});
}

} // namespace

std::function<void()> declareView(CommandLine& commandLine) {
    auto options = std::make_shared<ViewOptions>();
    options->common.text("--size") = "1280x720";
    commandLine.text("SCENE", options->scene, "",
                     std::string(kSceneHelp) + "; without one, drop a file on the window");
    commandLine.heading("Method");
    commandLine.text("--method", options->method, "truth|dag|maps|hybrid|embree",
                     "Initial method [dag]");
    commandLine.text("--model", options->model, "M",
                     "Cost model of hybrid: texels:N, cost, oracle, expr:EXPRESSION [texels:96]");
    commandLine.text("--costs", options->costs, "F",
                     "Costs for the models cost and oracle, as calibrate and compare write them");
    commandLine.text("--right", options->right, "METHOD",
                     "Split the picture; method of the right side [truth, once it is split]");
    commandLine.heading("Window");
    commandLine.flag(
        "--demo", options->isDemo,
        "Fly through the scene by itself and explain in six captions what is seen; any "
        "key or click ends it");
    commandLine.text("--caption-seconds", options->captionSeconds, "S",
                     "With --demo: how long each caption is shown [10]");
    commandLine.text("--show", options->show, "WHAT",
                     "What the picture shows: " + overlayNames(", ") + " [lit-scene]");
    commandLine.text("--level", options->level, "L",
                     "With voxels: cells of 2^L voxels are shown [0]");
    commandLine.text("--light", options->light, "N",
                     "Light that resolutions, pages, projection maps and ray steps are shown of "
                     "[-1: any]");
    commandLine.flag("--mark-lights", options->marksLights,
                     "Mark every light and the sphere that it reaches");
    commandLine.flag("--no-truth", options->noTruth,
                     "Do not compute the truth while the view rests");
    commandLine.text("--font-scale", options->fontScale, "S",
                     "Size of the text: 1 is 13 pixels, from 0.75 to 4 [the display's]");
    commandLine.text("--save-to", options->saveDirectory, "DIR",
                     "Directory in which F12 writes view-NNNN.png, .exr and .experiment.json [.]");
    commandLine.text(
        "--target", options->target, "MS",
        "Time limit of a picture while the camera moves; its size adapts to it [22; 80 "
        "with --demo]");
    commandLine.text("--log", options->log, "F.jsonl",
                     "Write a line of JSON for every picture, file, error and change of layout");
    options->common.isWindow = true;
    options->common.declare(commandLine, {SettingGroup::kView, SettingGroup::kPictures}, true);
    options->common.declare(
        commandLine,
        {SettingGroup::kLights, SettingGroup::kVoxels, SettingGroup::kRays, SettingGroup::kMaps},
        false);
    options->global.declare(commandLine);
    return [options, &commandLine] { runView(*options, commandLine); };
}

} // namespace shadowdag
