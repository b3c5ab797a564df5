// SPDX-License-Identifier: Apache-2.0
#include "tools/view_window.h"

#include "tools/console.h"
#include "tools/frame_json.h"
#include "tools/parse.h"
#include "tools/view_log.h"
#include "tools/view_session.h"
#include "tools/view_texture.h"
#include "tools/view_ui.h"

#define GLFW_INCLUDE_NONE // epoxy declares OpenGL
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

namespace shadowdag {

namespace {

constexpr float kPanelWidth = 350; // times the font's scale
constexpr double kFrameSeconds = 1.0 / 60.0;
/// After the last event the interface is drawn on for so long: what it answers settles.
constexpr double kLingerSeconds = 0.4;
/// A picture counts as moving until nothing has changed for so long.
constexpr double kRestSeconds = 0.15;
constexpr double kRadiansPerPixel = 0.004;

std::string glfwComplaint() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? text : "no reason given";
}

/// GLFW, its window with a context that is current, and Dear ImGui on both.
class Window {
public:
    Window(uint32_t width, uint32_t height) {
        if (!glfwInit())
            throw Error(ErrorKind::kDevice, "no window can be opened: " + glfwComplaint() +
                                                "; a display is needed (DISPLAY), or use render");
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
        handle = glfwCreateWindow(int(width), int(height), "ShadowDAG", nullptr, nullptr);
        if (handle == nullptr) {
            const std::string why = glfwComplaint();
            glfwTerminate();
            throw Error(ErrorKind::kDevice, "no window with OpenGL 3.3 can be opened: " + why);
        }
        glfwMakeContextCurrent(handle);
        glfwSwapInterval(0); // paced below: a driver's own pace may be none, or block
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr; // nothing is left behind
        ImGui::StyleColorsDark();
        ImGui::GetStyle().WindowRounding = 0;
        float scale = 1;
        glfwGetWindowContentScale(handle, &scale, nullptr);
        ImGui::GetIO().FontGlobalScale = std::max(1.0f, scale);
    }
    /// After the window's own callbacks are set: ImGui's call them on.
    void startInterface() {
        ImGui_ImplGlfw_InitForOpenGL(handle, true);
        ImGui_ImplOpenGL3_Init("#version 330");
        hasInterface_ = true;
    }
    ~Window() {
        if (hasInterface_) {
            ImGui_ImplOpenGL3_Shutdown();
            ImGui_ImplGlfw_Shutdown();
        }
        ImGui::DestroyContext();
        glfwDestroyWindow(handle);
        glfwTerminate();
    }
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    GLFWwindow* handle = nullptr;

private:
    bool hasInterface_ = false;
};

/// The window while it is open.
class Viewer {
public:
    explicit Viewer(const ViewWindowOptions& options)
        : options_(options), log_(options.logPath), window_(options.width, options.height),
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
        glfwSetFramebufferSizeCallback(window_.handle,
                                       [](GLFWwindow* w, int, int) { of(w).touch(); });
        glfwSetWindowRefreshCallback(window_.handle, [](GLFWwindow* w) { of(w).touch(); });
        glfwSetDropCallback(window_.handle, [](GLFWwindow* w, int count, const char** paths) {
            of(w).onDrop(count, paths);
        });
        window_.startInterface();
        ui_.request.sides = options.sides;
        ui_.request.isSplit = options.isSplit;
        ui_.request.options = options.frame;
        ui_.request.camera = options.settings.experiment.camera;
        ui_.request.frame = options.firstFrame;
        ui_.request.wantsError = true;
        ui_.playedFrame = double(options.firstFrame);
        ui_.resolutionLog2 = int(options.resolutionLog2);
        takeModel();
        ui_.backend = backendName(options.settings.backend);
        ui_.fontScale = ImGui::GetIO().FontGlobalScale;
        if (!options.scene.empty())
            session_.open(options.scene, options.settings.experiment.camera, options.resolutionLog2,
                          options.assetPath);
    }

    void run() {
        touch();
        log_.write("open", {{"renderer", reinterpret_cast<const char*>(glGetString(GL_RENDERER))}});
        double last = glfwGetTime(), due = last;
        while (!glfwWindowShouldClose(window_.handle)) {
            waitUntil(due);
            checkInterrupted();
            const double now = glfwGetTime();
            step(now, std::min(now - last, 0.25));
            draw();
            countRate(now);
            last = now;
            due = std::max(due + kFrameSeconds, glfwGetTime() - kFrameSeconds);
        }
        glfwHideWindow(window_.handle); // gone for the user, whatever the worker still finishes
        glfwPollEvents();
        log_.write("closed", Json::object());
        // A scene that was named and never opened is told as every command tells it.
        if (!ui_.hasScene && !options_.scene.empty() && !ui_.statusError.empty())
            throw Error(ErrorKind::kInput, ui_.statusError);
    }

private:
    static Viewer& of(GLFWwindow* window) {
        return *static_cast<Viewer*>(glfwGetWindowUserPointer(window));
    }
    void touch() { touched_ = glfwGetTime(); }

    /// Returns whether the interface has to be drawn at its full rate.
    bool isLively(double now) const {
        return now - touched_ < kLingerSeconds || isMoving_ || ui_.isPlaying || heldKeys() ||
               !session_.isIdle();
    }
    bool heldKeys() const {
        for (const int key :
             {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E})
            if (glfwGetKey(window_.handle, key) == GLFW_PRESS)
                return true;
        return false;
    }
    /// Takes events until the next picture of the interface is due; while nothing happens, until
    /// something does.
    void waitUntil(double due) {
        glfwPollEvents();
        while (!glfwWindowShouldClose(window_.handle)) {
            const double now = glfwGetTime();
            const double wait = isLively(now) ? due - now : 0.25;
            if (wait <= 0.0)
                return;
            glfwWaitEventsTimeout(wait);
            if (!isLively(glfwGetTime()))
                return; // a slow heartbeat: interrupts are heard
        }
    }

    void onKey(int key, int action, int mods);
    void onButton(int button, int action);
    void takePress();
    void onDrop(int count, const char** paths);
    void takeModel();
    void changeThreshold(double factor);
    void takeResults();
    void fly(double seconds);
    void step(double now, double seconds);
    void showPicture();
    void draw();
    void ask(double now);
    void countRate(double now);
    bool startFlying();
    void takeFirstCamera();
    void logPicture(double now);

    const ViewWindowOptions options_;
    ViewLog log_;
    Window window_;
    ViewSession session_;
    ViewUi ui_;
    std::array<ViewTexture, 2> textures_;
    ViewTexture mapTexture_;
    ImVec2 pictureFrom_{0, 0}, pictureTo_{1, 1};
    double touched_ = 0, changed_ = -1e9; // seconds
    ImVec2 mouse_{0, 0};                  // where it was at the last event
    std::optional<ImVec2> pressed_;       // left button, since the last step: where
    std::optional<ImVec2> lookPressed_;   // right button
    bool isMoving_ = false, isSplitDragged_ = false, isLookDragged_ = false;
    bool wasAskedMoving_ = false, isPictureNew_ = false;
    uint64_t serial_ = 0;
    size_t camera_ = 0; // the scene's, by C
    double rateStart_ = 0;
    int rateCount_ = 0;
    std::map<std::string, std::array<int, 4>> loggedLayout_;
    std::string loggedError_, loggedWork_;
};

void Viewer::takeModel() {
    const std::string& model = ui_.request.sides[0].model;
    if (model.starts_with("texels:")) {
        ui_.modelKind = ModelKind::kTexels;
        ui_.threshold = parseThresholds("--model", model.substr(7))[0];
    } else if (model.starts_with("expr:")) {
        ui_.modelKind = ModelKind::kExpression;
        ui_.expression = model.substr(5);
    } else {
        ui_.modelKind = model == "cost" ? ModelKind::kCost : ModelKind::kOracle;
    }
}

void Viewer::changeThreshold(double factor) {
    if (ui_.modelKind != ModelKind::kTexels)
        return;
    const double from = std::isfinite(ui_.threshold) ? double(ui_.threshold) : 4096;
    // By a texel at least, or small thresholds would stay what they are.
    const double to =
        factor > 1 ? std::max(from * factor, from + 1) : std::min(from * factor, from - 1);
    ui_.threshold = float(std::clamp(std::round(to), 0.0, 4096.0));
    for (ViewSide& side : ui_.request.sides)
        side.model = "texels:" + numberText(double(ui_.threshold));
    ui_.hasChanged = true;
}

void Viewer::onKey(int key, int action, int mods) {
    touch();
    if (action == GLFW_RELEASE || ImGui::GetIO().WantTextInput)
        return;
    ViewRequest& r = ui_.request;
    const bool isShift = (mods & GLFW_MOD_SHIFT) != 0;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_5) {
        r.sides[isShift ? 1 : 0].method = kMethods[size_t(key - GLFW_KEY_1)];
        r.isSplit = r.isSplit || isShift;
        ui_.hasChanged = true;
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
    // The mouse may be elsewhere by the time the next step looks: what counts is where it was.
    if (action != GLFW_PRESS)
        return;
    if (button == GLFW_MOUSE_BUTTON_LEFT)
        pressed_ = mouse_;
    else if (button == GLFW_MOUSE_BUTTON_RIGHT)
        lookPressed_ = mouse_;
}

/// Carries out a press on the picture: takes the divider, or asks about a pixel.
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
        ui_.hasChanged = true;
    }
}

void Viewer::onDrop(int count, const char** paths) {
    touch();
    std::string scene, asset;
    ui_.message.clear();
    for (int i = 0; i < count; ++i) {
        const std::string path = paths[i];
        std::string extension = std::filesystem::path(path).extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return char(std::tolower(c)); });
        if (extension == ".glb" || extension == ".gltf")
            scene = path;
        else if (extension == ".svdag")
            asset = path;
        else
            ui_.message = path + ": neither a scene (.glb, .gltf) nor voxels (.svdag)";
    }
    if (!scene.empty() || !asset.empty())
        session_.open(scene, "", options_.resolutionLog2, asset);
    log_.write("drop", {{"scene", scene}, {"asset", asset}, {"message", ui_.message}});
}

/// Returns whether it flies now: not before the camera that it starts from is known.
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

/// Goes to the first view of the scene.
void Viewer::takeFirstCamera() {
    ui_.isFlying = ui_.scene.isPlaced; // no text but numbers means a camera that was found
    ui_.camera = FlyCamera(ui_.scene.camera);
    ui_.request.camera = ui_.isFlying ? ui_.camera.text() : ui_.scene.cameraText;
}

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
            ui_.backend = picture->backend; // what was asked for may not be had
            for (size_t side = 0; side < 2; ++side)
                if (!picture->sides[side].rgba.empty())
                    textures_[side].set(picture->sides[side].rgba, picture->width, picture->height);
            if (!picture->mapRgba.empty())
                mapTexture_.set(picture->mapRgba, picture->mapWidth, picture->mapHeight);
            isPictureNew_ = true;
        }
    }
    if (std::optional<SavedView> saved = session_.takeSaved()) {
        ui_.message = "saved " + saved->png + ", .exr, .experiment.json";
        ui_.hasChanged = true; // saving rendered by itself; what is kept for the view starts anew
        log_.write("saved",
                   {{"png", saved->png}, {"exr", saved->exr}, {"experiment", saved->experiment}});
    }
    const ViewStatus status = session_.status();
    ui_.statusWork = status.work;
    ui_.statusFraction = status.fraction;
    ui_.statusError = status.error;
    if (ui_.statusError != loggedError_) {
        loggedError_ = ui_.statusError;
        if (!loggedError_.empty())
            ui_.message.clear(); // what was hoped for
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

void Viewer::step(double now, double seconds) {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    takeResults();

    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float wide = kPanelWidth * ui_.fontScale;
    const float panel = ui_.showsPanel && size.x > 1.4f * wide ? wide : 0.0f;
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

void Viewer::ask(double now) {
    if (ui_.wantsBackend) {
        ui_.wantsBackend = false;
        session_.setBackend(ui_.backend);
    }
    if (ui_.wantsVoxels) {
        ui_.wantsVoxels = false;
        session_.open("", "", uint32_t(ui_.resolutionLog2), "");
    }
    if (!ui_.hasScene) {
        ui_.hasChanged = ui_.isDragged = ui_.wantsSave = ui_.wantsFreeze = false;
        return;
    }
    if (std::exchange(ui_.wantsFreeze, false) && ui_.picture) {
        // As numbers: a camera by name would move with its animation.
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
    if (ui_.hasChanged || (isResting && wasAskedMoving_)) {
        ui_.request.serial = ++serial_;
        ui_.request.askedSeconds = now;
        ui_.request.isMoving = isMoving_ || ui_.isPlaying;
        wasAskedMoving_ = ui_.request.isMoving;
        session_.ask(ui_.request);
    }
    ui_.hasChanged = ui_.isDragged = false; // callbacks set them before the next step
    if (ui_.wantsSave) {
        ui_.wantsSave = false;
        ui_.message = "saving...";
        session_.save(ui_.request, options_.saveDirectory);
    }
}

void Viewer::logPicture(double now) {
    const ViewPicture& p = *ui_.picture;
    Json line = {{"serial", p.request.serial},
                 {"width", p.width},
                 {"height", p.height},
                 {"scale", p.scale},
                 {"is_moving", p.request.isMoving},
                 {"is_final", p.isFinal},
                 {"work_ms", p.workMs},
                 {"latency_ms", 1000.0 * (now - p.request.askedSeconds)},
                 {"frame", p.request.frame},
                 {"camera", p.request.camera},
                 {"frozen", p.request.frozen},
                 {"backend", p.backend},
                 {"overlay", kOverlayNames[size_t(p.request.overlay)]},
                 {"interface_hz", ui_.interfaceFps}};
    Json sides = Json::array();
    for (size_t side = 0; side < 2; ++side) {
        const SideReport& report = p.sides[side];
        if (report.rgba.empty())
            continue;
        Json entry = {{"method", p.request.sides[side].method},
                      {"model", p.request.sides[side].model},
                      {"time_ms", report.stages.totalMs()},
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
            for (const PairAnswer& answer : pair.answers)
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
            ui_.latencyMs = 1000.0 * (shown - ui_.picture->request.askedSeconds);
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

void Viewer::countRate(double now) {
    ++rateCount_;
    if (now - rateStart_ < 1.0)
        return;
    ui_.interfaceFps = double(rateCount_) / (now - rateStart_);
    log_.write("rate", {{"interface_hz", ui_.interfaceFps}, {"is_idle", session_.isIdle()}});
    rateCount_ = 0;
    rateStart_ = now;
}

} // namespace

void runViewWindow(const ViewWindowOptions& options) {
    Viewer(options).run();
}

} // namespace shadowdag
