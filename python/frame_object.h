// SPDX-License-Identifier: Apache-2.0
// Frames in Python: classes Frame and Judgement, and the function that renders.
#pragma once

#include "python/frame_settings.h"
#include "python/scene_object.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag::python {

/// A frame with what it was rendered with. Its arrays stay; what needs the renderer (the truth, the
/// judge, single pairs) is there until the scene renders another frame, and what was asked of them
/// before stays.
struct FrameObject {
    std::shared_ptr<SceneObject> scene;
    RunParameters run;
    Camera camera;
    double exposure = 0;
    float timeSeconds = 0;
    std::string view;    ///< the same for frames with the same pairs
    uint64_t number = 0; ///< SceneObject::frameCount
    PairResults answers;
    std::optional<std::vector<uint8_t>> truth;
    std::optional<ErrorReport> report;

    const FrameResult& result() const { return answers.frame; }
};

/// Returns the lists of names of enumerations: verdicts and servers, in the order of their numbers.
std::vector<std::string> verdictNames();
std::vector<std::string> serverNames();

/// Adds class Frame, render(), frame_settings() and the names to the scope.
void addFrame(pybind11::module_& scope);

} // namespace shadowdag::python
