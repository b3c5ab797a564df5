// SPDX-License-Identifier: Apache-2.0
// Draws over the picture: the split, names, lights, the legend, a pixel's pairs, messages.
#include "tools/window/view_observer.h"
#include "tools/window/view_overlay.h"
#include "tools/window/view_ui.h"
#include "tools/workspace/error_image.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

/// Text on a dark ground, readable over any picture. Returns its size with the ground.
ImVec2 label(const ImVec2& at, const std::string& text, ImU32 color = IM_COL32_WHITE) {
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    const float room = std::max(ImGui::GetIO().DisplaySize.x - at.x - 12, 80.0f);
    const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, room);
    list->AddRectFilled({at.x - 4, at.y - 2}, {at.x + size.x + 4, at.y + size.y + 2},
                        IM_COL32(0, 0, 0, 170), 3);
    list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), at, color, text.c_str(), nullptr, room);
    return {size.x + 8, size.y + 4};
}

std::string nameOf(const ViewPicture& p, size_t side) {
    const ViewSide& s = p.request.sides[side];
    char text[320];
    std::snprintf(text, sizeof text, "%s%s%s  %.1f ms", s.method.c_str(), s.isRouted() ? " " : "",
                  s.isRouted() ? s.model.c_str() : "", p.sides[side].stages.totalMs());
    return text;
}

/// Draws a directional light as an arrow, whose length away from the viewer is not visible, and, if
/// the camera looks towards the light, the light itself.
void drawDirectionalLight(const ViewPicture& p, const Light& light, const ImVec2& start,
                          const ImVec2& from, const ImVec2& to, const glm::vec3& color) {
    const ViewRays view = makeViewRays(p.camera, p.width, p.height);
    const glm::vec3 way = light.directionWorld;
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    constexpr float kLength = 46, kHead = 9;
    const glm::vec2 along(glm::dot(way, p.camera.right()), -glm::dot(way, p.camera.up));
    const float length = std::max(glm::length(along), 1e-3f);
    const glm::vec2 unit = along / length, side(-unit.y, unit.x);
    const glm::vec2 tail(start.x, start.y), tip = tail + along * kLength;
    const auto line = [&](const glm::vec2& a, const glm::vec2& b) {
        list->AddLine({a.x, a.y}, {b.x, b.y}, IM_COL32(0, 0, 0, 255), 5);
        list->AddLine({a.x, a.y}, {b.x, b.y}, packedColor(color), 2.5f);
    };
    line(tail, tip);
    const float head = std::min(kHead, kLength * length);
    line(tip, tip - (unit + 0.6f * side) * head);
    line(tip, tip - (unit - 0.6f * side) * head);
    // A ring at its tail, with a dot in it if the light comes towards the viewer.
    list->AddCircle(start, 6, IM_COL32(0, 0, 0, 255), 0, 4);
    list->AddCircle(start, 6, packedColor(color), 0, 2);
    if (glm::dot(way, p.camera.forward) < 0)
        list->AddCircleFilled(start, 3, packedColor(color));
    const glm::dvec3 far = view.origin - glm::dvec3(way) * 1e6;
    const glm::dvec3 pixel = pixelOfPoint(view, far);
    if (pixel.z <= view.znear)
        return;
    const double toScreen = double(to.x - from.x) / double(p.width);
    const ImVec2 at{float(from.x + (pixel.x + 0.5) * toScreen),
                    float(from.y + (pixel.y + 0.5) * toScreen)};
    list->AddCircle(at, 14, IM_COL32(0, 0, 0, 255), 0, 4);
    list->AddCircle(at, 14, packedColor(color), 0, 2);
    list->AddCircleFilled(at, 4, packedColor(color));
}

void drawLights(const ViewPicture& p, const ViewUi& ui, const ImVec2& from, const ImVec2& to) {
    const ViewRays view = makeViewRays(p.camera, p.width, p.height);
    const double toScreen = double(to.x - from.x) / double(p.width);
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    list->PushClipRect(from, to, true);
    std::vector<uint8_t> by(p.lights.size(), 0); // bit 0: rays, 1: maps
    for (const MapRecord& map : p.sides[0].maps)
        if (map.quantities.light < by.size())
            by[map.quantities.light] |= map.route == Route::kRays ? 1 : 2;
    float sunX = to.x - 70;
    for (size_t i = 0; i < p.lights.size(); ++i) {
        const Light& light = p.lights[i];
        const glm::dvec3 d = glm::dvec3(light.positionWorld) - view.origin;
        const glm::dvec3 pixel = pixelOfPoint(view, glm::dvec3(light.positionWorld));
        if (light.kind != Light::kSun && pixel.z <= view.znear)
            continue;
        const bool isChosen = int(i) == ui.request.light;
        const glm::vec3 color = by[i] == 1   ? kSkyBlue
                                : by[i] == 2 ? kOrange
                                : by[i] == 3 ? glm::vec3(0.9f)
                                             : glm::vec3(0.45f);
        if (light.kind == Light::kSun) {
            drawDirectionalLight(p, light, {sunX, from.y + 90}, from, to, color);
            sunX -= 120;
            continue;
        }
        const ImVec2 at{float(from.x + (pixel.x + 0.5) * toScreen),
                        float(from.y + (pixel.y + 0.5) * toScreen)};
        list->AddCircleFilled(at, isChosen ? 6.0f : 4.0f, packedColor(color));
        list->AddCircle(at, isChosen ? 7.0f : 5.0f, IM_COL32(0, 0, 0, 255));
        // The outline of the sphere, if the camera is outside of it.
        const double distance = glm::length(d), range = double(light.rangeWorld);
        if (distance > range) {
            const double radius =
                range / std::sqrt(distance * distance - range * range) / view.pixelSize * toScreen;
            list->AddCircle(at, float(radius), packedColor(color, isChosen ? 1.0f : 0.35f), 0,
                            isChosen ? 2.5f : 1.0f);
        }
    }
    list->PopClipRect();
    label({from.x + 8, to.y - 24},
          "lights: sky blue by rays, orange by maps, white by both, grey by neither; arrows: "
          "direction of directional lights");
}

void drawLegend(const ViewLegend& legend, const ImVec2& from, const ImVec2& to) {
    if (legend.title.empty())
        return;
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    const float top = to.y - (legend.ticks.empty() && legend.swatches.empty() ? 24.0f : 62.0f);
    const float left = std::max(from.x + 8, to.x - 470);
    list->AddRectFilled({left - 6, top - 4}, {to.x - 4, to.y - 2}, IM_COL32(0, 0, 0, 190), 3);
    list->AddText({left, top}, IM_COL32_WHITE, legend.title.c_str());
    float x = left;
    for (const auto& [color, name] : legend.swatches) {
        list->AddRectFilled({x, top + 22}, {x + 12, top + 34}, packedColor(color));
        list->AddText({x + 17, top + 21}, IM_COL32_WHITE, name.c_str());
        x += 40 + ImGui::CalcTextSize(name.c_str()).x;
    }
    if (legend.ticks.empty())
        return;
    const float width = 420;
    constexpr int kSteps = 64;
    for (int i = 0; i < kSteps; ++i)
        list->AddRectFilled({left + width * float(i) / kSteps, top + 18},
                            {left + width * float(i + 1) / kSteps, top + 32},
                            packedColor(rampColor((float(i) + 0.5f) / kSteps)));
    for (const auto& [at, text] : legend.ticks) {
        const float tick = left + width * at;
        list->AddLine({tick, top + 32}, {tick, top + 37}, IM_COL32_WHITE);
        const float half = 0.5f * ImGui::CalcTextSize(text.c_str()).x;
        list->AddText({std::max(left, tick - half), top + 39}, IM_COL32_WHITE, text.c_str());
    }
}

void drawPixel(ViewUi& ui, const PixelReport& pixel, const ImVec2& from, const ImVec2& to) {
    ImGui::SetNextWindowPos({from.x + 10, from.y + 34}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({std::min(620.0f, to.x - from.x - 20), 320}, ImGuiCond_FirstUseEver);
    bool isOpen = true;
    ImGui::Begin("pixel", &isOpen);
    ui.layout["pixel window"] = {int(ImGui::GetWindowPos().x), int(ImGui::GetWindowPos().y),
                                 int(ImGui::GetWindowSize().x), int(ImGui::GetWindowSize().y)};
    ImGui::Text("pixel %u, %u", pixel.x, pixel.y);
    if (!pixel.hasSample) {
        ImGui::TextUnformatted("background: no surface at this pixel");
    } else {
        ImGui::TextWrapped("%s", pixel.surface.c_str());
        ImGui::Text("at %.4g %.4g %.4g m, cluster %u, %zu pairs", double(pixel.positionWorld.x),
                    double(pixel.positionWorld.y), double(pixel.positionWorld.z), pixel.cluster,
                    pixel.pairs.size());
        if (ImGui::BeginTable("pairs", 6,
                              ImGuiTableFlags_BordersInnerV | ImGuiTableFlags_RowBg |
                                  ImGuiTableFlags_ScrollY | ImGuiTableFlags_Resizable |
                                  ImGuiTableFlags_SizingFixedFit)) {
            for (const char* name : {"light", "served by", "method", "seen", "ns"})
                ImGui::TableSetupColumn(name);
            ImGui::TableSetupColumn("blocker", ImGuiTableColumnFlags_WidthStretch);
            ImGui::TableHeadersRow();
            for (const PixelPair& pair : pixel.pairs)
                for (size_t i = 0; i < pair.answers.size(); ++i) {
                    const PairResult& answer = pair.answers[i];
                    ImGui::TableNextRow();
                    ImGui::TableNextColumn();
                    if (i == 0)
                        ImGui::Text("%u at %.3g m", pair.light, double(pair.distanceWorld));
                    else if (i == 1)
                        ImGui::Text("n.l %.2f", double(pair.cosine));
                    ImGui::TableNextColumn();
                    if (i == 0)
                        ImGui::Text("%s", pair.servedBy.c_str());
                    else if (i == 1 && pair.faceTexels > 0)
                        ImGui::Text("requested %.0f, allocated %u", double(pair.requestedTexels),
                                    pair.faceTexels);
                    ImGui::TableNextColumn();
                    ImGui::TextUnformatted(answer.method.c_str());
                    ImGui::TableNextColumn();
                    if (answer.visibility >= 0)
                        ImGui::Text("%.0f %%", double(answer.visibility) / 2.55);
                    ImGui::TableNextColumn();
                    if (answer.visibility >= 0)
                        ImGui::Text("%.0f", answer.nanoseconds);
                    ImGui::TableNextColumn();
                    ImGui::TextUnformatted(answer.blocker.c_str());
                }
            ImGui::EndTable();
        }
    }
    ImGui::End();
    if (!isOpen) {
        ui.request.pixel.reset();
        ui.hasChanged = true;
    }
}

} // namespace

void drawOverPicture(ViewUi& ui, const ImVec2& from, const ImVec2& to) {
    const float width = to.x - from.x;
    float y = from.y + 8;
    if (ui.picture) {
        const ViewPicture& p = *ui.picture;
        if (ui.showsLights)
            drawLights(p, ui, from, to);
        drawLegend(p.legend, from, to);
        if (!p.sides[0].rgba.empty())
            y += label({from.x + 8, y}, nameOf(p, 0)).y + 4;
        if (ui.request.isSplit && !p.sides[1].rgba.empty()) {
            const float x = std::round(from.x + width * ui.request.split);
            ImDrawList* const list = ImGui::GetBackgroundDrawList();
            list->AddRectFilled({x - 1, from.y}, {x + 2, to.y}, IM_COL32(0, 0, 0, 255));
            list->AddRectFilled({x, from.y}, {x + 1, to.y}, IM_COL32(255, 255, 255, 255));
            const std::string name = nameOf(p, 1);
            label({to.x - ImGui::CalcTextSize(name.c_str()).x - 12, from.y + 8}, name);
        }
        if (p.pixel && p.request.pixel == ui.request.pixel)
            ui.pixel = std::make_shared<const PixelReport>(*p.pixel);
        if (ui.pixel && ui.request.pixel)
            drawPixel(ui, *ui.pixel, from, to);
        if (ui.request.pixel) {
            const ImVec2 at{from.x + width * ui.request.pixel->x,
                            from.y + (to.y - from.y) * ui.request.pixel->y};
            ImDrawList* const list = ImGui::GetBackgroundDrawList();
            list->AddCircle(at, 6, IM_COL32(0, 0, 0, 255), 0, 3);
            list->AddCircle(at, 6, IM_COL32(255, 255, 255, 255), 0, 1);
        }
    }
    if (!ui.request.frozen.empty())
        y += label({from.x + 8, y}, "frozen: shows the frame of the camera at which F was pressed")
                 .y +
             4;
    if (!ui.statusWork.empty()) {
        char text[320];
        if (ui.statusFraction < 0)
            std::snprintf(text, sizeof text, "%s", ui.statusWork.c_str());
        else
            std::snprintf(text, sizeof text, "%s  %.0f %%", ui.statusWork.c_str(),
                          100.0 * ui.statusFraction);
        y += label({from.x + 8, y}, text).y + 4;
    }
    if (!ui.statusError.empty())
        y += label({from.x + 8, y}, ui.statusError, IM_COL32(255, 140, 110, 255)).y + 4;
    if (!ui.message.empty())
        label({from.x + 8, y}, ui.message);
}

} // namespace shadowdag
