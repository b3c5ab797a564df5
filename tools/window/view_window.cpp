// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_window.h"

#include "tools/settings/console.h"
#include "tools/window/view_font.h"
#include "tools/window/view_viewer.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace shadowdag {

namespace {

constexpr float kPanelWidth = 350; // scaled
constexpr double kFrameSeconds = 1.0 / 60.0;
/// A new picture is shown this soon after the last drawing, not only when the next is due.
constexpr double kSoonestSeconds = kFrameSeconds / 2;
/// After the last event the interface is drawn for this long, until its response settles.
constexpr double kLingerSeconds = 0.4;

} // namespace

Viewer::Viewer(const ViewWindowOptions& options)
    : options_(options), window_(options.width, options.height), log_(options.logPath),
      session_(options.settings, options.targetMs, [] { glfwPostEmptyEvent(); }) {
    glfwSetWindowUserPointer(window_.handle, this);
    glfwSetKeyCallback(window_.handle, [](GLFWwindow* w, int key, int, int action, int mods) {
        of(w).onKey(key, action, mods);
    });
    glfwSetMouseButtonCallback(window_.handle, [](GLFWwindow* w, int button, int action, int) {
        of(w).onButton(button, action);
    });
    glfwSetCursorPosCallback(window_.handle, [](GLFWwindow* w, double x, double y) {
        of(w).touch();
        of(w).mouse_ = {float(x), float(y)};
    });
    glfwSetScrollCallback(window_.handle, [](GLFWwindow* w, double, double) { of(w).touch(); });
    glfwSetCharCallback(window_.handle, [](GLFWwindow* w, unsigned) { of(w).touch(); });
    glfwSetFramebufferSizeCallback(window_.handle, [](GLFWwindow* w, int, int) { of(w).touch(); });
    glfwSetWindowRefreshCallback(window_.handle, [](GLFWwindow* w) { of(w).touch(); });
    glfwSetDropCallback(window_.handle, [](GLFWwindow* w, int count, const char** paths) {
        of(w).onDrop(count, paths);
    });
    ui_.fontScale = std::clamp(options.fontScale > 0 ? options.fontScale : window_.contentScale(),
                               kLeastFontScale, kMostFontScale);
    if (options.fontScale == 0) // of another display that the window is moved to
        glfwSetWindowContentScaleCallback(window_.handle, [](GLFWwindow* w, float, float) {
            of(w).touch();
            of(w).ui_.fontScale = std::min(of(w).window_.contentScale(), kMostFontScale);
        });
    setFontScale(fontScale_ = ui_.fontScale);
    window_.startInterface();
    ui_.request.sides = options.sides;
    ui_.request.isSplit = options.isSplit;
    ui_.request.options = options.frame;
    ui_.request.camera = options.settings.experiment.camera;
    ui_.request.frame = options.firstFrame;
    ui_.request.wantsError = options.wantsTruth;
    ui_.request.overlay = options.overlay;
    ui_.request.voxelLevel = options.voxelLevel;
    ui_.request.light = options.light;
    ui_.showsLights = options.marksLights;
    if (options.captionSeconds > 0)
        demo_.emplace(options.captionSeconds);
    ui_.playedFrame = double(options.firstFrame);
    ui_.resolutionLog2 = int(options.resolutionLog2);
    takeModel();
    ui_.costs = options.settings.costs.path;
    ui_.backend = backendName(options.settings.backend);
    if (!options.scene.empty())
        session_.open(options.scene, options.settings.experiment.camera, options.resolutionLog2,
                      options.assetPath);
}

void Viewer::run() {
    touch();
    log_.write("open", {{"renderer", reinterpret_cast<const char*>(glGetString(GL_RENDERER))}});
    double last = glfwGetTime(), due = last;
    while (!glfwWindowShouldClose(window_.handle)) {
        waitUntil(last, due);
        checkInterrupted();
        const double now = glfwGetTime();
        step(now, std::min(now - last, 0.25));
        draw();
        countRate(now);
        last = now;
        due = std::max(std::min(due, now) + kFrameSeconds, glfwGetTime() - kFrameSeconds);
    }
    glfwHideWindow(window_.handle); // invisible to the user while the worker finishes
    glfwPollEvents();
    log_.write("closed", Json::object());
    // A scene that was named and never opened sets the exit status as in every command.
    if (!ui_.hasScene && !options_.scene.empty() && !ui_.statusError.empty())
        throw Error(ErrorKind::kInput,
                    "no scene was open: " + options_.scene + " could not be opened");
}

bool Viewer::isLively(double now) const {
    return now - touched_ < kLingerSeconds || isMoving_ || ui_.isPlaying || demo_ || heldKeys() ||
           !session_.isIdle() || session_.hasPicture();
}
bool Viewer::heldKeys() const {
    for (const int key : {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E})
        if (glfwGetKey(window_.handle, key) == GLFW_PRESS)
            return true;
    return false;
}

void Viewer::waitUntil(double last, double due) {
    glfwPollEvents();
    while (!glfwWindowShouldClose(window_.handle)) {
        const double now = glfwGetTime();
        const double drawn = session_.hasPicture() ? std::min(due, last + kSoonestSeconds) : due;
        const double wait = isLively(now) ? drawn - now : 0.25;
        if (wait <= 0.0)
            return;
        glfwWaitEventsTimeout(wait);
        if (!isLively(glfwGetTime()))
            return; // a slow heartbeat, so that interrupts are handled
    }
}

void Viewer::step(double now, double seconds) {
    if (fontScale_ != ui_.fontScale) {
        setFontScale(fontScale_ = ui_.fontScale);
        window_.refreshFonts();
    }
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    takeResults();
    playDemo(now);

    const ImVec2 size = ImGui::GetIO().DisplaySize;
    // Large text leaves the picture two fifths of the window; in a very small one there is no
    // panel.
    const float panel = ui_.showsPanel && size.x > 1.4f * kPanelWidth
                            ? std::min(scaled(kPanelWidth), 0.6f * size.x)
                            : 0.0f;
    const ImVec2 from{panel, 0};
    pictureFrom_ = from;
    pictureTo_ = {std::max(size.x, panel + 16), std::max(size.y, 16.0f)};
    const uint32_t width = uint32_t(pictureTo_.x - pictureFrom_.x),
                   height = uint32_t(pictureTo_.y - pictureFrom_.y);
    FrameOptions& options = ui_.request.options;
    if (options.width != width || options.height != height) {
        options.width = width;
        options.height = height;
        ui_.hasChanged = true;
    }
    showPicture();
    if (panel > 0)
        drawPanel(ui_, panel, size.y, mapTexture_.name());
    drawOverPicture(ui_, pictureFrom_, pictureTo_);

    const ImGuiIO& io = ImGui::GetIO();
    takePress();
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left))
        isSplitDragged_ = false;
    if (isSplitDragged_)
        ui_.request.split =
            std::clamp((io.MousePos.x - pictureFrom_.x) / float(width), 0.02f, 0.98f);
    fly(seconds);
    if (ui_.isPlaying && ui_.scene.isAnimated()) {
        ui_.playedFrame = std::fmod(ui_.playedFrame + seconds * options_.settings.experiment.fps,
                                    double(ui_.scene.frameCount));
        if (uint32_t(ui_.playedFrame) != ui_.request.frame) {
            ui_.request.frame = uint32_t(ui_.playedFrame);
            ui_.hasChanged = true;
        }
    }
    ask(now);
}

void Viewer::playDemo(double now) {
    ui_.demo.reset();
    if (!demo_ || !ui_.hasScene || !ui_.picture)
        return;
    ViewRequest& request = ui_.request;
    const bool hasPath = ui_.scene.isCameraAnimated || !tour_.empty();
    if (!hasPath && !std::exchange(request.wantsTour, true))
        ui_.hasChanged = true;
    if (!hasPath)
        return;
    demo_->stepTo(now, ui_.picture->request.caption);
    const DemoMoment moment = demo_->moment();
    ui_.demo = moment;
    if (showMoment(moment, ui_.scene, tour_, options_.frame.rays.believe, request)) {
        ui_.hasChanged = true;
        ui_.isDragged = moment.isFlying;
    }
    if (int(moment.caption()) != loggedCaption_) {
        loggedCaption_ = int(moment.caption());
        ui_.pixel.reset();
        ui_.pixelLight = -1;
        request.split = 0.5f;
        setModel(ui_, request.sides[0].model);
        log_.write("demo", {{"caption", moment.caption() + 1},
                            {"title", kDemoCaptions[moment.caption()].title}});
    }
    ui_.threshold = moment.threshold;
    ui_.playedFrame = double(request.frame);
    ui_.isFlying = !tour_.empty();
    if (ui_.isFlying)
        ui_.camera = FlyCamera(tourCamera(tour_, moment));
}

bool Viewer::endDemo() {
    if (!demo_)
        return false;
    demo_.reset();
    ui_.request.wantsTour = false;
    ui_.request.caption = -1;
    ui_.request.pixel.reset();
    ui_.pixel.reset();
    ui_.hasChanged = true;
    log_.write("demo", {{"ended", true}});
    return true;
}

void Viewer::showPicture() {
    ImDrawList* const list = ImGui::GetBackgroundDrawList();
    if (ui_.picture && !textures_[0].empty()) {
        const auto image = [&](const ViewTexture& texture, float u0, float u1) {
            const float width = pictureTo_.x - pictureFrom_.x;
            list->AddImage(reinterpret_cast<ImTextureID>(uintptr_t(texture.name())),
                           {pictureFrom_.x + width * u0, pictureFrom_.y},
                           {pictureFrom_.x + width * u1, pictureTo_.y}, {u0, 0}, {u1, 1});
        };
        const bool isSplit = ui_.picture->request.isSplit && !textures_[1].empty();
        image(textures_[0], 0.0f, isSplit ? ui_.request.split : 1.0f);
        if (isSplit)
            image(textures_[1], ui_.request.split, 1.0f);
    }
}

void Viewer::draw() {
    ImGui::Render();
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.handle, &width, &height);
    glViewport(0, 0, width, height);
    glClearColor(0.03f, 0.03f, 0.04f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window_.handle);
    if (isPictureNew_) {
        isPictureNew_ = false;
        const double shown = glfwGetTime();
        if (ui_.picture->request.isMoving)
            ui_.latencyMs = 1000.0 * (shown - ui_.picture->request.changedSeconds);
        logPicture(shown);
    }
    if (log_.isOn() && ui_.layout != loggedLayout_) {
        loggedLayout_ = ui_.layout;
        ui_.layout["picture"] = {int(pictureFrom_.x), int(pictureFrom_.y),
                                 int(pictureTo_.x - pictureFrom_.x),
                                 int(pictureTo_.y - pictureFrom_.y)};
        loggedLayout_ = ui_.layout;
        log_.write("layout", {{"widgets", ui_.layout}});
    }
}

void runViewWindow(const ViewWindowOptions& options) {
    Viewer(options).run();
}

} // namespace shadowdag
