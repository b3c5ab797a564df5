// SPDX-License-Identifier: Apache-2.0
// The window's libraries: GLFW's window and its context, Dear ImGui.
#pragma once

#define GLFW_INCLUDE_NONE // epoxy declares OpenGL
#include <GLFW/glfw3.h>

#include <cstdint>

namespace shadowdag {

/// GLFW, its window with a context that is current, and Dear ImGui on both.
class ViewHost {
public:
    /// Throws Error kDevice with GLFW's message if no window can be opened.
    ViewHost(uint32_t width, uint32_t height);
    ~ViewHost();
    ViewHost(const ViewHost&) = delete;
    ViewHost& operator=(const ViewHost&) = delete;

    /// Call after the window's own callbacks are set: ImGui's callbacks forward to them.
    void startInterface();

    /// Returns how large the display's text is: 1 or, where pixels are small, more.
    float contentScale() const;
    /// Uploads the fonts again, after setFontScale.
    void refreshFonts();

    GLFWwindow* handle = nullptr;

private:
    bool hasInterface_ = false;
};

} // namespace shadowdag
