// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_font.h"

#include <imgui.h>

#include <cmath>
#include <initializer_list>

namespace shadowdag {

namespace {

constexpr float kTextPixels = 13; // of Dear ImGui's own font
constexpr int kTitle = 1, kCaption = 2;

} // namespace

void setFontScale(float scale) {
    ImFontAtlas* const fonts = ImGui::GetIO().Fonts;
    fonts->Clear();
    for (const float size : {1.0f, 2.0f, 1.5f}) { // text, kTitle, kCaption
        ImFontConfig config;
        config.OversampleH = config.OversampleV = 1;
        config.PixelSnapH = true;
        config.SizePixels = std::round(kTextPixels * scale * size);
        fonts->AddFontDefault(&config);
    }
    fonts->Build();
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    style.WindowRounding = 0;
    style.ScaleAllSizes(scale);
    ImGui::GetStyle() = style;
}

float scaled(float pixels) {
    return pixels * ImGui::GetIO().Fonts->Fonts[0]->FontSize / kTextPixels;
}

void pushTitleFont() {
    ImGui::PushFont(ImGui::GetIO().Fonts->Fonts[kTitle]);
}

void pushCaptionFont() {
    ImGui::PushFont(ImGui::GetIO().Fonts->Fonts[kCaption]);
}

} // namespace shadowdag
