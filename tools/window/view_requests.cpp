// SPDX-License-Identifier: Apache-2.0
// The window's requests to its worker, the worker's replies, and their log.
#include "tools/settings/console.h"
#include "tools/window/view_viewer.h"
#include "tools/workspace/frame_json.h"

#include <sstream>
#include <utility>

namespace shadowdag {

namespace {

constexpr const char* kSaving = "saving...";

/// A picture counts as moving until nothing has changed for this time.
constexpr double kRestSeconds = 0.15;

} // namespace

void Viewer::takeResults() {
    if (std::optional<ViewSceneInfo> scene = session_.takeScene()) {
        const bool isOther = !ui_.hasScene || scene->serial != ui_.scene.serial;
        const bool isFirst = !ui_.hasScene;
        ui_.scene = std::move(*scene);
        ui_.hasScene = true;
        ui_.hasChanged = true;
        ui_.request.scene = ui_.scene.serial;
        if (isOther) {
            ui_.history.clear();
            ui_.picture.reset();
            ui_.pixel.reset();
            ui_.request.frozen.clear();
            ui_.request.pixel.reset();
            tour_.clear();
            if (!isFirst)
                ui_.request.light = -1;
            ui_.isPlaying = false;
            if (!isFirst) {
                ui_.request.frame = 0;
                ui_.playedFrame = 0;
            }
            takeFirstCamera();
            ui_.speed = flySpeed(glm::length(ui_.scene.bounds.extent()));
        }
        log_.write("scene", {{"scene", ui_.scene.argument},
                             {"triangle_count", ui_.scene.triangleCount},
                             {"light_count", ui_.scene.lights.size()},
                             {"resolution", ui_.scene.voxelResolution}});
    }
    if (std::shared_ptr<const ViewPicture> picture = session_.takePicture()) {
        if (ui_.hasScene && picture->request.scene == ui_.scene.serial) {
            noteHistory(ui_, *picture);
            ui_.picture = picture;
            if (!picture->tour.empty())
                tour_ = picture->tour;
            ui_.backend = picture->backend; // the requested one may not be available
            for (size_t side = 0; side < 2; ++side)
                if (!picture->sides[side].rgba.empty())
                    textures_[side].set(picture->sides[side].rgba, picture->width, picture->height);
            if (!picture->mapRgba.empty())
                mapTexture_.set(picture->mapRgba, picture->mapWidth, picture->mapHeight);
            isPictureNew_ = true;
        }
    }
    if (std::optional<SavedView> saved = session_.takeSaved()) {
        // An experiment contains no backend.
        ui_.message = "saved " + saved->png +
                      ", .exr, .experiment.json; rendered again by compare "
                      "--experiment with --backend " +
                      saved->backend;
        ui_.hasChanged = true; // saving rendered independently; the view's kept state starts over
        log_.write("saved", {{"png", saved->png},
                             {"exr", saved->exr},
                             {"experiment", saved->experiment},
                             {"backend", saved->backend}});
    }
    if (std::optional<TakenCosts> costs = session_.takeCosts()) {
        ui_.costs = costs->path;
        if (!costs->otherMachine.empty())
            ui_.message =
                "warning: the costs of " + costs->path + " were measured on " + costs->otherMachine;
        ui_.hasChanged = true;
        log_.write("costs", {{"path", costs->path}, {"other_machine", costs->otherMachine}});
    }
    const ViewStatus status = session_.status();
    ui_.statusWork = status.work;
    ui_.statusFraction = status.fraction;
    ui_.statusError = status.error;
    // The same failure twice is the same text: only the count tells that "saving..." has ended.
    if (std::exchange(failedSaveCount_, status.failedSaveCount) != status.failedSaveCount &&
        ui_.message == kSaving)
        ui_.message.clear();
    if (ui_.statusError != loggedError_) {
        // Each of its lines is one error; those that were told before are not told again.
        std::istringstream errors(ui_.statusError);
        for (std::string error; std::getline(errors, error);)
            if (("\n" + loggedError_ + "\n").find("\n" + error + "\n") == std::string::npos)
                Console(false).note("shadowdag: error: " + error);
        loggedError_ = ui_.statusError;
        if (!loggedError_.empty())
            ui_.message.clear(); // the requested one
        log_.write("error", {{"message", loggedError_}});
    }
    if (status.notes != ui_.notes) {
        ui_.notes = status.notes;
        log_.write("notes", {{"notes", ui_.notes}});
    }
    if (ui_.statusWork != loggedWork_) {
        loggedWork_ = ui_.statusWork;
        log_.write("work", {{"what", loggedWork_}});
    }
}

void Viewer::ask(double now) {
    if (ui_.wantsBackend) {
        ui_.wantsBackend = false;
        session_.setBackend(ui_.backend);
    }
    if (std::exchange(ui_.wantsPath, false) && !ui_.path.empty())
        openFiles({std::exchange(ui_.path, std::string())});
    if (ui_.wantsVoxels) {
        ui_.wantsVoxels = false;
        session_.open("", "", uint32_t(ui_.resolutionLog2), "");
    }
    if (!ui_.hasScene) {
        ui_.hasChanged = ui_.isDragged = ui_.wantsSave = ui_.wantsFreeze = false;
        isAskDue_ = false;
        return;
    }
    if (std::exchange(ui_.wantsFreeze, false) && ui_.picture) {
        // As numbers: a named camera would move with its animation.
        ui_.request.frozen =
            ui_.request.frozen.empty() ? FlyCamera(ui_.picture->camera).text() : "";
        if (!ui_.request.frozen.empty())
            startFlying();
        ui_.hasChanged = true;
    }
    if (ui_.hasChanged) {
        changed_ = now;
        isMoving_ = isMoving_ || ui_.isDragged || ui_.isPlaying;
    }
    const bool isResting = isMoving_ && !ui_.isPlaying && now - changed_ > kRestSeconds;
    if (isResting)
        isMoving_ = false;
    if (ui_.hasChanged || (isResting && wasRequestedMoving_)) {
        if (!isAskDue_)
            dueSeconds_ = now;
        isAskDue_ = true;
    }
    const bool willMove = isMoving_ || ui_.isPlaying;
    // Moving pictures are not requested while the worker renders one: the request would wait and
    // then be outdated.
    if (isAskDue_ && !(willMove && wasRequestedMoving_ && session_.isBusy())) {
        isAskDue_ = false;
        ui_.request.serial = ++serial_;
        ui_.request.requestedSeconds = now;
        ui_.request.changedSeconds = dueSeconds_;
        ui_.request.isMoving = wasRequestedMoving_ = willMove;
        session_.ask(ui_.request);
    }
    ui_.hasChanged = ui_.isDragged = false; // callbacks set them before the next step
    if (ui_.wantsSave) {
        ui_.wantsSave = false;
        ui_.message = kSaving;
        session_.save(ui_.request, options_.saveDirectory);
    }
}

void Viewer::logPicture(double now) {
    const ViewPicture& p = *ui_.picture;
    Json line = {{"serial", p.request.serial},
                 {"width", p.width},
                 {"height", p.height},
                 {"scale", p.scale},
                 {"map_scale", p.mapScale},
                 {"is_moving", p.request.isMoving},
                 {"is_final", p.isFinal},
                 {"work_ms", p.workMs},
                 {"latency_ms", 1000.0 * (now - p.request.requestedSeconds)},
                 {"change_ms", 1000.0 * (now - p.request.changedSeconds)},
                 {"frame", p.request.frame},
                 {"camera", p.request.camera},
                 {"frozen", p.request.frozen},
                 {"backend", p.backend},
                 {"overlay", kOverlayNames[size_t(p.request.overlay)]},
                 {"notes", p.notes},
                 {"caption", p.request.caption + 1},
                 {"interface_hz", ui_.interfaceFps}};
    Json sides = Json::array();
    for (size_t side = 0; side < 2; ++side) {
        const SideReport& report = p.sides[side];
        if (report.rgba.empty())
            continue;
        Json entry = {{"method", p.request.sides[side].method},
                      {"model", p.request.sides[side].model},
                      {"time_ms", report.stages.totalMs()},
                      {"stages", toJson(report.stages)},
                      {"traced_map_count", report.counts.tracedMapCount},
                      {"drawn_map_count", report.counts.drawnMapCount}};
        if (report.errors)
            entry.update({{"pair_count", report.errors->pairCount},
                          {"false_shadow_count", report.errors->falseShadowCount},
                          {"false_light_count", report.errors->falseLightCount},
                          {"done_share", report.errors->doneShare}});
        sides.push_back(std::move(entry));
    }
    line["sides"] = std::move(sides);
    if (p.pixel) {
        Json lights = Json::array();
        for (const PixelPair& pair : p.pixel->pairs) {
            Json answers = Json::object();
            for (const PairResult& answer : pair.answers)
                answers[answer.method] = answer.visibility;
            lights.push_back({{"light", pair.light},
                              {"served_by", pair.servedBy},
                              {"visibility", std::move(answers)}});
        }
        line["pixel"] = {{"x", p.pixel->x},
                         {"y", p.pixel->y},
                         {"has_sample", p.pixel->hasSample},
                         {"pairs", std::move(lights)}};
    }
    log_.write("picture", std::move(line));
}

void Viewer::countRate(double now) {
    ++rateCount_;
    if (now - rateStart_ < 1.0)
        return;
    ui_.interfaceFps = double(rateCount_) / (now - rateStart_);
    log_.write("rate", {{"interface_hz", ui_.interfaceFps}, {"is_idle", session_.isIdle()}});
    rateCount_ = 0;
    rateStart_ = now;
}

} // namespace shadowdag
