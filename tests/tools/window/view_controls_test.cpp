// SPDX-License-Identifier: Apache-2.0
// Every control of the panel explains itself, and names an option that exists.
#include "tools/window/view_controls.h"

#include "tests/tools/program/program_runner.h"
#include "tests/tools/window/view_interface.h"
#include "tools/settings/setting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <set>
#include <stdexcept>

namespace shadowdag {

namespace {

using testing::HasSubstr;

constexpr float kPanelWidth = 350, kTall = 2000;

TEST(ViewControls, NameOptionsOfTheProgramOnly) {
    TemporaryDirectory directory;
    const std::string help = runShadowdag(directory, {"view", "--help"}).out;
    const std::regex option("--[a-z-]+");
    for (const ViewControl& control : viewControls()) {
        EXPECT_FALSE(control.help.empty()) << control.name;
        EXPECT_NE(control.help.back(), '.') << control.name;
        EXPECT_THAT(tooltipOf(control.name), HasSubstr(control.help));
        EXPECT_THAT(tooltipOf(control.name),
                    HasSubstr("Option: " + (control.option.empty() ? "none" : control.option)));
        for (std::sregex_iterator at(control.option.begin(), control.option.end(), option), end;
             at != end; ++at)
            EXPECT_THAT(help, HasSubstr("\n  " + at->str() + " ")) << control.name;
    }
    const auto unknown = [] { return tooltipOf("no such control"); };
    EXPECT_THROW(unknown(), std::logic_error);
}

TEST(ViewControls, OfSettingsSayWhatTheTableSays) {
    size_t count = 0;
    for (const Setting* setting : frameSettings()) {
        if (setting->choices.empty())
            continue;
        ++count;
        const std::vector<ViewControl>& all = viewControls();
        const auto found = std::find_if(all.begin(), all.end(), [&](const ViewControl& control) {
            return control.name == setting->panelLabel;
        });
        ASSERT_NE(found, all.end()) << setting->option;
        EXPECT_EQ(found->help, setting->help);
        EXPECT_EQ(found->option, setting->option);
    }
    EXPECT_GT(count, 4u);
    std::set<std::string> names;
    for (const ViewControl& control : viewControls())
        EXPECT_TRUE(names.insert(control.name).second) << control.name << " is there twice";
}

/// Draws the panel of a state with all that can be unfolded.
struct Panel {
    explicit Panel(float fontScale, ModelKind kind = ModelKind::kTexels)
        : scale(fontScale), interface(fontScale, 1280 * fontScale, kTall * fontScale) {
        ui.modelKind = kind;
        interface.frame(draw);
        for (const char* heading : {"maps", "map", "group keys"})
            interface.click(ui.layout[heading], draw);
        interface.frame(draw);
    }

    float scale;
    Interface interface;
    ViewUi ui = fullUi();
    std::function<void()> draw = [this] { drawPanel(ui, kPanelWidth * scale, kTall * scale, 0); };
};

TEST(ViewPanel, EveryControlShowsItsTooltipUnderTheMouse) {
    std::set<std::string> seen;
    for (const ModelKind kind : {ModelKind::kTexels, ModelKind::kExpression}) {
        Panel panel(1, kind);
        for (const ViewControl& control : viewControls()) {
            const auto place = panel.ui.layout.find(control.name);
            if (place == panel.ui.layout.end())
                continue;
            seen.insert(control.name);
            panel.interface.moveTo(place->second);
            panel.interface.frame(panel.draw);
            EXPECT_EQ(panel.ui.tooltip, "") << control.name << ": at once it would be in the way";
            panel.interface.frame(panel.draw);
            panel.interface.frame(panel.draw);
            EXPECT_EQ(panel.ui.tooltip, tooltipOf(control.name));
        }
    }
    EXPECT_EQ(seen.size(), viewControls().size()) << "some control is never drawn";
}

TEST(ViewPanel, NothingReactsToTheMouseWithoutExplainingItself) {
    Panel panel(1);
    const auto isMarked = [&](float x, float y) {
        return std::any_of(panel.ui.layout.begin(), panel.ui.layout.end(), [&](const auto& entry) {
            return overlap(entry.second, {int(x) - 1, int(y) - 1, 2, 2});
        });
    };
    size_t onControls = 0;
    for (float y = 4; y < kTall; y += 5)
        for (const float x : {20.0f, 120.0f}) {
            panel.interface.moveTo(x, y);
            panel.interface.frame(panel.draw);
            panel.interface.frame(panel.draw);
            onControls += panel.interface.isOnControl;
            EXPECT_TRUE(!panel.interface.isOnControl || isMarked(x, y)) << x << " " << y;
        }
    EXPECT_GT(onControls, 50u);
}

TEST(ViewPanel, ControlsStandBesideEachOtherAtEverySizeOfText) {
    for (const float scale : {1.0f, 1.5f, 2.0f}) {
        Panel panel(scale);
        for (auto a = panel.ui.layout.begin(); a != panel.ui.layout.end(); ++a) {
            EXPECT_GE(a->second[0], 0) << a->first;
            EXPECT_LE(a->second[0] + a->second[2], int(kPanelWidth * scale))
                << a->first << " at " << scale;
            for (auto b = panel.ui.layout.begin(); b != a; ++b)
                EXPECT_FALSE(overlap(a->second, b->second))
                    << a->first << ", " << b->first << " at " << scale;
        }
    }
}

} // namespace

} // namespace shadowdag
