// SPDX-License-Identifier: Apache-2.0
// The window: GLFW for events, OpenGL to show the worker's pictures, Dear ImGui for the interface.
#pragma once

#include "tools/window/view_renderer.h"

#include <array>
#include <string>

namespace shadowdag {

/// The initial state of a window.
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
    double targetMs = 22; ///< time limit of a moving picture
    ViewOverlay overlay = ViewOverlay::kNone;
    uint32_t voxelLevel = 0;
    int light = -1; ///< of overlays; -1: any
    bool marksLights = false;
    bool wantsTruth = true;    ///< computed while the view rests
    float fontScale = 0;       ///< 0: the display's
    double captionSeconds = 0; ///< of the demo; 0: none
};

/// Opens the window and returns after it was closed. Throws Error kDevice with GLFW's message if no
/// window can be opened, kResource if the log cannot be written, Interrupted after SIGINT or
/// SIGTERM.
void runViewWindow(const ViewWindowOptions& options);

} // namespace shadowdag
