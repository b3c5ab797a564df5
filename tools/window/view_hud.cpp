// SPDX-License-Identifier: Apache-2.0
// Draws over the picture: the split, names, lights, legends, a pixel's pairs, the demo's caption,
// messages. Texts are stacked from the picture's top and bottom, so that none covers another.
#include "tools/window/view_font.h"
#include "tools/window/view_observer.h"
#include "tools/window/view_overlay.h"
#include "tools/window/view_pair.h"
#include "tools/window/view_ui.h"
#include "tools/workspace/error_image.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

constexpr ImU32 kErrorColor = IM_COL32(255, 140, 110, 255);
constexpr float kBorder = 4; // of the ground around a text, scaled

/// The part of the picture in which nothing is written yet.
struct FreeSpace {
    ViewUi& ui;
    ImVec2 from, to;

    float width() const { return std::max(to.x - from.x - scaled(16), scaled(80)); }

    /// Draws a dark ground, on which any text is readable, and stores its place under a name.
    void ground(const char* name, const ImVec2& at, const ImVec2& size) const {
        const float border = scaled(kBorder);
        const ImVec2 low{at.x - border, at.y - border};
        const ImVec2 high{at.x + size.x + border, at.y + size.y + border};
        ImGui::GetForegroundDrawList()->AddRectFilled(low, high, IM_COL32(0, 0, 0, 190), scaled(3));
        ui.layout[name] = {int(low.x), int(low.y), int(high.x - low.x), int(high.y - low.y)};
    }
    /// Takes a line of that height at the top or at the bottom; returns where it begins.
    float takeTop(float height) {
        const float y = from.y + scaled(8);
        from.y = y + height + scaled(kBorder);
        return y;
    }
    float takeBottom(float height) {
        const float y = to.y - scaled(8) - height;
        to.y = y - scaled(kBorder);
        return y;
    }
    void text(const char* name, const ImVec2& at, const std::string& text, ImU32 color,
              const ImVec2& size) const {
        ground(name, at, size);
        ImGui::GetForegroundDrawList()->AddText(ImGui::GetFont(), ImGui::GetFontSize(), at, color,
                                                text.c_str(), nullptr, width());
    }
    ImVec2 sizeOf(const std::string& text) const {
        return ImGui::CalcTextSize(text.c_str(), nullptr, false, width());
    }
    void textAtTop(const char* name, const std::string& words, ImU32 color = IM_COL32_WHITE) {
        const ImVec2 size = sizeOf(words);
        text(name, {from.x + scaled(8), takeTop(size.y)}, words, color, size);
    }
    void textAtBottom(const char* name, const std::string& words, ImU32 color = IM_COL32_WHITE) {
        const ImVec2 size = sizeOf(words);
        text(name, {from.x + scaled(8), takeBottom(size.y)}, words, color, size);
    }
};

/// Returns where a pixel of a picture is on the screen.
struct OnScreen {
    OnScreen(const ViewPicture& p, const ImVec2& from, const ImVec2& to)
        : from(from), perPixel(double(to.x - from.x) / double(p.width)) {}
    ImVec2 operator()(const glm::dvec2& pixel) const {
        return {float(from.x + (pixel.x + 0.5) * perPixel),
                float(from.y + (pixel.y + 0.5) * perPixel)};
    }
    ImVec2 from;
    double perPixel;
};

/// Returns the light whose pair is drawn: chosen in the list of pairs, else in the panel; -1: any.
int lightOfPair(const ViewUi& ui) {
    return ui.pixelLight >= 0 ? ui.pixelLight : ui.request.light;
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
    const float reach = scaled(46), headReach = scaled(9);
    const glm::vec2 along(glm::dot(way, p.camera.right()), -glm::dot(way, p.camera.up));
    const float length = std::max(glm::length(along), 1e-3f);
    const glm::vec2 unit = along / length, side(-unit.y, unit.x);
    const glm::vec2 tail(start.x, start.y), tip = tail + along * reach;
    const auto line = [&](const glm::vec2& a, const glm::vec2& b) {
        list->AddLine({a.x, a.y}, {b.x, b.y}, IM_COL32(0, 0, 0, 255), 5);
        list->AddLine({a.x, a.y}, {b.x, b.y}, packedColor(color), 2.5f);
    };
    line(tail, tip);
    const float head = std::min(headReach, reach * length);
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
    const ImVec2 at = OnScreen(p, from, to)(glm::dvec2(pixel));
    list->AddCircle(at, 14, IM_COL32(0, 0, 0, 255), 0, 4);
    list->AddCircle(at, 14, packedColor(color), 0, 2);
    list->AddCircleFilled(at, 4, packedColor(color));
}

void drawLights(const ViewPicture& p, const ViewUi& ui, const ImVec2& from, const ImVec2& to) {
    const ViewRays view = makeViewRays(p.camera, p.width, p.height);
    const OnScreen onScreen(p, from, to);
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    list->PushClipRect(from, to, true);
    std::vector<uint8_t> by(p.lights.size(), 0); // bit 0: rays, 1: maps
    for (const MapRecord& map : p.sides[0].maps)
        if (map.quantities.light < by.size())
            by[map.quantities.light] |= map.route == Route::kRays ? 1 : 2;
    float sunX = to.x - scaled(70);
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
            drawDirectionalLight(p, light, {sunX, from.y + scaled(90)}, from, to, color);
            sunX -= scaled(120);
            continue;
        }
        const ImVec2 at = onScreen(glm::dvec2(pixel));
        list->AddCircleFilled(at, isChosen ? 6.0f : 4.0f, packedColor(color));
        list->AddCircle(at, isChosen ? 7.0f : 5.0f, IM_COL32(0, 0, 0, 255));
        // The outline of the sphere, if the camera is outside of it.
        const double distance = glm::length(d), range = double(light.rangeWorld);
        if (distance > range) {
            const double radius = range / std::sqrt(distance * distance - range * range) /
                                  view.pixelSize * onScreen.perPixel;
            list->AddCircle(at, float(radius), packedColor(color, isChosen ? 1.0f : 0.35f), 0,
                            isChosen ? 2.5f : 1.0f);
        }
    }
    list->PopClipRect();
}

void drawLegend(const ViewLegend& legend, FreeSpace& space) {
    if (legend.title.empty())
        return;
    const ImVec2 title = space.sizeOf(legend.title);
    const float line = ImGui::GetTextLineHeight(), gap = scaled(4);
    const float scale = std::min(scaled(420), space.width());
    float swatches = 0;
    for (const auto& [color, name] : legend.swatches)
        swatches += scaled(40) + ImGui::CalcTextSize(name.c_str()).x;
    ImVec2 size{std::max(title.x, swatches), title.y};
    if (!legend.swatches.empty())
        size.y += gap + line;
    if (!legend.ticks.empty())
        size = {std::max(size.x, scale), size.y + 3 * gap + 2 * line};
    const ImVec2 at{space.to.x - scaled(8) - size.x, space.takeBottom(size.y)};
    space.text("legend", at, legend.title, IM_COL32_WHITE, size);
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    float x = at.x, y = at.y + title.y + gap;
    for (const auto& [color, name] : legend.swatches) {
        list->AddRectFilled({x, y}, {x + scaled(12), y + line}, packedColor(color));
        list->AddText({x + scaled(17), y}, IM_COL32_WHITE, name.c_str());
        x += scaled(40) + ImGui::CalcTextSize(name.c_str()).x;
    }
    if (legend.ticks.empty())
        return;
    constexpr int kSteps = 64;
    for (int i = 0; i < kSteps; ++i)
        list->AddRectFilled({at.x + scale * float(i) / kSteps, y},
                            {at.x + scale * float(i + 1) / kSteps, y + line},
                            packedColor(rampColor((float(i) + 0.5f) / kSteps)));
    y += line;
    for (const auto& [position, text] : legend.ticks) {
        const float tick = at.x + scale * position;
        list->AddLine({tick, y}, {tick, y + gap}, IM_COL32_WHITE);
        const float wide = ImGui::CalcTextSize(text.c_str()).x;
        list->AddText({std::clamp(tick - wide / 2, at.x, at.x + size.x - wide), y + gap},
                      IM_COL32_WHITE, text.c_str());
    }
}

/// Draws one of the selected pixel's pairs into the picture, and its legend.
void drawPair(const ViewPicture& p, const PixelReport& pixel, int light, FreeSpace& space,
              const ImVec2& from, const ImVec2& to) {
    const int index = drawnPair(pixel, light);
    if (index < 0)
        return;
    const PixelPair& pair = pixel.pairs[size_t(index)];
    const OnScreen onScreen(p, from, to);
    ImDrawList* const list = ImGui::GetBackgroundDrawList();
    list->PushClipRect(from, to, true);
    for (const PairLine& line :
         pairLines(makeViewRays(p.camera, p.width, p.height), pair.geometry)) {
        const PairPartStyle& style = kPairParts[size_t(line.part)];
        const ImVec2 a = onScreen(line.from), b = onScreen(line.to);
        list->AddLine(a, b, packedColor(style.casing), scaled(5));
        list->AddLine(a, b, packedColor(style.color), scaled(3));
    }
    list->PopClipRect();
    // The names of the parts, after a piece of each line.
    const std::string title = "light " + std::to_string(pair.light) + ":";
    const float piece = scaled(24), gap = scaled(6), line = ImGui::GetTextLineHeight();
    std::array<std::string, kPairParts.size()> names;
    float wide = ImGui::CalcTextSize(title.c_str()).x;
    const PairGeometry& parts = pair.geometry;
    const std::array<bool, kPairParts.size()> isThere{parts.triangleWorld.has_value(),
                                                      parts.voxelWorld.has_value(),
                                                      parts.texelWorld.has_value(), true};
    for (size_t i = 0; i < kPairParts.size(); ++i) {
        names[i] = std::string(isThere[i] ? "" : "no ") + kPairParts[i].name;
        wide += 3 * gap + piece + ImGui::CalcTextSize(names[i].c_str()).x;
    }
    const ImVec2 at{from.x + scaled(8), space.takeBottom(line)};
    ImDrawList* const above = ImGui::GetForegroundDrawList();
    space.ground("pair legend", at, {wide, line});
    above->AddText(at, IM_COL32_WHITE, title.c_str());
    float x = at.x + ImGui::CalcTextSize(title.c_str()).x;
    for (size_t i = kPairParts.size(); i-- > 0;) {
        x += 2 * gap;
        const float y = at.y + line / 2;
        if (isThere[i]) {
            above->AddLine({x, y}, {x + piece, y}, packedColor(kPairParts[i].casing), scaled(5));
            above->AddLine({x, y}, {x + piece, y}, packedColor(kPairParts[i].color), scaled(3));
        }
        x += piece + gap;
        above->AddText({x, at.y}, isThere[i] ? IM_COL32_WHITE : IM_COL32(160, 160, 160, 255),
                       names[i].c_str());
        x += ImGui::CalcTextSize(names[i].c_str()).x;
    }
}

/// Draws the demo's caption of the picture that is shown.
void drawCaption(const DemoMoment& moment, size_t shown, FreeSpace& space) {
    const DemoCaption& caption = kDemoCaptions[shown];
    const float wide = std::min(scaled(760), space.width()), gap = scaled(10);
    pushTitleFont();
    const ImVec2 title = ImGui::CalcTextSize(caption.title, nullptr, false, wide);
    ImGui::PopFont();
    pushCaptionFont();
    const ImVec2 text = ImGui::CalcTextSize(caption.text, nullptr, false, wide);
    ImGui::PopFont();
    const std::string hint = std::to_string(shown + 1) + " of " +
                             std::to_string(kDemoCaptionCount) + "   any key or click: take over";
    const float line = ImGui::GetTextLineHeight();
    const ImVec2 size{wide, title.y + text.y + line + 2 * gap};
    const ImVec2 at{(space.from.x + space.to.x - wide) / 2, space.takeBottom(size.y)};
    space.ground("caption", at, size);
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    const auto write = [&](float y, const char* words) {
        list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {at.x, y}, IM_COL32_WHITE, words,
                      nullptr, wide);
    };
    pushTitleFont();
    write(at.y, caption.title);
    ImGui::PopFont();
    pushCaptionFont();
    write(at.y + title.y + gap, caption.text);
    ImGui::PopFont();
    const float y = at.y + size.y - line;
    list->AddText({at.x, y}, IM_COL32(190, 190, 190, 255), hint.c_str());
    // How much of the caption's time is over.
    const float begin = at.x + ImGui::CalcTextSize(hint.c_str()).x + 2 * gap, end = at.x + wide;
    const float middle = y + line / 2;
    list->AddLine({begin, middle}, {end, middle}, IM_COL32(90, 90, 90, 255), scaled(2));
    list->AddLine({begin, middle}, {begin + (end - begin) * float(moment.share), middle},
                  packedColor(kOrange), scaled(2));
}

void drawPixel(ViewUi& ui, const PixelReport& pixel, const FreeSpace& space) {
    const float left = space.from.x + scaled(10), top = space.from.y + scaled(8);
    ImGui::SetNextWindowPos({left, top}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({std::min(scaled(620), space.to.x - left - scaled(10)),
                              std::min(scaled(320), 0.55f * (space.to.y - top))},
                             ImGuiCond_FirstUseEver);
    bool isOpen = true;
    ImGui::Begin("pixel", &isOpen);
    ui.layout["pixel window"] = {int(ImGui::GetWindowPos().x), int(ImGui::GetWindowPos().y),
                                 int(ImGui::GetWindowSize().x), int(ImGui::GetWindowSize().y)};
    ImGui::Text("pixel %u, %u", pixel.x, pixel.y);
    if (!pixel.hasSample) {
        ImGui::TextUnformatted("background: no surface at this pixel");
    } else {
        ImGui::TextWrapped("%s", pixel.surface.c_str());
        ImGui::Text("at %.4g %.4g %.4g m, cluster %u, %zu %s", double(pixel.positionWorld.x),
                    double(pixel.positionWorld.y), double(pixel.positionWorld.z), pixel.cluster,
                    pixel.pairs.size(), pixel.pairs.size() == 1 ? "pair" : "pairs");
        ImGui::TextUnformatted("Click a light to draw its ray and what blocks it.");
        const int drawn = drawnPair(pixel, lightOfPair(ui));
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
                    if (i == 0) {
                        char text[64];
                        std::snprintf(text, sizeof text, "%u at %.3g m", pair.light,
                                      double(pair.distanceWorld));
                        if (ImGui::Selectable(text, &pair == &pixel.pairs[size_t(drawn)],
                                              ImGuiSelectableFlags_SpanAllColumns))
                            ui.pixelLight = int(pair.light);
                        ui.mark("pair " + std::to_string(pair.light));
                    } else if (i == 1)
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
    for (const char* name : {"legend", "lights legend", "pair legend", "caption", "pixel window",
                             "left name", "right name", "frozen", "work", "error", "message"})
        ui.layout.erase(name);
    const float width = to.x - from.x;
    FreeSpace space{ui, from, to};
    ImDrawList* const list = ImGui::GetBackgroundDrawList();
    if (ui.picture) {
        const ViewPicture& p = *ui.picture;
        const bool hasRight = ui.request.isSplit && !p.sides[1].rgba.empty();
        if (hasRight) {
            const float x = std::round(from.x + width * ui.request.split);
            list->AddRectFilled({x - 1, from.y}, {x + 2, to.y}, IM_COL32(0, 0, 0, 255));
            list->AddRectFilled({x, from.y}, {x + 1, to.y}, IM_COL32(255, 255, 255, 255));
            const std::string name = nameOf(p, 1);
            const ImVec2 size = space.sizeOf(name);
            space.text("right name", {to.x - size.x - scaled(8), from.y + scaled(8)}, name,
                       IM_COL32_WHITE, size);
        }
        if (!p.sides[0].rgba.empty())
            space.textAtTop("left name", nameOf(p, 0));
        if (!ui.request.frozen.empty())
            space.textAtTop("frozen",
                            "frozen: shows the frame of the camera at which F was pressed");
        if (ui.showsLights)
            drawLights(p, ui, from, to);
        drawLegend(p.legend, space);
        if (ui.showsLights)
            space.textAtBottom("lights legend",
                               "lights: sky blue by rays, orange by maps, white by both, grey by "
                               "neither; arrows: direction of directional lights");
        if (p.pixel && p.request.pixel == ui.request.pixel)
            ui.pixel = std::make_shared<const PixelReport>(*p.pixel);
        if (ui.pixel && ui.request.pixel) {
            drawPair(p, *ui.pixel, lightOfPair(ui), space, from, to);
            // A frozen frame's sample is seen from elsewhere.
            const glm::dvec3 sample =
                pixelOfPoint(makeViewRays(p.camera, p.width, p.height), ui.pixel->positionWorld);
            const bool isElsewhere = !ui.request.frozen.empty() && ui.pixel->hasSample;
            const ImVec2 at = isElsewhere ? OnScreen(p, from, to)(glm::dvec2(sample))
                                          : ImVec2{from.x + width * ui.request.pixel->x,
                                                   from.y + (to.y - from.y) * ui.request.pixel->y};
            if (!isElsewhere || sample.z > 0.0) {
                list->AddCircle(at, scaled(6), IM_COL32(0, 0, 0, 255), 0, scaled(3));
                list->AddCircle(at, scaled(6), IM_COL32(255, 255, 255, 255), 0, scaled(1));
            }
        }
        if (ui.demo && p.request.caption >= 0)
            drawCaption(*ui.demo, size_t(p.request.caption), space);
    } else {
        space.to.y = (from.y + to.y) / 2; // nothing else is there to look at
    }
    if (!ui.statusWork.empty()) {
        char percent[32] = "";
        if (ui.statusFraction >= 0)
            std::snprintf(percent, sizeof percent, "  %.0f %%", 100.0 * ui.statusFraction);
        space.textAtBottom("work", ui.statusWork + percent);
    }
    const bool hasBoth = !ui.statusError.empty() && !ui.openError.empty();
    const std::string error = ui.statusError + (hasBoth ? "\n" : "") + ui.openError;
    if (!error.empty())
        space.textAtBottom("error", error, kErrorColor);
    if (!ui.message.empty())
        space.textAtBottom("message", ui.message);
    if (ui.picture && ui.pixel && ui.request.pixel && !ui.demo)
        drawPixel(ui, *ui.pixel, space);
}

} // namespace shadowdag
