// SPDX-License-Identifier: Apache-2.0
// The window: GLFW for events, OpenGL to show what the worker rendered, Dear ImGui over it.
#pragma once

#include "tools/window/view_renderer.h"

#include <array>
#include <string>

namespace shadowdag {

/// What a window starts with.
struct ViewWindowOptions {
    ViewSettings settings;
    std::string scene; ///< "": none is open until one is dropped
    uint32_t resolutionLog2 = 10;
    std::string assetPath;               ///< "": voxels of that resolution
    uint32_t width = 1280, height = 720; ///< of the window, pixels
    std::array<ViewSide, 2> sides;
    bool isSplit = false;
    FrameOptions frame; ///< of the methods; the size is the window's
    uint32_t firstFrame = 0;
    std::string saveDirectory = ".";
    std::string logPath;  ///< "": none
    double targetMs = 22; ///< what a moving picture may take
};

/// Opens the window and returns when it was closed. Throws Error kDevice where no window can be
/// had, with GLFW's own message; kResource where the log cannot be written; Interrupted after
/// SIGINT or SIGTERM.
void runViewWindow(const ViewWindowOptions& options);

} // namespace shadowdag
