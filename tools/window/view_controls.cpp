// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_controls.h"

#include "tools/settings/setting.h"

#include <stdexcept>

namespace shadowdag {

namespace {

/// Returns the controls that are not one setting each; they quote the settings that they belong to.
std::vector<ViewControl> ownControls() {
    const auto helpOf = [](const char* option) { return settingOf(option).help; };
    return {
        {"path",
         "Open a scene (.glb, .gltf, builtin:NAME), voxels (.svdag) or costs (.json): type a path "
         "and press Enter, or drop the file on the window",
         "SCENE, --voxels, --costs", ""},
        {"overlay", "What the picture shows instead of the lit scene", "--show", "O, Shift+O"},
        {"level", "Size of the cells that are shown: 2^level voxels", "--level", ""},
        {"light",
         "The light that is shown by resolutions, pages, projection maps, ray steps and the map "
         "below; any: the one with most samples, or the most of all",
         "--light", ""},
        {"lights", "Mark every light and the sphere that it reaches", "--mark-lights", "L"},
        {"freeze", "Keep the frame of this camera, and look at it from elsewhere", "", "F"},
        {"truth",
         "While the view rests, compute Embree's answer for every pair and count the wrong ones",
         "--no-truth", ""},
        {"exposure", "Stops on top of the exposure. " + helpOf("--exposure"), "--exposure", ""},
        {"play", "Play the scene's animations. " + helpOf("--fps"), "--fps", "Space"},
        {"frame", "The frame that is shown", "--frames", "comma, period"},
        {"save", "Write the picture as PNG and EXR, and the experiment that renders it again",
         "--save-to", "F12"},
        {"left", "Method of the picture, or of its left side", "--method", "1 to 5"},
        {"split", "Compare two methods; drag the line between them", "--right", "Tab"},
        {"right", "Method of the right side", "--right", "Shift+1 to 5"},
        {"model",
         "Which maps the hybrid replaces by rays: those with fewer texels than a threshold, or "
         "those that measured or fitted costs, or an expression, say",
         "--model", ""},
        {"threshold", "Maps that need fewer texels are replaced by rays; 0 is maps alone",
         "--model texels:N", "[ and ]"},
        {"expression", "Maps for which this is true are replaced by rays",
         "--model expr:EXPRESSION", ""},
        {"voxels", helpOf("--resolution"), "--resolution", ""},
        {"backend", "Where frames are rendered: the processor, OpenGL or CUDA", "--backend", ""},
        {"static",
         "Keep the maps of what stands still from one picture to the next while the view moves; a "
         "view at rest is rendered without",
         "", ""},
    };
}

} // namespace

const std::vector<ViewControl>& viewControls() {
    static const std::vector<ViewControl> kControls = [] {
        std::vector<ViewControl> controls = ownControls();
        for (const Setting* setting : frameSettings())
            if (!setting->choices.empty())
                controls.push_back({setting->panelLabel, setting->help, setting->option, ""});
        return controls;
    }();
    return kControls;
}

std::string tooltipOf(const std::string& name) {
    for (const ViewControl& control : viewControls()) {
        if (control.name != name)
            continue;
        std::string text =
            control.help + "\n\nOption: " + (control.option.empty() ? "none" : control.option);
        if (!control.key.empty())
            text += "\nKey: " + control.key;
        return text;
    }
    throw std::logic_error("the panel has no control '" + name + "'");
}

} // namespace shadowdag
