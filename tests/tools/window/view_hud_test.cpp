// SPDX-License-Identifier: Apache-2.0
// What is drawn over the picture: all of it is in the picture, and nothing covers anything.
#include "tests/tools/window/view_interface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

namespace {

const ImVec2 kFrom{350, 0}, kTo{1280, 720};
constexpr const char* kTexts[] = {"legend",       "lights legend", "pair legend", "caption",
                                  "pixel window", "left name",     "right name",  "work",
                                  "error",        "message"};

/// Draws a few frames, as a window that was just opened settles.
void draw(ViewUi& ui, Interface& interface) {
    for (int i = 0; i < 3; ++i)
        interface.frame([&] { drawOverPicture(ui, kFrom, kTo); });
}

/// Expects the texts of a state within the picture and apart; returns how many there are.
size_t expectApart(const ViewUi& ui) {
    size_t count = 0;
    for (const char* name : kTexts) {
        const auto place = ui.layout.find(name);
        if (place == ui.layout.end())
            continue;
        ++count;
        const Place& a = place->second;
        EXPECT_GE(a[0], int(kFrom.x)) << name;
        EXPECT_GE(a[1], int(kFrom.y)) << name;
        EXPECT_LE(a[0] + a[2], int(kTo.x)) << name;
        EXPECT_LE(a[1] + a[3], int(kTo.y)) << name;
        for (const char* other : kTexts)
            if (const auto b = ui.layout.find(other); other != name && b != ui.layout.end()) {
                EXPECT_FALSE(overlap(a, b->second)) << name << ", " << other;
            }
    }
    return count;
}

TEST(ViewHud, TextsStandApartAtEverySizeOfText) {
    for (const float scale : {1.0f, 1.5f, 2.0f}) {
        SCOPED_TRACE(scale);
        Interface interface(scale);
        ViewUi ui = fullUi();
        draw(ui, interface);
        EXPECT_EQ(expectApart(ui), 9u) << "all but the caption";
    }
}

TEST(ViewHud, EveryCaptionOfTheDemoIsReadable) {
    for (const float scale : {1.0f, 1.5f})
        for (size_t caption = 0; caption < kDemoCaptionCount; ++caption) {
            SCOPED_TRACE(kDemoCaptions[caption].title);
            Interface interface(scale);
            ViewUi ui = fullUi();
            ViewPicture picture = *ui.picture;
            picture.request.caption = int(caption);
            ui.picture = std::make_shared<const ViewPicture>(picture);
            ui.demo = DemoMoment{};
            draw(ui, interface);
            EXPECT_EQ(expectApart(ui), 9u) << "all but the list of pairs";
            const Place box = ui.layout["caption"];
            EXPECT_GT(box[3], 80);
            EXPECT_LT(box[3], 360) << "it leaves half of the picture";
        }
}

TEST(ViewHud, AnErrorIsToldWhereNoSceneIsOpen) {
    Interface interface(1);
    ViewUi ui;
    ui.openError = "no-such.glb: no such file; check the name";
    draw(ui, interface);
    EXPECT_EQ(expectApart(ui), 1u);
    ASSERT_EQ(ui.layout.count("error"), 1u);
    const Place error = ui.layout["error"];
    EXPECT_NEAR(error[1] + error[3] / 2, 360, 60) << "in the middle";
    ui.openError.clear();
    draw(ui, interface);
    EXPECT_EQ(expectApart(ui), 0u);
}

TEST(ViewHud, AClickOnALightOfTheListDrawsItsPair) {
    Interface interface(1);
    ViewUi ui = fullUi();
    const auto drawAll = [&] { drawOverPicture(ui, kFrom, kTo); };
    draw(ui, interface);
    ASSERT_EQ(ui.layout.count("pair 1"), 1u);
    EXPECT_EQ(ui.pixelLight, -1);
    interface.click(ui.layout["pair 1"], drawAll);
    EXPECT_EQ(ui.pixelLight, 1);
}

} // namespace

} // namespace shadowdag
