// SPDX-License-Identifier: Apache-2.0
// A scene moved, scaled or turned, and frames of it by one method, judged: what stability is
// measured by.
#pragma once

#include "tools/studies/cell_setup.h"
#include "tools/workspace/judge.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// What is done to a scene: parts are shifted first, then the whole is scaled, turned and shifted.
struct SceneMotion {
    glm::dvec3 geometryShift{0.0}, lightShift{0.0}, cameraShift{0.0}; ///< scene units
    double scale = 1.0;
    glm::dquat rotation{1, 0, 0, 0};
    glm::dvec3 shift{0.0}; ///< world units

    bool operator==(const SceneMotion&) const = default;
};

/// Returns the scene moved: every root under a node that shifts its part (geometry, light or
/// camera), all of them under one that scales, turns and shifts the whole. Ranges of lights, near
/// and far planes are scaled as lengths are, candela by the square, so that irradiance stays; lux
/// of suns stays. A light without an authored range has none afterwards either. The nodes hold
/// floats, so the motion is the one asked for to 2^-24 of its numbers; geometry, lights and camera
/// share them. Throws Error kUsage when a root carries more than one of mesh, light and camera
/// while parts are shifted apart.
Scene movedScene(const Scene& scene, const SceneMotion& motion);

/// One frame by one method, judged.
struct StabilityFrame {
    FrameResult frame;
    ErrorCounts errors;
};

/// What renders frames of one method with one choice of settings.
class StabilityMethod {
public:
    /// @param settings as rows of the matrix of failures have them (failures.h)
    /// @param width of the frame, pixels; it is 9/16 as high
    StabilityMethod(MatrixMethod method, const std::vector<std::string>& settings, uint32_t width);

    /// Renders a frame of the workspace's camera and judges it under a number of its own; calls
    /// withInputs with what the error analysis took, while it is valid.
    StabilityFrame measure(Workspace& workspace, Judge& judge, int frame = 0,
                           const std::function<void(const ErrorInputs&)>& withInputs = {}) const;

    const CellSetup& setup() const { return setup_; }
    CellSetup& setup() { return setup_; }

private:
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
};

} // namespace shadowdag
