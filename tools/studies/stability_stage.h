// SPDX-License-Identifier: Apache-2.0
// A scene moved, scaled or turned, and judged frames of it by one method: the measurements of
// stability.
#pragma once

#include "tools/studies/cell_setup.h"
#include "tools/workspace/judge.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// The motion of a scene: parts are shifted first, then the whole is scaled, turned and shifted.
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
/// of directional lights stays. A light without an authored range still has none. The nodes store
/// floats, so the motion is exact to 2^-24 of its numbers; geometry, lights and camera share them.
/// Throws Error kUsage when a root carries more than one of mesh, light and camera while parts are
/// shifted separately.
Scene movedScene(const Scene& scene, const SceneMotion& motion);

/// One frame by one method, judged.
struct StabilityFrame {
    FrameResult frame;
    ErrorCounts errors;
};

/// A renderer of frames by one method with one choice of settings.
class StabilityMethod {
public:
    /// @param settings as rows of the matrix of failures have them (failures.h)
    /// @param width of the frame, pixels; it is 9/16 as high
    StabilityMethod(MatrixMethod method, const std::vector<std::string>& settings, uint32_t width);

    /// Renders a frame of the workspace's camera and judges it under a new frame number; calls
    /// withInputs with the inputs of the error analysis while they are valid.
    StabilityFrame measure(Workspace& workspace, Judge& judge, int frame = 0,
                           const std::function<void(const ErrorInputs&)>& withInputs = {}) const;

    const CellSetup& setup() const { return setup_; }
    CellSetup& setup() { return setup_; }

private:
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
};

} // namespace shadowdag
