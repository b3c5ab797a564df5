// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/mechanisms_scene.h"

#include "scenes/builtin.h"
#include "tools/workspace/calibration.h"
#include "voxel/voxelize.h"

namespace shadowdag {

MechanismScene::MechanismScene(const std::string& argument, const MechanismsRequest& request)
    : request_(request), name_(argument), sequenceFrames_(request.sequenceFrames) {
    load(argument);
}

MechanismScene::MechanismScene(const Failure& failure, const MechanismsRequest& request)
    : request_(request), name_(failure.name), settings_(failure.always), isFailure_(true),
      startSeconds_(failure.startSeconds), sequenceFrames_(request.sequenceFrames) {
    if (failure.frameCount > 1) {
        stepSeconds_ = failure.stepSeconds;
        sequenceFrames_ = failure.frameCount - 1;
        startSeconds_ += failure.stepSeconds;
    }
    load("builtin:" + failure.scene);
}

void MechanismScene::load(const std::string& argument) {
    scene_ = std::make_unique<Scene>(loadScene(argument));
    world_ = std::make_unique<World>(*scene_, WorldOptions{});
    truth_ = std::make_unique<Truth>(*world_);
    camera_ = frameCamera_.at(*world_);
}

void MechanismScene::show(int frame) {
    const float time = float(startSeconds_ + frame * stepSeconds_);
    if (time != world_->timeSeconds()) {
        const std::vector<uint32_t> moved = world_->setTime(time);
        for (auto& [resolution, renderer] : renderers_)
            renderer->worldChanged(moved);
        isTruthStale_ |= !moved.empty();
    }
    camera_ = frameCamera_.at(*world_);
}

const Truth& MechanismScene::truth() {
    if (isTruthStale_)
        truth_->update(*world_);
    isTruthStale_ = false;
    return *truth_;
}

FrameRenderer& MechanismScene::renderer(uint32_t resolutionLog2) {
    Dag& dag = dags_[resolutionLog2];
    if (!dag.isBuilt())
        dag = voxelize(world_->triangles(), viewOf(world_->staticTriangles()),
                       sceneGrid(*world_, resolutionLog2));
    std::unique_ptr<FrameRenderer>& renderer = renderers_[resolutionLog2];
    if (!renderer)
        renderer = std::make_unique<FrameRenderer>(request_.backend, *world_, dag);
    return *renderer;
}

const MechanismTruth& MechanismScene::truthOf(int frame, const GBufferView& gbuffer,
                                              const PairList& pairs) {
    MechanismTruth& truth = truths_[frame];
    if (truth.display.empty()) {
        truth.visibility = this->truth().visibility(gbuffer, world_->lights(), pairs);
        const std::vector<glm::vec3> color = shadePairs(gbuffer, *world_, pairs, truth.visibility);
        truth.exposure = autoExposure(color);
        truth.display = toneMap(color, truth.exposure);
    }
    return truth;
}

ObservedFrame MechanismScene::observe(int frame) {
    show(60 * frame); // two seconds on
    FrameOptions options;
    options.width = request_.width;
    options.height = request_.height;
    options.maps.poolBytes = 1ull << 30;
    ObservedFrame observed =
        measureCalibrationFrame(renderer(request_.resolutionLog2), camera_, options, 1).observed;
    observed.scene = name_;
    observed.view = std::to_string(options.width) + "x" + std::to_string(options.height);
    observed.frame = uint32_t(frame);
    return observed;
}

} // namespace shadowdag
