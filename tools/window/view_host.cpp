// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_host.h"

#include "cuda/error.h"
#include "tools/window/view_display.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <string>

namespace shadowdag {

namespace {

std::string glfwComplaint() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? text : "no reason given";
}

} // namespace

ViewHost::ViewHost(uint32_t width, uint32_t height) {
    endWithTheDisplay();
    if (!glfwInit())
        throw Error(ErrorKind::kDevice, "cannot open a window: " + glfwComplaint() +
                                            "; a display is needed (DISPLAY), or use render");
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    handle = glfwCreateWindow(int(width), int(height), "ShadowDAG", nullptr, nullptr);
    if (handle == nullptr) {
        const std::string why = glfwComplaint();
        glfwTerminate();
        throw Error(ErrorKind::kDevice, "cannot open a window with OpenGL 3.3: " + why);
    }
    glfwMakeContextCurrent(handle);
    glfwSwapInterval(0); // the rate is limited below: a driver's own limit may be absent, or block
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr; // nothing remains
}

float ViewHost::contentScale() const {
    float scale = 1;
    glfwGetWindowContentScale(handle, &scale, nullptr);
    return std::max(1.0f, scale);
}

void ViewHost::refreshFonts() {
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
}

void ViewHost::startInterface() {
    ImGui_ImplGlfw_InitForOpenGL(handle, true);
    ImGui_ImplOpenGL3_Init("#version 330");
    hasInterface_ = true;
}

ViewHost::~ViewHost() {
    if (hasInterface_) {
        ImGui_ImplOpenGL3_Shutdown();
        ImGui_ImplGlfw_Shutdown();
    }
    ImGui::DestroyContext();
    glfwDestroyWindow(handle);
    glfwTerminate();
}

} // namespace shadowdag
