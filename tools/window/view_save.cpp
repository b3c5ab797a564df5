// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_save.h"

#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/setting.h"
#include "tools/window/view_frame.h"
#include "tools/window/view_scene.h"
#include "tools/workspace/whole_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// Returns the stem of files that are not there yet.
std::string freeStem(const std::string& directory) {
    for (int number = 1; number < 10000; ++number) {
        char name[32];
        std::snprintf(name, sizeof name, "view-%04d", number);
        const std::string stem = directory + "/" + name;
        std::error_code ignored;
        if (!fs::exists(stem + ".png", ignored) && !fs::exists(stem + ".exr", ignored) &&
            !fs::exists(stem + ".experiment.json", ignored))
            return stem;
    }
    throw Error(ErrorKind::kResource,
                directory + ": contains view-0001 to view-9999; save to another directory");
}

} // namespace

Experiment experimentOf(const ViewRequest& request, const Experiment& base,
                        const std::string& scene, const Dag& dag, float exposure) {
    Experiment e = base;
    const FrameOptions& options = request.options;
    e.title = "A view of " + scene;
    // An absolute path, so that compare can find it from any directory.
    e.scenes = {scene.starts_with("builtin:") ? scene : fs::absolute(scene).string()};
    e.width = options.width;
    e.height = options.height;
    e.camera = request.camera;
    e.exposure = double(exposure);
    e.frames = {request.frame};
    e.framesText = std::to_string(request.frame);
    e.methods.clear();
    e.thresholds.clear();
    e.models.clear();
    for (size_t side = 0; side < (request.isSplit ? 2u : 1u); ++side) {
        const ViewSide& asked = request.sides[side];
        if (!methodOf(asked.method).isTruth() &&
            std::find(e.methods.begin(), e.methods.end(), asked.method) == e.methods.end())
            e.methods.push_back(asked.method);
        if (!asked.isRouted())
            continue;
        if (asked.model.starts_with("texels:")) {
            const std::vector<float> threshold =
                parseThresholds("--model", asked.model.substr(asked.model.find(':') + 1));
            if (std::find(e.thresholds.begin(), e.thresholds.end(), threshold[0]) ==
                e.thresholds.end())
                e.thresholds.push_back(threshold[0]);
            // texels:0 and texels:inf are methods of their own there.
            const std::string pure = threshold[0] == 0          ? "maps"
                                     : std::isinf(threshold[0]) ? "dag"
                                                                : "";
            if (!pure.empty() &&
                std::find(e.methods.begin(), e.methods.end(), pure) == e.methods.end())
                e.methods.push_back(pure);
        } else if (std::find(e.models.begin(), e.models.end(), asked.model) == e.models.end()) {
            e.models.push_back(asked.model);
        }
    }
    if (e.methods.empty()) // the truth alone: its picture is in every report
        e.methods = {"dag"};
    std::sort(e.thresholds.begin(), e.thresholds.end());
    if (e.thresholds.empty())
        e.thresholds = {0};
    e.variants.clear();
    e.isSequence = false;
    // What no side reads stays as it is by default: compare refuses settings without a reader.
    const auto isRead = [&](ReadBy readBy) {
        return std::any_of(e.methods.begin(), e.methods.end(), [&](const std::string& method) {
            RunParameters run;
            run.method = method;
            run.frame = options;
            return reads(run, readBy);
        });
    };
    e.resolutionLog2 = Experiment().resolutionLog2;
    if (dag.isBuilt() && isRead(ReadBy::kRays))
        e.resolutionLog2 = {dag.grid.resolutionLog2};
    e.dagResolutionLog2.clear();
    for (const Setting* setting : frameSettings())
        setting->set(e, setting->option,
                     {isRead(setting->readBy) ? setting->frameText(options)
                                              : setting->texts(Experiment()).front()});
    e.routeMargin = {0}; // the view is rendered independently, without frames before
    return e;
}

SavedView writeView(const ViewFiles& files, const std::string& directory) {
    std::error_code ignored;
    fs::create_directories(directory, ignored);
    const ViewPicture& view = files.view;
    const std::string stem = freeStem(directory);
    const SavedView saved{stem + ".png", stem + ".exr", stem + ".experiment.json", view.backend};
    checkWritable(saved.png);
    std::vector<uint8_t> shown = view.sides[0].rgba;
    if (view.request.isSplit) {
        const uint32_t from = uint32_t(
            std::lround(double(view.width) * double(std::clamp(view.request.split, 0.0f, 1.0f))));
        const std::vector<uint8_t>& right = view.sides[1].rgba;
        for (uint32_t y = 0; y < view.height; ++y) {
            const ptrdiff_t row = ptrdiff_t(y) * view.width;
            std::copy(right.begin() + 4 * (row + from), right.begin() + 4 * (row + view.width),
                      shown.begin() + 4 * (row + from));
        }
    }
    writePngBytes(saved.png, view.width, view.height, shown);
    std::vector<std::pair<std::string, std::string>> attributes{
        {"scene", files.scene},
        {"method", view.request.sides[0].method},
        {"commit", programCommit()}};
    if (view.request.isSplit)
        attributes.push_back({"right.method", view.request.sides[1].method});
    writeExr(saved.exr, view.width, view.height, files.channels, attributes);
    writeWholeFile(saved.experiment,
                   jsonText(toJson(experimentOf(view.request, files.experiment, files.scene,
                                                files.dag, files.exposure))));
    return saved;
}

SavedView ViewRenderer::save(const ViewRequest& asked, const std::string& directory,
                             const ViewHooks& hooks) {
    if (!asked.frozen.empty())
        throw Error(ErrorKind::kUsage,
                    "a frozen view is not a frame of one camera; leave it (F) and "
                    "save again");
    if (settings_.allowStale && !open_->assetPath.empty())
        throw Error(ErrorKind::kUsage, "a view with --allow-stale cannot be reproduced from the "
                                       "scene's own voxels; open it without, and save again");
    ViewRequest request = asked;
    request.isMoving = false;
    request.wantsError = true;
    request.pixel.reset();
    ViewScene& o = *open_;
    render(request, 1.0f, hooks);
    ViewShown& s = *shown_;
    std::vector<uint32_t> rest;
    for (uint32_t i = 0; i < s.gbuffer.count(); ++i)
        if (!s.refinement.isAnswered(i))
            rest.push_back(i);
    s.refinement.finish(o.workspace.truth());
    countErrors(rest);
    const std::shared_ptr<ViewPicture> whole = picture(hooks);

    ViewFiles files{*whole,  settings_.experiment, o.workspace.scene().argument,
                    o.dag(), exposure(),           {}};
    for (size_t side = 0; side < 2; ++side) {
        if (!s.shows(side))
            continue;
        const bool hasFrame = s.hasFrame(side);
        std::vector<ExrChannel> channels = frameChannels(
            {side == 0 ? "" : "right.", hasFrame ? s.frames[side].color : truthColor(),
             ExrChannel::Type::kFloat, s.gbuffer, *s.pairs,
             hasFrame ? s.frames[side].visibility : s.refinement.visibility(),
             hasFrame ? s.frames[side].pairRoute : std::vector<Route>(),
             hasFrame ? s.refinement.visibility() : std::vector<uint8_t>()});
        std::move(channels.begin(), channels.end(), std::back_inserter(files.channels));
    }
    return writeView(files, directory);
}

} // namespace shadowdag
