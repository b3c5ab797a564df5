// SPDX-License-Identifier: Apache-2.0
// A scene moved, scaled or turned, with its world, truth, voxels and renderers: where stability is
// measured.
#pragma once

#include "hybrid/judge/error.h"
#include "scenes/fail_scenes.h"
#include "tools/studies/failures.h"

#include <map>
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

/// A scene with voxels and renderers, made when first asked for, and the truth, all at one time.
class StabilityStage {
public:
    StabilityStage(Scene scene, Backend backend);

    void show(double timeSeconds);
    /// Returns the renderer over voxels of this resolution.
    FrameRenderer& renderer(uint32_t resolutionLog2);
    /// Returns the grid of these voxels.
    VoxelGrid grid(uint32_t resolutionLog2) const;
    /// Forgets voxels and renderers of a resolution.
    void drop(uint32_t resolutionLog2);

    const World& world() const { return world_; }
    const Truth& truth() const { return truth_; }
    const Camera& camera() const { return camera_; }

private:
    Backend backend_;
    Scene scene_;
    World world_;
    Truth truth_;
    Camera camera_;
    std::map<uint32_t, Dag> dags_;
    std::map<uint32_t, std::unique_ptr<FrameRenderer>> renderers_;
};

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

    /// Renders a frame of the stage's camera and judges it; calls withInputs with what the error
    /// analysis took, while it is valid.
    /// @param truth what Embree answers to the frame's pairs; asked for when empty, then kept there
    StabilityFrame measure(StabilityStage& stage, std::vector<uint8_t>& truth,
                           const std::function<void(const ErrorInputs&)>& withInputs = {}) const;

    const CellSetup& setup() const { return setup_; }
    CellSetup& setup() { return setup_; }

private:
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
};

} // namespace shadowdag
