// SPDX-License-Identifier: Apache-2.0
// The panel: the picture's content, its settings, and its times and counts.
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"
#include "tools/settings/setting.h"
#include "tools/window/view_controls.h"
#include "tools/window/view_font.h"
#include "tools/window/view_ui.h"

#include <imgui.h>
#include <imgui_stdlib.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

/// Shows a list of names to choose from; returns whether the choice changed.
bool chooseName(const char* label, const std::vector<std::string>& names, std::string& chosen) {
    bool hasChanged = false;
    if (ImGui::BeginCombo(label, chosen.c_str())) {
        for (const std::string& name : names)
            if (ImGui::Selectable(name.c_str(), name == chosen) && name != chosen) {
                chosen = name;
                hasChanged = true;
            }
        ImGui::EndCombo();
    }
    return hasChanged;
}

bool isAboutModel(const std::string& note) {
    return note.starts_with("oracle");
}

/// Stores the position of a control, which is the last widget, and shows its tooltip when the mouse
/// has rested on it for a moment.
void control(ViewUi& ui, const std::string& name) {
    constexpr double kDelaySeconds = 0.3;
    ui.mark(name);
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled) || ImGui::IsItemActive()) {
        if (ui.hovered == name)
            ui.hovered.clear();
        return;
    }
    if (ui.hovered != name) {
        ui.hovered = name;
        ui.hoveredSeconds = ImGui::GetTime();
    }
    if (ImGui::GetTime() - ui.hoveredSeconds < kDelaySeconds)
        return;
    ui.tooltip = tooltipOf(name);
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(scaled(380));
    ImGui::TextUnformatted(ui.tooltip.c_str());
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

/// Draws a heading under which controls are shown or hidden.
bool group(ViewUi& ui, const char* name, bool isOpen = true) {
    const bool isShown = ImGui::CollapsingHeader(name, isOpen ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    ui.mark(std::string("group ") + name);
    return isShown;
}

void drawScene(ViewUi& ui) {
    if (!ui.hasScene)
        ImGui::TextWrapped(
            "No scene is open. Drop a .glb, .gltf or other scene here, or type its path.");
    if (ImGui::InputTextWithHint("open", ".glb .svdag costs.json", &ui.path,
                                 ImGuiInputTextFlags_EnterReturnsTrue))
        ui.wantsPath = true;
    control(ui, "path");
    if (!ui.hasScene)
        return;
    const ViewSceneInfo& scene = ui.scene;
    ImGui::TextWrapped("%s", scene.argument.c_str());
    ImGui::Text("%llu triangles, %zu %s", static_cast<unsigned long long>(scene.triangleCount),
                scene.lights.size(), scene.lights.size() == 1 ? "light" : "lights");
}

/// Draws what all methods work on: the voxels and the processor.
void drawMachine(ViewUi& ui) {
    const ViewSceneInfo& scene = ui.scene;
    std::vector<std::string> names;
    for (int log2 = 6; log2 <= int(scene.largestLog2); ++log2)
        names.push_back(std::to_string(1 << log2));
    std::string chosen = std::to_string(scene.voxelResolution);
    if (chooseName("voxels an axis", names, chosen)) {
        ui.resolutionLog2 = int(std::lround(std::log2(std::stod(chosen))));
        ui.wantsVoxels = true;
    }
    control(ui, "voxels");
    if (chooseName("runs on", {"cpu", "gl", "cuda"}, ui.backend))
        ui.wantsBackend = ui.hasChanged = true;
    control(ui, "backend");
}

void drawMethods(ViewUi& ui) {
    ViewRequest& r = ui.request;
    ui.hasChanged |= chooseName(r.isSplit ? "left" : "method", methodNames(), r.sides[0].method);
    control(ui, "left");
    ui.hasChanged |= ImGui::Checkbox("split (Tab)", &r.isSplit);
    control(ui, "split");
    if (r.isSplit) {
        ui.hasChanged |= chooseName("right", methodNames(), r.sides[1].method);
        control(ui, "right");
    }
    const bool isHybrid = r.sides[0].isRouted() || (r.isSplit && r.sides[1].isRouted());
    if (!isHybrid)
        return;
    const char* const kinds[] = {"texels", "cost", "oracle", "expr", ui.otherModel.c_str()};
    int kind = int(ui.modelKind);
    bool hasChanged = ImGui::Combo("model", &kind, kinds, ui.otherModel.empty() ? 4 : 5);
    control(ui, "model");
    ui.modelKind = ModelKind(kind);
    if (ui.modelKind == ModelKind::kTexels) {
        if (ImGui::SliderFloat("threshold", &ui.threshold, 0.0f, 4096.0f, "%.0f texels",
                               ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
            ui.threshold = std::round(ui.threshold);
            hasChanged = true;
        }
        control(ui, "threshold");
        ui.isDragged |= ImGui::IsItemActive();
    } else if (ui.modelKind == ModelKind::kExpression) {
        hasChanged |=
            ImGui::InputText("rays where", &ui.expression, ImGuiInputTextFlags_EnterReturnsTrue);
        control(ui, "expression");
    } else {
        ImGui::TextWrapped("%s", ui.costs.empty() ? "costs: none; type or drop the path of a file"
                                                  : ("costs of " + ui.costs).c_str());
    }
    if (ui.picture)
        for (const std::string& note : ui.picture->notes)
            if (isAboutModel(note))
                ImGui::TextWrapped("%s", note.c_str());
    if (hasChanged) {
        for (ViewSide& side : r.sides)
            side.model = modelText(ui);
        ui.hasChanged = true;
    }
}

void drawTime(ViewUi& ui) {
    if (!ui.scene.isAnimated())
        return;
    if (ImGui::Button(ui.isPlaying ? "pause" : "play "))
        ui.isPlaying = !ui.isPlaying;
    control(ui, "play");
    ImGui::SameLine();
    const int last = int(ui.scene.frameCount) - 1;
    int frame = int(ui.request.frame);
    ImGui::SetNextItemWidth(-scaled(60));
    if (ImGui::SliderInt("frame", &frame, 0, last)) {
        ui.request.frame = uint32_t(std::clamp(frame, 0, last));
        ui.playedFrame = double(ui.request.frame);
        ui.hasChanged = true;
    }
    ui.isDragged |= ImGui::IsItemActive();
    control(ui, "frame");
}

void drawOverlayChoice(ViewUi& ui) {
    ViewRequest& r = ui.request;
    int overlay = int(r.overlay);
    if (ImGui::Combo("show (O)", &overlay, kOverlayNames.data(), int(kOverlayNames.size()))) {
        r.overlay = ViewOverlay(overlay);
        ui.hasChanged = true;
    }
    control(ui, "overlay");
    if (r.overlay == ViewOverlay::kVoxels) {
        int level = int(r.voxelLevel);
        const int top = std::max(1, int(std::bit_width(ui.scene.voxelResolution)) - 1);
        if (ImGui::SliderInt("level", &level, 0, top)) {
            r.voxelLevel = uint32_t(std::clamp(level, 0, top));
            ui.hasChanged = true;
        }
        ui.isDragged |= ImGui::IsItemActive();
        control(ui, "level");
    }
    int light = r.light;
    if (ImGui::SliderInt("light", &light, -1, std::max(0, int(ui.scene.lights.size()) - 1),
                         light < 0 ? "any" : "%d")) {
        r.light = std::clamp(light, -1, int(ui.scene.lights.size()) - 1);
        ui.hasChanged = true;
    }
    ui.isDragged |= ImGui::IsItemActive();
    control(ui, "light");
    ImGui::Checkbox("lights and ranges (L)", &ui.showsLights);
    control(ui, "lights");
    bool isFrozen = !r.frozen.empty();
    if (ImGui::Checkbox("freeze the observer (F)", &isFrozen)) {
        ui.wantsFreeze = true;
    }
    control(ui, "freeze");
    ui.hasChanged |= ImGui::Checkbox("compute the truth at rest", &r.wantsError);
    control(ui, "truth");
    ui.hasChanged |= ImGui::SliderFloat("exposure", &r.exposureStops, -6.0f, 6.0f, "%+.1f stops");
    ui.isDragged |= ImGui::IsItemActive();
    control(ui, "exposure");
}

/// Draws the unfolded map of the chosen light, under a heading.
void drawMap(ViewUi& ui, float width, unsigned mapTexture) {
    const bool showsMap = ImGui::TreeNode("map of the light");
    ui.hasChanged |= showsMap && !ui.request.wantsMap;
    ui.request.wantsMap = showsMap;
    ui.mark("map");
    if (!showsMap)
        return;
    ImGui::TreePop(); // no indent: it is as wide as the panel
    if (!ui.picture || ui.picture->mapWidth == 0) {
        ImGui::TextUnformatted("no map of that light is drawn");
        return;
    }
    const float wide = width - scaled(30);
    const float high = wide * float(ui.picture->mapHeight) / float(ui.picture->mapWidth);
    ImGui::Image(reinterpret_cast<ImTextureID>(uintptr_t(mapTexture)), {wide, high});
    ImGui::TextWrapped("%s", ui.picture->mapTitle.c_str());
}

/// Draws a control for every setting that offers choices.
void drawOptions(ViewUi& ui) {
    FrameOptions& options = ui.request.options;
    const uint32_t deviceSide = ui.picture ? ui.picture->devicePageTexels : 0;
    for (const Setting* setting : frameSettings()) {
        if (setting->choices.empty())
            continue;
        std::string chosen = setting->frameText(options);
        // Sparse textures have pages of the device's size.
        const bool isFixed = setting->key == "page_size" && deviceSide > 0;
        if (isFixed)
            chosen = std::to_string(deviceSide);
        ImGui::BeginDisabled(isFixed);
        if (chooseName(setting->panelLabel.c_str(), setting->choices, chosen)) {
            setting->setFrame(options, setting->option, chosen);
            ui.hasChanged = true;
        }
        ImGui::EndDisabled();
        control(ui, setting->panelLabel);
    }
    ui.hasChanged |=
        ImGui::Checkbox("keep maps of static geometry", &options.maps.useStaticOptimization);
    control(ui, "static");
}

void drawNumbers(const ViewUi& ui) {
    if (!ui.picture)
        return;
    const ViewPicture& p = *ui.picture;
    ImGui::Text("%u x %u, scale %.3g%s", p.width, p.height, double(p.scale),
                p.isFinal           ? ""
                : p.mapScale < 1.0f ? ", finer maps to come"
                                    : ", more to come");
    ImGui::Text("interface %.0f Hz", ui.interfaceFps);
    if (ui.latencyMs > 0) {
        ImGui::SameLine(0, 0);
        ImGui::Text(", last move to picture %.0f ms", ui.latencyMs);
    }
    for (size_t side = 0; side < 2; ++side) {
        const SideReport& report = p.sides[side];
        if (report.rgba.empty())
            continue;
        ImGui::Separator();
        ImGui::Text("%s  %.1f ms", p.request.sides[side].method.c_str(), report.stages.totalMs());
        const FrameCounts& c = report.counts;
        if (c.pairCount > 0) {
            ImGui::Text("%.2f M pairs: %.2f rays, %.2f lookups", double(c.pairCount) * 1e-6,
                        double(c.rayCount) * 1e-6, double(c.lookupCount) * 1e-6);
            ImGui::Text("%u maps drawn, %llu pages, %s", c.drawnMapCount,
                        static_cast<unsigned long long>(c.maps.pageCount),
                        bytesText(double(c.maps.mapBytes)).c_str());
        }
        if (report.errors && report.errors->pairCount > 0) {
            const double n = double(report.errors->pairCount);
            ImGui::Text("false shadow %.3f %%, light %.3f %%",
                        100.0 * double(report.errors->falseShadowCount) / n,
                        100.0 * double(report.errors->falseLightCount) / n);
            if (report.errors->doneShare < 1.0)
                ImGui::Text("of the first %.0f %% of samples", 100.0 * report.errors->doneShare);
        }
    }
    ImGui::Text("voxels %s", bytesText(double(ui.scene.voxelBytes)).c_str());
    for (const std::vector<std::string>* notes : {&p.notes, &ui.notes})
        for (const std::string& note : *notes)
            if (!isAboutModel(note))
                ImGui::TextWrapped("%s", note.c_str());
}

} // namespace

void ViewUi::mark(const std::string& name) {
    const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
    layout[name] = {int(from.x), int(from.y), int(to.x - from.x), int(to.y - from.y)};
}

void drawPanel(ViewUi& ui, float width, float height, unsigned mapTexture) {
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({width, height});
    ImGui::Begin("ShadowDAG", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::PushItemWidth(width * 0.5f);
    ImGui::PushAllowKeyboardFocus(false); // The window uses the Tab key
    ui.tooltip.clear();
    drawScene(ui);
    if (ui.hasScene) {
        if (group(ui, "see")) {
            drawTime(ui);
            drawOverlayChoice(ui);
            drawMap(ui, width, mapTexture);
            if (ImGui::Button("save (F12)"))
                ui.wantsSave = true;
            control(ui, "save");
        }
        if (group(ui, "method")) {
            drawMethods(ui);
            drawMachine(ui);
            const bool showsSettings = ImGui::TreeNode("settings of rays and maps");
            ui.mark("maps");
            if (showsSettings) {
                drawOptions(ui);
                ImGui::TreePop();
            }
        }
        if (group(ui, "numbers")) {
            drawNumbers(ui);
            ui.showsGraphs = ImGui::TreeNodeEx("graphs", ImGuiTreeNodeFlags_DefaultOpen);
            ui.mark("graphs");
            if (ui.showsGraphs) {
                ImGui::TreePop(); // no indent: they are as wide as the panel
                drawGraphs(ui, width - scaled(30), scaled(76));
            }
        }
        if (group(ui, "keys", false))
            ImGui::TextUnformatted("W A S D, Q E    fly, Shift: faster\n"
                                   "right drag      look\n"
                                   "wheel           speed\n"
                                   "left click      a pixel's pairs; Esc: none\n"
                                   "Space , .       play, step\n"
                                   "1 to 5          method; Shift: of the right\n"
                                   "[ ]             threshold\n"
                                   "Tab O L F       split, show, lights, freeze\n"
                                   "C Home          next camera, first view\n"
                                   "Ctrl + - 0      size of the text\n"
                                   "F1 F12          panel, save");
    }
    ImGui::PopAllowKeyboardFocus();
    ImGui::PopItemWidth();
    ImGui::End();
}

} // namespace shadowdag
