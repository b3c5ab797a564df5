// SPDX-License-Identifier: Apache-2.0
// The program `shadowdag view` on a separate display, controlled and observed by a test.
#pragma once

#include "tests/tools/program/program_runner.h"
#include "tests/tools/window/x_display.h"
#include "tools/workspace/image_io.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace shadowdag {

/// A scene that renders in milliseconds, with lights that are served by maps.
inline const std::vector<std::string> kSmall{
    "builtin:fail-silhouette", "--resolution", "128", "--believe", "all", "--method", "hybrid"};

/// Starts the window, waits for what its log says.
class ViewProgram {
public:
    explicit ViewProgram(const std::vector<std::string>& arguments, int width = 1280,
                         int height = 720)
        : display(width, height), log_(directory / "log.jsonl") {
        if (!display.isThere())
            return;
        setenv("DISPLAY", display.name().c_str(), 1);
        std::vector<std::string> all{"view"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        for (const std::string& more :
             {std::string("--log"), log_, std::string("--save-to"), directory.path(),
              std::string("--size"), std::to_string(width) + "x" + std::to_string(height)})
            all.push_back(more);
        child_ = startProgram(directory, all, directory / "view.out", directory / "view.err");
        isOpen = display.focus("ShadowDAG", 30);
    }
    ~ViewProgram() {
        if (child_ > 0)
            kill(child_, SIGKILL);
        if (child_ > 0)
            waitForProgram(child_);
    }

    /// Returns all lines of the log.
    std::vector<Json> lines() const {
        std::vector<Json> lines;
        std::istringstream text(readText(log_));
        for (std::string line; std::getline(text, line);) {
            const Json json = Json::parse(line, nullptr, false);
            if (!json.is_discarded()) // the last may be half written
                lines.push_back(json);
        }
        return lines;
    }
    /// Waits until a line from number `from` on is what `isIt` wants; returns it, or null after
    /// `seconds`.
    Json waitFor(const std::function<bool(const Json&)>& isIt, size_t from = 0,
                 double seconds = 90) const {
        for (double waited = 0; waited < seconds; waited += 0.1) {
            const std::vector<Json> all = lines();
            for (size_t i = from; i < all.size(); ++i)
                if (isIt(all[i]))
                    return all[i];
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
        return nullptr;
    }
    Json waitForEvent(const std::string& event, size_t from = 0, double seconds = 90) const {
        return waitFor([&](const Json& line) { return line["event"] == event; }, from, seconds);
    }
    /// Waits for a picture that is final and fits.
    Json waitForPicture(const std::function<bool(const Json&)>& fits, size_t from = 0,
                        double seconds = 90) const {
        return waitFor(
            [&](const Json& line) {
                return line["event"] == "picture" && line["is_final"] == true && fits(line);
            },
            from, seconds);
    }
    Json waitForPicture(size_t from = 0) const {
        return waitForPicture([](const Json&) { return true; }, from);
    }
    size_t lineCount() const { return lines().size(); }

    /// Returns where a widget stands: x, y, width, height; zeros where it is not there.
    std::array<int, 4> widget(const std::string& name) const {
        std::array<int, 4> place{};
        for (const Json& line : lines())
            if (line["event"] == "layout" && line["widgets"].contains(name))
                place = line["widgets"][name].get<std::array<int, 4>>();
        return place;
    }
    /// Clicks a widget at a share of its width.
    void clickWidget(const std::string& name, double share = 0.5) {
        const std::array<int, 4> w = widget(name);
        ASSERT_GT(w[2], 0) << name;
        display.click(w[0] + int(double(w[2]) * share), w[1] + w[3] / 2);
    }
    /// Waits for the program to end after a request; returns its exit status.
    int waitForEnd() {
        const int status = waitForProgram(child_);
        child_ = -1;
        return status;
    }
    std::string errors() const { return readText(directory / "view.err"); }
    void interrupt() { kill(child_, SIGINT); }

    /// Takes a picture of the screen; also a PNG where SDAG_SCREENSHOTS names a directory.
    Screenshot shoot(const std::string& name) const {
        const Screenshot shot = display.shoot();
        if (const char* to = std::getenv("SDAG_SCREENSHOTS"))
            writePng(std::string(to) + "/" + name + ".png", uint32_t(shot.width),
                     uint32_t(shot.height), shot.pixels);
        return shot;
    }

    TemporaryDirectory directory;
    XDisplay display;
    bool isOpen = false;

private:
    std::string log_;
    pid_t child_ = -1;
};

/// The window or a skip with a reason.
#define SDAG_NEEDS_WINDOW(view)                                                                    \
    do {                                                                                           \
        if (!(view).display.isThere())                                                             \
            GTEST_SKIP() << (view).display.whyNot();                                               \
        ASSERT_TRUE((view).isOpen) << (view).errors();                                             \
    } while (false)

} // namespace shadowdag
