// SPDX-License-Identifier: Apache-2.0
// What the window draws by Dear ImGui, without a display: frames that only a test sees, and a
// window's state with everything in it.
#pragma once

#include "tools/window/view_font.h"
#include "tools/window/view_ui.h"

#include <imgui.h>

#include <array>
#include <string>

namespace shadowdag {

/// A rectangle as ViewUi::layout has it: x, y, width, height.
using Place = std::array<int, 4>;

inline bool overlap(const Place& a, const Place& b) {
    return a[0] < b[0] + b[2] && b[0] < a[0] + a[2] && a[1] < b[1] + b[3] && b[1] < a[1] + a[3];
}

/// Dear ImGui while it lives; each frame is half a second after the one before.
class Interface {
public:
    explicit Interface(float fontScale, float width = 1280, float height = 720) {
        ImGui::CreateContext();
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.DisplaySize = {width, height};
        io.DeltaTime = 0.5f;
        setFontScale(fontScale);
        unsigned char* pixels = nullptr;
        int fontWidth = 0, fontHeight = 0;
        io.Fonts->GetTexDataAsAlpha8(&pixels, &fontWidth, &fontHeight);
    }
    ~Interface() { ImGui::DestroyContext(); }
    Interface(const Interface&) = delete;
    Interface& operator=(const Interface&) = delete;

    template <class F> void frame(const F& draw) {
        ImGui::NewFrame();
        draw();
        isOnControl = ImGui::IsAnyItemHovered();
        ImGui::Render();
    }
    void moveTo(float x, float y) { ImGui::GetIO().MousePos = {x, y}; }
    void moveTo(const Place& place) {
        moveTo(float(place[0]) + 0.5f * float(place[2]), float(place[1]) + 0.5f * float(place[3]));
    }
    template <class F> void click(const Place& place, const F& draw) {
        moveTo(place);
        frame(draw); // the mouse is there
        for (const bool isDown : {true, false}) {
            ImGui::GetIO().MouseDown[0] = isDown;
            frame(draw);
        }
    }

    bool isOnControl = false; ///< whether the mouse was on something that reacts, in the last frame
};

/// Returns the state of a window that shows everything that it can.
inline ViewUi fullUi() {
    ViewUi ui;
    ui.hasScene = true;
    ui.scene.argument = "builtin:atrium";
    ui.scene.lights.resize(65);
    ui.scene.voxelResolution = 1024;
    ui.scene.frameCount = 300;
    ui.request.isSplit = true;
    ui.request.sides[1].method = "truth";
    ui.request.overlay = ViewOverlay::kVoxels; // has a level
    ui.request.pixel = glm::vec2(0.5f, 0.5f);
    ViewPicture picture;
    picture.request = ui.request;
    picture.width = 930;
    picture.height = 720;
    picture.lights = ui.scene.lights;
    for (SideReport& side : picture.sides) {
        side.rgba.resize(4);
        side.counts.pairCount = 1000;
        side.errors = ViewErrors{1000, 10, 10, 0.5};
    }
    picture.legend.title =
        "nodes and leaves read by rays to a pixel's lights, mean (also for lights that use maps)";
    picture.legend.ticks = {{0.0f, "2"}, {0.5f, "16"}, {1.0f, "256"}};
    PixelReport pixel;
    pixel.hasSample = true;
    pixel.surface = "floor, marble, triangle 12";
    pixel.pairs.resize(3);
    for (uint32_t light = 0; light < 3; ++light) {
        PixelPair& pair = pixel.pairs[light];
        pair.light = light;
        pair.servedBy = "map";
        pair.answers = {{"dag believe all", 0, 100, "cell 1 2 3, level 0"},
                        {"truth", 0, 200, "floor"}};
        pair.geometry.sampleWorld = {0, 0, -5};
        pair.geometry.lightWorld = {float(light) - 1.0f, 1, -4};
        pair.geometry.voxelWorld = Box{{-0.5f, 0.5f, -5}, {0.5f, 1, -4}};
    }
    picture.pixel = pixel;
    ui.picture = std::make_shared<const ViewPicture>(std::move(picture));
    ui.showsLights = true;
    ui.statusWork = "oracle: measure what every map costs by both methods";
    ui.statusError = "a-scene-with-a-long-name.glb: cannot be opened: Permission denied; name a "
                     "file that can be read";
    ui.message = "saved views/view-0001.png, .exr, .experiment.json; rendered again by compare "
                 "--experiment with "
                 "--backend cpu";
    return ui;
}

} // namespace shadowdag
