// SPDX-License-Identifier: Apache-2.0
// Writes a view as files: the picture, its channels, and the experiment that renders it again.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/window/view_renderer.h"
#include "tools/workspace/frame_channels.h"

#include <string>
#include <vector>

namespace shadowdag {

/// All data that go into the files of one view.
struct ViewFiles {
    const ViewPicture& view;
    const Experiment& experiment; ///< what the window was started with
    std::string scene;            ///< SCENE
    const Dag& dag;
    float exposure; ///< that the picture was shown with
    std::vector<ExrChannel> channels;
};

/// Returns the experiment that renders a view again: its scene, size, camera, exposure, frame,
/// methods and parameters.
Experiment experimentOf(const ViewRequest& request, const Experiment& base,
                        const std::string& scene, const Dag& dag, float exposure);

/// Writes view-NNNN.png, .exr and .experiment.json under the first number of which none exists;
/// split pictures side by side in the .png as displayed, and the second side's channels with names
/// that start with "right.". Throws Error kResource naming the file.
SavedView writeView(const ViewFiles& files, const std::string& directory);

} // namespace shadowdag
