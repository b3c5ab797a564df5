// SPDX-License-Identifier: Apache-2.0
// The window in use: keys and mouse through the display server; its log and the screen are compared
// with the expected behaviour.
#include "tests/tools/window/view_window.h"

#include "tools/window/view_request.h"

#include <gmock/gmock.h>

#include <filesystem>

namespace shadowdag {

namespace {

using ::testing::HasSubstr;

bool hasMethod(const Json& line, size_t side, const std::string& method) {
    return line["sides"].size() > side && line["sides"][side]["method"] == method;
}

TEST(ViewWindow, KeysFlyAndTheMouseLooks) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    const Screenshot before = view.shoot("fly-before");
    size_t from = view.lineCount();
    view.display.press("d");
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    view.display.release("d");
    const Json moving = view.waitFor(
        [](const Json& line) { return line["event"] == "picture" && line["is_moving"] == true; },
        from);
    ASSERT_FALSE(moving.is_null()) << "the picture did not move";
    EXPECT_THAT(moving["camera"].get<std::string>(), HasSubstr(","));
    const Json rest = view.waitForPicture(from);
    ASSERT_FALSE(rest.is_null()) << "it did not come to rest";
    EXPECT_EQ(rest["scale"], 1.0);
    const Screenshot after = view.shoot("fly-after");
    EXPECT_GT(meanDifference(before, after, 350, 40, 930, 600), 0.002);

    from = view.lineCount();
    view.display.drag(800, 400, 900, 430, 3);
    const Json turned = view.waitForPicture(
        [&](const Json& line) { return line["camera"] != rest["camera"]; }, from);
    ASSERT_FALSE(turned.is_null());
    const std::string a = rest["camera"], b = turned["camera"];
    const auto place = [](const std::string& text) {
        size_t comma = 0;
        for (int i = 0; i < 3; ++i)
            comma = text.find(',', comma) + 1;
        return text.substr(0, comma);
    };
    EXPECT_EQ(place(a), place(b)) << "looking does not walk";
}

TEST(ViewWindow, AnOverlayIsDrawnFromTheExistingFrame) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    const Json first = view.waitForPicture();
    ASSERT_FALSE(first.is_null()) << view.errors();
    const size_t from = view.lineCount();
    view.display.tap("o");
    const Json other = view.waitForPicture(from);
    ASSERT_FALSE(other.is_null());
    EXPECT_EQ(other["overlay"], "clusters");
    EXPECT_EQ(other["sides"][0]["time_ms"], first["sides"][0]["time_ms"]) << "rendered anew";
    EXPECT_EQ(other["sides"][0]["done_share"], 1.0);
    for (const Json& line : view.lines())
        if (line["event"] == "picture" && line["overlay"] == "clusters") {
            EXPECT_EQ(line["scale"], 1.0) << "a small picture came first";
        }
}

TEST(ViewWindow, DirectionalLightsAreShownByArrows) {
    ViewProgram view({"builtin:fail-sun", "--resolution", "64"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    const Screenshot without = view.shoot("no-sun");
    view.display.tap("l");
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    // In the picture's upper right corner; the names of the sides stand above it.
    EXPECT_GT(meanDifference(without, view.shoot("sun"), 1150, 40, 120, 110), 1e-3);
}

TEST(ViewWindow, FilesAreNamedInThePanel) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    const auto type = [&](const std::string& text) {
        view.clickWidget("path");
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        for (const char c : text)
            view.display.tap(c == '/' ? "slash" : c == '.' ? "period" : std::string(1, c));
        view.display.tap("Return");
    };
    size_t from = view.lineCount();
    type("no/such.glb");
    const Json error = view.waitForEvent("error", from);
    ASSERT_FALSE(error.is_null());
    EXPECT_THAT(error["message"].get<std::string>(), HasSubstr("no/such.glb"));
    EXPECT_THAT(view.errors(), HasSubstr("shadowdag: error: no/such.glb")) << "at once";
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    view.shoot("no-such-file");
    from = view.lineCount();
    type("costs.json");
    const Json costs = view.waitFor(
        [](const Json& l) {
            return l["event"] == "error" &&
                   l["message"].get<std::string>().find("costs.json") != std::string::npos;
        },
        from);
    EXPECT_FALSE(costs.is_null());
    view.shoot("path");
}

TEST(ViewWindow, TheOracleMeasuresWhenItRests) {
    ViewProgram view({"builtin:fail-silhouette", "--resolution", "128", "--method", "hybrid",
                      "--model", "oracle"});
    SDAG_NEEDS_WINDOW(view);
    const auto hasNote = [](const Json& line, const char* text) {
        for (const Json& note : line["notes"])
            if (note.get<std::string>().find(text) != std::string::npos)
                return true;
        return false;
    };
    const Json first = view.waitForPicture();
    ASSERT_FALSE(first.is_null()) << view.errors();
    EXPECT_TRUE(hasNote(first, "kept until the view changes")) << first;
    view.shoot("oracle");
    const size_t from = view.lineCount();
    view.display.press("d");
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    view.display.release("d");
    const Json moving = view.waitFor(
        [](const Json& line) { return line["event"] == "picture" && line["is_moving"] == true; },
        from);
    ASSERT_FALSE(moving.is_null());
    EXPECT_TRUE(hasNote(moving, "measures once the view rests")) << moving;
}

TEST(ViewWindow, MethodsAndTheThresholdApplyAtOnce) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    const Json first = view.waitForPicture();
    ASSERT_FALSE(first.is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.tap("2");
    EXPECT_FALSE(
        view.waitForPicture([](const Json& l) { return hasMethod(l, 0, "dag"); }, from).is_null());
    from = view.lineCount();
    view.display.tap("3");
    EXPECT_FALSE(
        view.waitForPicture([](const Json& l) { return hasMethod(l, 0, "maps"); }, from).is_null());
    from = view.lineCount();
    view.display.tap("4");
    EXPECT_FALSE(view.waitForPicture([](const Json& l) { return hasMethod(l, 0, "hybrid"); }, from)
                     .is_null());
    // Drag the slider to its right end: every map is under the threshold, and traced.
    from = view.lineCount();
    const std::array<int, 4> slider = view.widget("threshold");
    ASSERT_GT(slider[2], 0);
    view.display.drag(slider[0] + 60, slider[1] + 9, slider[0] + 172, slider[1] + 9);
    const Json traced = view.waitForPicture(
        [](const Json& l) {
            return l["sides"][0]["drawn_map_count"] == 0 && l["sides"][0]["traced_map_count"] > 0;
        },
        from);
    ASSERT_FALSE(traced.is_null()) << "the slider did nothing";
    EXPECT_NE(traced["sides"][0]["model"], first["sides"][0]["model"]);
    view.shoot("threshold");
}

TEST(ViewWindow, ComparesWithTheTruthAndCountsErrors) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.tap("2");
    view.clickWidget("split", 0.08);
    const Json split = view.waitForPicture(
        [](const Json& l) { return hasMethod(l, 0, "dag") && hasMethod(l, 1, "truth"); }, from);
    ASSERT_FALSE(split.is_null());
    EXPECT_EQ(split["sides"][0]["done_share"], 1.0);
    EXPECT_GT(split["sides"][0]["false_shadow_count"], 0);
    const Screenshot middle = view.shoot("split-middle");
    // The divider follows the mouse.
    view.display.drag(350 + 465, 500, 350 + 200, 500);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    view.display.moveTo(360, 700);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const Screenshot left = view.shoot("split-left");
    EXPECT_GT(left.at(550, 300).r, 0.8f) << "the divider's line";
    EXPECT_LT(meanDifference(middle, left, 900, 100, 300, 500), 0.001) << "right of both dividers";
}

TEST(ViewWindow, OverlaysFreezeAndLightsAreVisible) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    view.display.tap("3");
    Screenshot last = view.shoot("overlay-00");
    for (size_t i = 1; i < kOverlayNames.size(); ++i) {
        const size_t from = view.lineCount();
        view.display.tap("o");
        const std::string name = kOverlayNames[i];
        ASSERT_FALSE(view.waitForPicture([&](const Json& l) { return l["overlay"] == name; }, from)
                         .is_null())
            << name;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        const Screenshot shot = view.shoot("overlay-" + std::to_string(100 + i).substr(1));
        // Some pairs in a thousand are wrong: few pixels of error pictures differ.
        const double least = needsTruth(ViewOverlay(i)) ? 1e-6 : 1e-3;
        EXPECT_GT(meanDifference(last, shot, 350, 30, 930, 600), least) << name;
        last = shot;
    }
    size_t from = view.lineCount();
    view.display.tap("o");
    ASSERT_FALSE(
        view.waitForPicture([](const Json& l) { return l["overlay"] == "lit scene"; }, from)
            .is_null());
    const Screenshot without = view.shoot("no-lights");
    view.display.tap("l");
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_GT(meanDifference(without, view.shoot("lights"), 350, 30, 930, 690), 1e-4);
    from = view.lineCount();
    view.display.tap("f");
    view.display.press("s");
    std::this_thread::sleep_for(std::chrono::milliseconds(900));
    view.display.release("s");
    const Json frozen = view.waitForPicture([](const Json& l) { return l["frozen"] != ""; }, from);
    ASSERT_FALSE(frozen.is_null()) << "nothing is frozen";
    EXPECT_NE(frozen["frozen"], frozen["camera"]) << "the observer did not walk";
    view.shoot("frozen");
    from = view.lineCount();
    view.display.tap("f");
    ASSERT_FALSE(
        view.waitForPicture([](const Json& l) { return l["frozen"] == ""; }, from).is_null());
}

TEST(ViewWindow, AClickReportsThePairsOfAPixel) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.click(350 + 465, 500);
    const Json told = view.waitForPicture([](const Json& l) { return l.contains("pixel"); }, from);
    ASSERT_FALSE(told.is_null());
    EXPECT_NEAR(told["pixel"]["x"].get<int>(), 465, 1);
    EXPECT_NEAR(told["pixel"]["y"].get<int>(), 500, 1);
    ASSERT_TRUE(told["pixel"]["has_sample"]);
    ASSERT_FALSE(told["pixel"]["pairs"].empty());
    for (const Json& pair : told["pixel"]["pairs"]) {
        EXPECT_TRUE(pair["visibility"].contains("truth"));
        EXPECT_TRUE(pair["visibility"].contains("dag believe all"));
        EXPECT_TRUE(pair["visibility"].contains("dag believe none"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    view.shoot("pixel");
    from = view.lineCount();
    view.display.tap("Escape");
    EXPECT_FALSE(
        view.waitForPicture([](const Json& l) { return !l.contains("pixel"); }, from).is_null());
}

TEST(ViewWindow, PlaysPausesAndSteps) {
    ViewProgram view({"builtin:fail-mover", "--resolution", "64"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.tap("space");
    ASSERT_FALSE(
        view.waitFor([](const Json& l) { return l["event"] == "picture" && l["frame"] > 5; }, from)
            .is_null())
        << "it does not play";
    view.clickWidget("play");
    from = view.lineCount();
    const Json paused = view.waitForPicture(from);
    ASSERT_FALSE(paused.is_null()) << "it does not come to rest";
    const int frame = paused["frame"];
    from = view.lineCount();
    view.display.tap("period");
    ASSERT_FALSE(view.waitForPicture([&](const Json& l) { return l["frame"] == frame + 1; }, from)
                     .is_null());
    from = view.lineCount();
    view.display.tap("comma");
    ASSERT_FALSE(
        view.waitForPicture([&](const Json& l) { return l["frame"] == frame; }, from).is_null());
}

/// The methods that a saved view is rendered again by, as their keys.
class SavedView : public testing::TestWithParam<const char*> {};

TEST_P(SavedView, IsRenderedAgainByCompare) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    view.display.tap(GetParam());
    view.display.press("w");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    view.display.release("w");
    size_t from = view.lineCount();
    const Json rest = view.waitForPicture(from);
    ASSERT_FALSE(rest.is_null());
    from = view.lineCount();
    view.display.tap("F12");
    const Json saved = view.waitForEvent("saved", from);
    ASSERT_FALSE(saved.is_null());
    const Json after = view.waitForPicture(from); // the view goes on
    ASSERT_FALSE(after.is_null());
    EXPECT_EQ(saved["backend"], "cpu");
    for (const char* file : {"png", "exr", "experiment"})
        EXPECT_TRUE(std::filesystem::exists(saved[file].get<std::string>())) << file;

    const std::string report = view.directory / "report";
    const ProgramResult compared =
        runShadowdag(view.directory, {"compare", "--experiment", saved["experiment"], "-o", report,
                                      "--json", "--no-charts"});
    ASSERT_EQ(compared.status, 0) << compared.err;
    const Json results = Json::parse(readText(report + "/results.json"));
    bool isFound = false;
    for (const Json& run : results["runs"])
        if (run["method"] == after["sides"][0]["method"]) {
            isFound = true;
            EXPECT_EQ(run["pair_count"], after["sides"][0]["pair_count"]);
            EXPECT_EQ(run["false_shadow_count"], after["sides"][0]["false_shadow_count"]);
            EXPECT_EQ(run["false_light_count"], after["sides"][0]["false_light_count"]);
        }
    EXPECT_TRUE(isFound);
}
INSTANTIATE_TEST_SUITE_P(ByKey, SavedView, testing::Values("2", "3", "4"));

TEST(ViewWindow, AMissingSceneIsReportedAndSetsTheExitStatus) {
    ViewProgram view({"no-such.glb"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForEvent("error").is_null());
    EXPECT_THAT(view.errors(), HasSubstr("shadowdag: error: no-such.glb: no such file"))
        << "at once";
    std::this_thread::sleep_for(std::chrono::milliseconds(300)); // until it is drawn
    view.shoot("no-scene");
    view.display.close();
    EXPECT_EQ(view.waitForEnd(), 2);
    EXPECT_THAT(view.errors(), HasSubstr("no scene was open"));
}

bool isDemo(const Json& line, const char* key) {
    return line["event"] == "demo" && line.contains(key);
}

TEST(ViewWindow, TheDemoShowsWhatItsCaptionsSpeakOfUntilAKeyEndsIt) {
    ViewProgram view(
        {"builtin:fail-silhouette", "--resolution", "128", "--demo", "--caption-seconds", "0.8"});
    SDAG_NEEDS_WINDOW(view);
    const std::pair<const char*, const char*> shown[] = {
        {"dag", "lit scene"}, {"dag", "voxels"}, {"maps", "pages"}};
    size_t from = 0;
    for (int caption = 1; caption <= 3; ++caption) {
        const auto& [method, overlay] = shown[caption - 1];
        ASSERT_FALSE(
            view.waitFor(
                    [&](const Json& l) { return isDemo(l, "caption") && l["caption"] == caption; },
                    from)
                .is_null())
            << caption;
        const Json picture = view.waitFor(
            [&](const Json& l) { return l["event"] == "picture" && l["caption"] == caption; },
            from);
        ASSERT_FALSE(picture.is_null()) << caption;
        EXPECT_TRUE(hasMethod(picture, 0, method)) << picture;
        EXPECT_EQ(picture["overlay"], overlay);
        view.shoot("demo-" + std::to_string(caption));
    }
    from = view.lineCount();
    view.display.tap("2"); // only ends it
    ASSERT_FALSE(view.waitFor([](const Json& l) { return isDemo(l, "ended"); }, from).is_null());
    const Json left = view.waitForPicture([](const Json& l) { return l["caption"] == 0; }, from);
    ASSERT_FALSE(left.is_null());
    from = view.lineCount();
    view.display.tap("3");
    ASSERT_FALSE(
        view.waitForPicture([](const Json& l) { return hasMethod(l, 0, "maps"); }, from).is_null())
        << "the keys are the user's again";
    for (const Json& line : view.lines())
        if (line["event"] == "picture" && line["serial"] > left["serial"]) {
            EXPECT_EQ(line["camera"], left["camera"]) << "it flies on";
        }
}

TEST(ViewWindow, AClickEndsTheDemo) {
    ViewProgram view({"builtin:fail-silhouette", "--resolution", "64", "--demo"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitFor([](const Json& l) { return isDemo(l, "caption"); }).is_null());
    const size_t from = view.lineCount();
    view.display.click(800, 300);
    ASSERT_FALSE(view.waitFor([](const Json& l) { return isDemo(l, "ended"); }, from).is_null());
    const Json rest = view.waitForPicture([](const Json& l) { return l["caption"] == 0; }, from);
    ASSERT_FALSE(rest.is_null());
    EXPECT_FALSE(rest.contains("pixel")) << "the click picks no pixel";
}

TEST(ViewWindow, TextIsScaledByAnOptionAndByKeys) {
    ViewProgram view({"builtin:fail-silhouette", "--resolution", "64", "--font-scale", "1.5"});
    SDAG_NEEDS_WINDOW(view);
    const Json large = view.waitForPicture();
    ASSERT_FALSE(large.is_null()) << view.errors();
    const int panel = 1280 - large["width"].get<int>();
    EXPECT_NEAR(panel, 350 * 1.5, 14); // letters have whole pixels
    view.shoot("font-150");
    const size_t from = view.lineCount();
    view.display.press("Control_L");
    view.display.tap("0");
    view.display.release("Control_L");
    EXPECT_FALSE(view.waitForPicture([](const Json& l) { return l["width"] == 1280 - 350; }, from)
                     .is_null());
}

TEST(ViewWindow, RunsOnOpenGL) {
    // The window's own context is another one, on another thread.
    ViewProgram view({"builtin:fail-silhouette", "--resolution", "128", "--method", "hybrid",
                      "--backend", "gl"});
    SDAG_NEEDS_WINDOW(view);
    const Json picture = view.waitForPicture();
    ASSERT_FALSE(picture.is_null()) << view.errors();
    EXPECT_EQ(picture["backend"], "gl");
    const Screenshot shot = view.shoot("gl");
    ViewProgram other(kSmall);
    SDAG_NEEDS_WINDOW(other);
    ASSERT_FALSE(other.waitForPicture().is_null()) << other.errors();
    EXPECT_LT(meanDifference(shot, other.shoot("cpu"), 600, 40, 680, 600), 0.002)
        << "the picture is another than the processor's";
    view.display.close();
    EXPECT_EQ(view.waitForEnd(), 0) << view.errors();
}

TEST(ViewWindow, OpensDroppedFiles) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    const std::string scene = view.directory / "mover.glb", asset = view.directory / "mover.svdag";
    ASSERT_EQ(runShadowdag(view.directory, {"scene", "fail-mover", "-o", scene}).status, 0);
    ASSERT_EQ(
        runShadowdag(view.directory, {"voxelize", scene, "-o", asset, "--resolution", "32"}).status,
        0);
    size_t from = view.lineCount();
    EXPECT_TRUE(view.display.drop(scene, 800, 400));
    const Json opened = view.waitForEvent("scene", from);
    ASSERT_FALSE(opened.is_null());
    EXPECT_EQ(opened["scene"], scene);
    ASSERT_FALSE(view.waitForPicture(from).is_null());
    from = view.lineCount();
    EXPECT_TRUE(view.display.drop(asset, 800, 400));
    const Json voxels = view.waitForEvent("scene", from);
    ASSERT_FALSE(voxels.is_null());
    EXPECT_EQ(voxels["resolution"], 32);
    from = view.lineCount();
    const std::string text = view.directory / "notes.txt";
    writeText(text, "no scene");
    EXPECT_TRUE(view.display.drop(text, 800, 400));
    const Json refused = view.waitForEvent("drop", from);
    EXPECT_THAT(refused["message"].get<std::string>(), HasSubstr("not a scene"));
}

TEST(ViewWindow, ClosesCleanlyWhileItLoads) {
    ViewProgram view({"builtin:atrium", "--resolution", "4096"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitFor([](const Json& l) {
                         return l["event"] == "work" &&
                                l["what"].get<std::string>().find("voxelize") != std::string::npos;
                     })
                     .is_null());
    view.shoot("loading");
    view.display.close();
    EXPECT_EQ(view.waitForEnd(), 0) << view.errors();
}

TEST(ViewWindow, EndsWhenTheDisplayClosesDuringAnyWork) {
    for (const std::string work : {"open", "voxelize", "picture"}) {
        SCOPED_TRACE(work);
        ViewProgram view({"builtin:atrium", "--resolution", "512"});
        SDAG_NEEDS_WINDOW(view);
        ASSERT_FALSE(view.waitFor([&](const Json& l) {
                             return l["event"] == work ||
                                    (l["event"] == "work" &&
                                     l["what"].get<std::string>().find(work) != std::string::npos);
                         })
                         .is_null());
        view.display.endServer();
        EXPECT_EQ(view.waitForEnd(), 4);
        EXPECT_THAT(view.errors(), HasSubstr("the connection to the display was lost"));
    }
}

TEST(ViewWindow, EndsOnCtrlCAsEveryCommandDoes) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    view.interrupt();
    EXPECT_EQ(view.waitForEnd(), 128 + SIGINT);
}

TEST(ViewWindow, FollowsItsSize) {
    ViewProgram view(kSmall);
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.resize(900, 600);
    ASSERT_FALSE(
        view.waitForPicture([](const Json& l) { return l["width"] == 550 && l["height"] == 600; },
                            from)
            .is_null());
    from = view.lineCount();
    view.display.tap("F1");
    ASSERT_FALSE(
        view.waitForPicture([](const Json& l) { return l["width"] == 900; }, from).is_null());
}

TEST(ViewWindow, ReportsErrorsAndStaysOpen) {
    ViewProgram view({"builtin:fail-silhouette", "--resolution", "64", "--method", "hybrid",
                      "--model", "expr:texels < 96"});
    SDAG_NEEDS_WINDOW(view);
    ASSERT_FALSE(view.waitForPicture().is_null()) << view.errors();
    size_t from = view.lineCount();
    view.display.click(view.widget("expression")[0] + 60, view.widget("expression")[1] + 9);
    view.display.tap("End");
    view.display.tap("plus"); // an expression that ends in an operator
    view.display.tap("Return");
    const Json error = view.waitForEvent("error", from);
    ASSERT_FALSE(error.is_null());
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    view.shoot("error");
    from = view.lineCount();
    view.display.click(350 + 600, 300); // off the text
    view.display.tap("2");
    EXPECT_FALSE(
        view.waitForPicture([](const Json& l) { return hasMethod(l, 0, "dag"); }, from).is_null());
}

TEST(ViewCommand, WithoutADisplayItIsAnErrorOfTheDevice) {
    TemporaryDirectory directory;
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const ProgramResult result = runShadowdag(directory, {"view", "builtin:fail-silhouette"});
    EXPECT_EQ(result.status, 4);
    EXPECT_THAT(result.err, HasSubstr("DISPLAY"));
}

TEST(ViewCommand, RefusesUnsupportedInput) {
    TemporaryDirectory directory;
    EXPECT_EQ(runShadowdag(directory, {"view", "--right", "best"}).status, 1);
    EXPECT_EQ(runShadowdag(directory, {"view", "--method", "hybrid", "--model", "cost"}).status, 1);
    EXPECT_EQ(runShadowdag(directory, {"view", "--target", "0"}).status, 1);
    EXPECT_EQ(runShadowdag(directory, {"view", "--frames", "0:5"}).status, 1);
    EXPECT_EQ(runShadowdag(directory, {"view", "--exposure", "-1"}).status, 1);
    EXPECT_EQ(runShadowdag(directory, {"view", "--font-scale", "9"}).status, 1);
    EXPECT_THAT(runShadowdag(directory, {"view", "--demo"}).err, HasSubstr("needs a SCENE"));
    EXPECT_THAT(runShadowdag(directory, {"view", "--caption-seconds", "3"}).err,
                HasSubstr("no effect without --demo"));
    EXPECT_THAT(
        runShadowdag(directory, {"view", "builtin:atrium", "--demo", "--show", "voxels"}).err,
        HasSubstr("--show and --demo contradict each other"));
    EXPECT_THAT(runShadowdag(directory, {"view", "--show", "everything"}).err,
                HasSubstr("lit-scene, clusters, method-by-light"));
}

TEST(ViewCommand, ReportsAtStartThatFilesCannotBeSaved) {
    TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"view", "--save-to", directory / "missing"});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, HasSubstr("missing"));
    EXPECT_THAT(result.err, HasSubstr("there is no directory"));
}

TEST(ViewCommand, PlaysAtItsOwnRateAndDescribesSize) {
    TemporaryDirectory directory;
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const ProgramResult played =
        runShadowdag(directory, {"view", "builtin:fail-mover", "--fps", "24"});
    EXPECT_EQ(played.status, 4) << "it lacks a display, not --frames: " << played.err;
    EXPECT_THAT(runShadowdag(directory, {"view", "--help"}).out,
                HasSubstr("Size of the window in pixels"));
}

} // namespace

} // namespace shadowdag
