// SPDX-License-Identifier: Apache-2.0
// Graphs over the last pictures: stacked stage times, and the errors of both sides.
#include "tools/settings/parse.h"
#include "tools/window/view_font.h"
#include "tools/window/view_ui.h"
#include "tools/workspace/error_image.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

const std::array<StageGroup, kStageGroupCount> kStageGroups{
    {{"g-buffer", kSkyBlue},
     {"clusters, lights", glm::vec3(0.0f, 158 / 255.0f, 115 / 255.0f)},
     {"page masks", glm::vec3(240 / 255.0f, 228 / 255.0f, 66 / 255.0f)},
     {"page commit", kBlue},
     {"culling", glm::vec3(204 / 255.0f, 121 / 255.0f, 167 / 255.0f)},
     {"rasterization", kOrange},
     {"shading", kVermilion},
     {"truth", glm::vec3(0.6f)}}};

uint32_t packedColor(const glm::vec3& c, float alpha) {
    return ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, alpha});
}

size_t stageGroup(const std::string& stage) {
    if (stage == "g-buffer")
        return 0;
    if (stage == "page masks")
        return 2;
    if (stage == "page commit" || stage == "page clear" || stage == "geometry copy")
        return 3;
    if (stage.starts_with("culling"))
        return 4;
    if (stage == "rasterization")
        return 5;
    if (stage == "shading")
        return 6;
    if (stage == "truth")
        return 7;
    return 1;
}

void noteHistory(ViewUi& ui, const ViewPicture& picture) {
    ViewSample sample;
    sample.scale = picture.scale;
    for (size_t side = 0; side < 2; ++side) {
        const SideReport& report = picture.sides[side];
        if (report.rgba.empty())
            continue;
        sample.groupsMs[side].assign(kStageGroupCount, 0.0f);
        for (const auto& [name, timeMs] : report.stages.stagesMs)
            sample.groupsMs[side][stageGroup(name)] += float(timeMs);
        if (report.errors && report.errors->pairCount > 0) {
            const double count = double(report.errors->pairCount);
            sample.falseShadow[side] = float(double(report.errors->falseShadowCount) / count);
            sample.falseLight[side] = float(double(report.errors->falseLightCount) / count);
        }
    }
    // A picture that is refined counts once.
    if (!ui.history.empty() && ui.picture && ui.picture->request.serial == picture.request.serial)
        ui.history.back() = std::move(sample);
    else
        ui.history.push_back(std::move(sample));
    if (ui.history.size() > kHistoryLength)
        ui.history.pop_front();
}

namespace {

/// Returns the least 1, 2 or 5 times a power of ten that is not under `value`.
double niceAbove(double value) {
    if (!(value > 0.0))
        return 1.0;
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    for (const double step : {1.0, 2.0, 5.0})
        if (value <= step * power)
            return step * power;
    return 10.0 * power;
}

/// An empty graph: frame, horizontal lines at quarters with their values, a title.
struct Axes {
    ImVec2 from, to;
    double top;

    Axes(float width, float height, double top, const char* title) : top(top) {
        ImGui::TextUnformatted(title);
        const ImVec2 at = ImGui::GetCursorScreenPos();
        from = {at.x + scaled(48), at.y + scaled(4)};
        to = {at.x + width, at.y + height - scaled(4)};
        ImGui::Dummy({width, height});
        ImDrawList* const list = ImGui::GetWindowDrawList();
        list->AddRectFilled(from, to, IM_COL32(18, 18, 22, 255));
        for (int i = 0; i <= 2; ++i) {
            const float y = to.y + (from.y - to.y) * float(i) / 2.0f;
            char label[32];
            std::snprintf(label, sizeof label, "%s", numberText(top * double(i) / 2.0).c_str());
            list->AddLine({from.x, y}, {to.x, y}, IM_COL32(80, 80, 90, 255));
            const float labelWidth = ImGui::CalcTextSize(label).x;
            list->AddText({from.x - labelWidth - scaled(4), y - scaled(7)},
                          IM_COL32(190, 190, 190, 255), label);
        }
    }
    float x(size_t i) const {
        return from.x + (to.x - from.x) * float(i) / float(kHistoryLength - 1);
    }
    float y(double value) const {
        return to.y + (from.y - to.y) * float(std::min(value / top, 1.0));
    }
};

void drawStages(const ViewUi& ui, size_t side, float width, float height) {
    double most = 0;
    for (const ViewSample& sample : ui.history) {
        double sum = 0;
        for (const float ms : sample.groupsMs[side])
            sum += double(ms);
        most = std::max(most, sum);
    }
    const Axes axes(width, height, niceAbove(most),
                    side == 0 ? "stages of the left side, ms" : "stages of the right side, ms");
    ImDrawList* const list = ImGui::GetWindowDrawList();
    const float columnWidth = (axes.to.x - axes.from.x) / float(kHistoryLength);
    const size_t shift = kHistoryLength - ui.history.size();
    for (size_t i = 0; i < ui.history.size(); ++i) {
        double sum = 0;
        const std::vector<float>& groups = ui.history[i].groupsMs[side];
        for (size_t g = 0; g < groups.size(); ++g) {
            const double next = sum + double(groups[g]);
            if (groups[g] > 0.0f)
                list->AddRectFilled({axes.x(shift + i), axes.y(next)},
                                    {axes.x(shift + i) + columnWidth, axes.y(sum)},
                                    packedColor(kStageGroups[g].color));
            sum = next;
        }
    }
}

void drawErrorLines(const ViewUi& ui, float width, float height) {
    float most = 0;
    for (const ViewSample& sample : ui.history)
        for (size_t side = 0; side < 2; ++side)
            most = std::max({most, sample.falseShadow[side], sample.falseLight[side]});
    const Axes axes(width, height, niceAbove(100.0 * double(most)), "wrong pairs, % of all");
    ImDrawList* const list = ImGui::GetWindowDrawList();
    const size_t shift = kHistoryLength - ui.history.size();
    const auto points = [&](const auto& shareOf, const glm::vec3& color, bool isRing) {
        for (size_t i = 0; i < ui.history.size(); ++i) {
            const float share = shareOf(ui.history[i]);
            if (share < 0)
                continue;
            const ImVec2 at{axes.x(shift + i), axes.y(100.0 * double(share))};
            if (isRing)
                list->AddCircle(at, scaled(2.5f), packedColor(color));
            else
                list->AddCircleFilled(at, scaled(2), packedColor(color));
        }
    };
    for (size_t side = 0; side < 2; ++side) {
        points([&](const ViewSample& s) { return s.falseShadow[side]; }, kVermilion, side == 1);
        points([&](const ViewSample& s) { return s.falseLight[side]; }, kBlue, side == 1);
    }
}

void drawKey(const glm::vec3& color, const char* name, bool isFirst) {
    if (!isFirst)
        ImGui::SameLine(0, scaled(10));
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::GetWindowDrawList()->AddRectFilled(
        {at.x, at.y + scaled(3)}, {at.x + scaled(9), at.y + scaled(12)}, packedColor(color));
    ImGui::Dummy({scaled(10), scaled(13)});
    ImGui::SameLine(0, scaled(3));
    ImGui::TextUnformatted(name);
}

} // namespace

void drawGraphs(const ViewUi& ui, float width, float height) {
    const bool hasRight = ui.request.isSplit;
    drawStages(ui, 0, width, height);
    if (hasRight)
        drawStages(ui, 1, width, height);
    for (size_t g = 0; g < kStageGroupCount; ++g)
        drawKey(kStageGroups[g].color, kStageGroups[g].name, g % 3 == 0);
    drawErrorLines(ui, width, height);
    drawKey(kVermilion, "false shadow", true);
    drawKey(kBlue, "false light", false);
    if (hasRight)
        ImGui::TextUnformatted("discs: left, rings: right");
}

} // namespace shadowdag
