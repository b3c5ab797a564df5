// SPDX-License-Identifier: Apache-2.0
// Handles keys, the mouse, and files that are named or dropped.
#include "scenes/builtin.h"
#include "scenes/input_file.h"
#include "scenes/scene_file.h"
#include "scenes/scene_kind.h"
#include "tools/settings/console.h"
#include "tools/settings/parse.h"
#include "tools/window/view_font.h"
#include "tools/window/view_viewer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

namespace shadowdag {

namespace {

constexpr double kRadiansPerPixel = 0.004;

} // namespace

void Viewer::takeModel() {
    setModel(ui_, ui_.request.sides[0].model);
}

void Viewer::changeThreshold(double factor) {
    if (ui_.modelKind != ModelKind::kTexels)
        return;
    const double from = std::isfinite(ui_.threshold) ? double(ui_.threshold) : 4096;
    // By at least a texel, otherwise small thresholds would not change.
    const double to =
        factor > 1 ? std::max(from * factor, from + 1) : std::min(from * factor, from - 1);
    ui_.threshold = float(std::clamp(std::round(to), 0.0, 4096.0));
    for (ViewSide& side : ui_.request.sides)
        side.model = "texels:" + numberText(double(ui_.threshold));
    ui_.hasChanged = true;
}

void Viewer::onKey(int key, int action, int mods) {
    touch();
    if (action == GLFW_RELEASE || endDemo() || ImGui::GetIO().WantTextInput)
        return;
    ViewRequest& r = ui_.request;
    const bool isShift = (mods & GLFW_MOD_SHIFT) != 0;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_5) {
        r.sides[isShift ? 1 : 0].method = methodNames()[size_t(key - GLFW_KEY_1)];
        r.isSplit = r.isSplit || isShift;
        ui_.hasChanged = true;
        return;
    }
    if ((mods & GLFW_MOD_CONTROL) != 0) {
        const float step = std::sqrt(std::sqrt(2.0f));
        const float scale = key == GLFW_KEY_EQUAL || key == GLFW_KEY_KP_ADD ? ui_.fontScale * step
                            : key == GLFW_KEY_MINUS || key == GLFW_KEY_KP_SUBTRACT
                                ? ui_.fontScale / step
                            : key == GLFW_KEY_0 ? window_.contentScale()
                                                : ui_.fontScale;
        ui_.fontScale = std::clamp(scale, kLeastFontScale, kMostFontScale);
        return;
    }
    switch (key) {
    case GLFW_KEY_SPACE:
        ui_.isPlaying = !ui_.isPlaying && ui_.scene.isAnimated();
        break;
    case GLFW_KEY_COMMA:
    case GLFW_KEY_PERIOD:
        if (ui_.scene.isAnimated()) {
            r.frame = key == GLFW_KEY_PERIOD ? std::min(r.frame + 1, ui_.scene.frameCount - 1)
                                             : r.frame - std::min(r.frame, 1u);
            ui_.playedFrame = double(r.frame);
            ui_.hasChanged = true;
        }
        break;
    case GLFW_KEY_LEFT_BRACKET:
        changeThreshold(1 / std::sqrt(2.0));
        break;
    case GLFW_KEY_RIGHT_BRACKET:
        changeThreshold(std::sqrt(2.0));
        break;
    case GLFW_KEY_TAB:
        r.isSplit = !r.isSplit;
        ui_.hasChanged = true;
        break;
    case GLFW_KEY_O:
        r.overlay = ViewOverlay((int(r.overlay) + (isShift ? int(kOverlayNames.size()) - 1 : 1)) %
                                int(kOverlayNames.size()));
        ui_.hasChanged = true;
        break;
    case GLFW_KEY_L:
        ui_.showsLights = !ui_.showsLights;
        break;
    case GLFW_KEY_F:
        ui_.wantsFreeze = true;
        break;
    case GLFW_KEY_C:
        if (!ui_.scene.cameras.empty()) {
            camera_ = (camera_ + 1) % ui_.scene.cameras.size();
            r.camera = ui_.scene.cameras[camera_];
            ui_.isFlying = false;
            ui_.hasChanged = true;
        }
        break;
    case GLFW_KEY_HOME:
        takeFirstCamera();
        ui_.hasChanged = true;
        break;
    case GLFW_KEY_ESCAPE:
        r.pixel.reset();
        ui_.pixel.reset();
        ui_.message.clear();
        ui_.openError.clear();
        session_.clearErrors();
        ui_.hasChanged = true;
        break;
    case GLFW_KEY_F1:
        ui_.showsPanel = !ui_.showsPanel;
        break;
    case GLFW_KEY_F12:
        ui_.wantsSave = true;
        break;
    default:
        break;
    }
}

void Viewer::onButton(int button, int action) {
    touch();
    // The mouse may be elsewhere at the next step, so its position at the event is kept.
    if (action != GLFW_PRESS || endDemo())
        return;
    if (button == GLFW_MOUSE_BUTTON_LEFT)
        pressed_ = mouse_;
    else if (button == GLFW_MOUSE_BUTTON_RIGHT)
        lookPressed_ = mouse_;
}

/// Handles a press on the picture: moves the divider, or requests a pixel's report.
void Viewer::takePress() {
    const std::optional<ImVec2> at = std::exchange(pressed_, std::nullopt);
    if (!at || ImGui::GetIO().WantCaptureMouse || !ui_.hasScene || at->x < pictureFrom_.x ||
        at->x >= pictureTo_.x)
        return;
    const float width = pictureTo_.x - pictureFrom_.x, height = pictureTo_.y - pictureFrom_.y;
    const float splitX = pictureFrom_.x + width * ui_.request.split;
    if (ui_.request.isSplit && std::abs(at->x - splitX) < 8.0f) {
        isSplitDragged_ = true;
    } else {
        ui_.request.pixel =
            glm::vec2((at->x - pictureFrom_.x) / width, (at->y - pictureFrom_.y) / height);
        ui_.pixel.reset();
        ui_.pixelLight = -1;
        ui_.hasChanged = true;
    }
}

void Viewer::onDrop(int count, const char** paths) {
    touch();
    openFiles({paths, paths + count});
}

void Viewer::complain(const std::string& why) {
    ui_.openError += (ui_.openError.empty() ? "" : "\n") + why;
    Console(false).note("shadowdag: error: " + why);
    log_.write("error", {{"message", why}});
}

void Viewer::openFiles(const std::vector<std::string>& paths) {
    std::string scene, asset, costs;
    ui_.message.clear();
    ui_.openError.clear();
    for (const std::string& path : paths) {
        const std::string extension = lowerCaseExtension(path);
        const bool isBuiltin = path.starts_with("builtin:");
        const bool isScene = isBuiltin || isSceneName(path);
        try {
            // Before the worker ends what it does for this.
            if (isScene)
                requireScene(path);
            if (const std::string why = isBuiltin ? "" : whyNoInput(path, ~uint64_t(0));
                !why.empty())
                throw Error(ErrorKind::kInput,
                            path + ": " + why + "; name a file that can be read");
            if (!isScene && extension != ".svdag" && extension != ".json")
                throw Error(ErrorKind::kUsage, path + ": not a scene (.glb, .gltf, .obj, ...), "
                                                      "voxels (.svdag) or costs (.json)");
        } catch (const Error& error) {
            complain(error.what());
            continue;
        }
        (isScene ? scene : extension == ".svdag" ? asset : costs) = path;
    }
    if (!costs.empty())
        session_.setCosts(costs);
    if (!scene.empty() || !asset.empty())
        session_.open(scene, "", options_.resolutionLog2, asset);
    log_.write("drop",
               {{"scene", scene}, {"asset", asset}, {"costs", costs}, {"message", ui_.openError}});
}

/// Returns whether the camera can fly: not before its start is known.
bool Viewer::startFlying() {
    if (!ui_.isFlying) {
        if (!ui_.picture || ui_.picture->request.camera != ui_.request.camera)
            return false;
        ui_.camera = FlyCamera(ui_.picture->camera);
        ui_.isFlying = true;
    }
    ui_.request.camera = ui_.camera.text();
    return true;
}

/// Returns to the first view of the scene.
void Viewer::takeFirstCamera() {
    ui_.isFlying = ui_.scene.isPlaced; // no text but numbers means a camera that was found
    ui_.camera = FlyCamera(ui_.scene.camera);
    ui_.request.camera = ui_.isFlying ? ui_.camera.text() : ui_.scene.cameraText;
}

void Viewer::fly(double seconds) {
    const ImGuiIO& io = ImGui::GetIO();
    const auto isHeld = [&](int key) {
        return glfwGetKey(window_.handle, key) == GLFW_PRESS ? 1.0f : 0.0f;
    };
    FlyInput input;
    if (!io.WantTextInput)
        input.along = {isHeld(GLFW_KEY_D) - isHeld(GLFW_KEY_A),
                       isHeld(GLFW_KEY_E) - isHeld(GLFW_KEY_Q),
                       isHeld(GLFW_KEY_W) - isHeld(GLFW_KEY_S)};
    input.isFast = isHeld(GLFW_KEY_LEFT_SHIFT) > 0 || isHeld(GLFW_KEY_RIGHT_SHIFT) > 0;
    const bool isOver = !io.WantCaptureMouse && io.MousePos.x >= pictureFrom_.x;
    if (const std::optional<ImVec2> at = std::exchange(lookPressed_, std::nullopt);
        at && at->x >= pictureFrom_.x && isOver)
        isLookDragged_ = true;
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Right))
        isLookDragged_ = false;
    if (isLookDragged_)
        input.turn = {io.MouseDelta.x, io.MouseDelta.y};
    if (isOver && io.MouseWheel != 0.0f)
        ui_.speed = std::clamp(ui_.speed * std::pow(1.25, double(io.MouseWheel)), 1e-4, 1e6);
    if (!input.any() || !ui_.hasScene || !startFlying())
        return;
    ui_.camera.step(input, seconds, ui_.speed, kRadiansPerPixel);
    ui_.request.camera = ui_.camera.text();
    ui_.hasChanged = ui_.isDragged = true;
}

} // namespace shadowdag
