// SPDX-License-Identifier: Apache-2.0
// A failure scene prepared for all methods: world, voxels, truth, and a method's frame compared
// with the truth.
#pragma once

#include "cuda/error.h"
#include "hybrid/judge/error.h"
#include "scenes/fail_scenes.h"
#include "voxel/voxelize.h"

#include <memory>
#include <string>
#include <vector>

namespace shadowdag::test {

/// Returns the failure scene of that name. Throws Error kUsage for an unknown one.
inline FailScene failSceneOf(const std::string& name) {
    for (FailScene& scene : failScenes())
        if (scene.name == name)
            return scene;
    throw Error(ErrorKind::kUsage, "no failure scene is called " + name);
}

/// A method's frame and what is wrong with it.
struct FailOutcome {
    FrameResult frame;
    ErrorReport report;
    std::vector<uint8_t> truth; ///< per pair of the frame

    double pairs() const { return double(report.total.pairCount); }
    double falseShadowPercent() const {
        return 100.0 * double(report.total.falseShadowCount) / pairs();
    }
    double falseLightPercent() const {
        return 100.0 * double(report.total.falseLightCount) / pairs();
    }
    double acnePercent() const { return 100.0 * double(report.total.acneCount) / pairs(); }
};

/// The options that the bounds of these tests hold for: small, nine taps, pages of 64 texels, what
/// every light in range asks for, each frame from nothing; otherwise the defaults. (The matrix of
/// failures, scenes/studies/failures.json, has the defaults.)
inline FrameOptions failFrame() {
    FrameOptions options;
    options.width = 320;
    options.height = 180;
    options.maps.poolBytes = 128ull << 20;
    options.maps.pageTexels = 64;
    options.maps.taps = options.bias.taps = 9;
    options.maps.useStaticOptimization = false;
    options.pruning = PairPruning::kNone;
    return options;
}

class FailStage {
public:
    /// The scene at a time; its static triangles in 2^resolutionLog2 voxels an axis.
    FailStage(const FailScene& failScene, uint32_t resolutionLog2, float timeSeconds = 0.0f)
        : description(failScene), scene(makeFailScene(failScene)), world(scene, {}) {
        world.setTime(timeSeconds);
        dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                       gridAround(world.boundsWorld(), resolutionLog2));
        truth = std::make_unique<Truth>(world);
        renderer = std::make_unique<FrameRenderer>(Backend::kCpu, world, dag);
    }

    /// Renders from the scene's camera and holds every pair against the truth.
    FailOutcome run(const std::string& model, const FrameOptions& options = failFrame()) {
        renderer->reset();
        FailOutcome outcome{
            renderer->render(world.cameras().at(0), *makeCostModel(model), options), {}, {}};
        outcome.truth = truth->visibility(renderer->gbuffer(), world.lights(), outcome.frame.pairs);
        ErrorOptions judging;
        judging.nullSampleCount = 100;
        judging.rays = options.rays;
        judging.bias = options.bias;
        outcome.report =
            computeError(*renderer, outcome.frame, world, *truth, outcome.truth, judging);
        return outcome;
    }

    FailScene description;
    Scene scene;
    World world;
    Dag dag;
    std::unique_ptr<Truth> truth;
    std::unique_ptr<FrameRenderer> renderer;
};

/// A hall with a screen that has a gap, a plate that slides, lights on both sides.
inline FailScene hallWithScreen() {
    FailScene s{"hall-with-screen",
                "a screen with a gap between lights, and a plate that moves",
                {},
                {{{-3.0, 3.0, 0.5}, 12.0, 12.0},
                 {{3.0, 2.5, -0.5}, 12.0, 12.0},
                 {{0.5, 0.05, 2.0}, 6.0, 4.0}},
                {0, 6, 9},
                {0, 0, 0}};
    FailBox floor, left, right, plate;
    floor.center = {0.0, -0.1, 0.0};
    floor.half = {8.0, 0.1, 6.0};
    left.center = {0.0, 1.0, -1.7};
    left.half = {0.05, 1.0, 1.5};
    right.center = {0.0, 1.0, 1.7};
    right.half = {0.05, 1.0, 1.5};
    plate.center = {-2.0, 1.51, 0.0};
    plate.half = {0.6, 0.01, 0.6};
    plate.velocity = {0.75, 0.0, 0.0};
    s.boxes = {floor, left, right, plate};
    return s;
}

} // namespace shadowdag::test
