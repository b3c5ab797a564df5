// SPDX-License-Identifier: Apache-2.0
// The window while it is open: its loop (view_window.cpp), keys, mouse and drops (view_events.cpp),
// and its requests to the worker (view_requests.cpp). Internal to these files.
#pragma once

#include "tools/window/view_host.h"
#include "tools/window/view_log.h"
#include "tools/window/view_session.h"
#include "tools/window/view_texture.h"
#include "tools/window/view_ui.h"
#include "tools/window/view_window.h"

#include <imgui.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The window while it is open.
class Viewer {
public:
    explicit Viewer(const ViewWindowOptions& options);
    void run();

private:
    static Viewer& of(GLFWwindow* window) {
        return *static_cast<Viewer*>(glfwGetWindowUserPointer(window));
    }
    void touch() { touched_ = glfwGetTime(); }

    /// Returns whether the interface has to be drawn at its full rate.
    bool isLively(double now) const;
    bool heldKeys() const;
    /// Handles events until the interface, last drawn at `last`, must be drawn again: at `due`, or
    /// as soon as possible if there is a picture to show. Without events it waits for the next one,
    /// and wakes up regularly to handle interrupts.
    void waitUntil(double last, double due);

    void onKey(int key, int action, int mods);
    void onButton(int button, int action);
    void takePress();
    void onDrop(int count, const char** paths);
    /// Opens scenes, voxels and costs, distinguished by their extensions.
    void openFiles(const std::vector<std::string>& paths);
    void takeModel();
    void changeThreshold(double factor);
    void takeResults();
    void fly(double seconds);
    void step(double now, double seconds);
    void showPicture();
    void playDemo(double now);
    /// Ends the demo, if it runs, and leaves the view to keys and mouse; returns whether it ran.
    bool endDemo();
    /// Shows why something could not be opened, in the window and on standard error.
    void complain(const std::string& why);
    void draw();
    void ask(double now);
    void countRate(double now);
    bool startFlying();
    void takeFirstCamera();
    void logPicture(double now);

    const ViewWindowOptions options_;
    ViewHost window_;
    ViewLog log_; // after the window, so that without a display no file is opened
    ViewSession session_;
    ViewUi ui_;
    std::array<ViewTexture, 2> textures_;
    ViewTexture mapTexture_;
    ImVec2 pictureFrom_{0, 0}, pictureTo_{1, 1};
    double touched_ = 0, changed_ = -1e9; // seconds
    ImVec2 mouse_{0, 0};                  // where it was at the last event
    std::optional<ImVec2> pressed_;       // left button, since the last step: where
    std::optional<ImVec2> lookPressed_;   // right button
    bool isMoving_ = false, isSplitDragged_ = false, isLookDragged_ = false;
    bool wasRequestedMoving_ = false, isAskDue_ = false, isPictureNew_ = false;
    double dueSeconds_ = 0; // since when isAskDue_
    uint64_t serial_ = 0;
    size_t camera_ = 0; // the scene's, by C
    double rateStart_ = 0;
    int rateCount_ = 0;
    std::map<std::string, std::array<int, 4>> loggedLayout_;
    std::string loggedError_, loggedWork_;
    size_t failedSaveCount_ = 0; // of the status that was shown last
    std::optional<Demo> demo_;
    std::vector<TourStop> tour_;
    int loggedCaption_ = -1;
    float fontScale_ = 0; ///< of the fonts as they are
};

} // namespace shadowdag
