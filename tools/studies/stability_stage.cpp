// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/stability_stage.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/voxelize.h"

#include <algorithm>

namespace shadowdag {

namespace {

int addNode(Scene& scene, const std::string& name, int parent) {
    Node node;
    node.name = name;
    node.parent = parent;
    scene.nodes.push_back(node);
    const int index = int(scene.nodes.size()) - 1;
    if (parent != kNone)
        scene.nodes[size_t(parent)].children.push_back(index);
    return index;
}

} // namespace

Scene movedScene(const Scene& scene, const SceneMotion& motion) {
    Scene moved = scene;
    const bool isApart =
        motion.geometryShift != motion.lightShift || motion.geometryShift != motion.cameraShift;
    const int whole = addNode(moved, "moved", kNone);
    LocalTransform& local = moved.nodes[size_t(whole)].local;
    local.translation = glm::vec3(motion.shift);
    local.rotation = glm::quat(motion.rotation);
    local.scale = glm::vec3(float(motion.scale));
    const glm::dvec3 shifts[3] = {motion.geometryShift, motion.lightShift, motion.cameraShift};
    const char* const names[3] = {"moved geometry", "moved lights", "moved cameras"};
    int parts[3];
    for (int i = 0; i < 3; ++i) {
        parts[i] = addNode(moved, names[i], whole);
        moved.nodes[size_t(parts[i])].local.translation = glm::vec3(shifts[i]);
    }
    for (const int root : scene.roots) {
        Node& node = moved.nodes[size_t(root)];
        const int kinds =
            int(node.mesh != kNone) + int(node.light != kNone) + int(node.camera != kNone);
        if (isApart && (kinds > 1 || !node.children.empty()))
            throw Error(ErrorKind::kUsage,
                        scene.name + ": root '" + node.name +
                            "' carries more than one of mesh, light and camera or has children; "
                            "parts of such a scene cannot be shifted apart");
        node.parent = parts[node.light != kNone ? 1 : node.camera != kNone ? 2 : 0];
        moved.nodes[size_t(node.parent)].children.push_back(root);
    }
    moved.roots = {whole};
    for (LightSource& light : moved.lights) {
        light.rangeWorld *= float(motion.scale);
        if (light.kind != Light::kSun)
            light.intensity *= float(motion.scale * motion.scale);
    }
    for (CameraSource& camera : moved.cameras) {
        camera.znear *= float(motion.scale);
        camera.zfar *= float(motion.scale);
    }
    return moved;
}

StabilityStage::StabilityStage(Scene scene, Backend backend)
    : backend_(backend), scene_(std::move(scene)), world_(scene_, {}), truth_(world_),
      camera_(chooseCamera(world_, "")) {}

void StabilityStage::show(double timeSeconds) {
    if (float(timeSeconds) == world_.timeSeconds())
        return;
    const std::vector<uint32_t> moved = world_.setTime(float(timeSeconds));
    for (auto& [key, renderer] : renderers_)
        renderer->worldChanged(moved);
    if (!moved.empty())
        truth_.update(world_);
    if (!world_.cameras().empty())
        camera_ = world_.cameras().front();
}

VoxelGrid StabilityStage::grid(uint32_t resolutionLog2) const {
    return sceneGrid(world_, resolutionLog2);
}

FrameRenderer& StabilityStage::renderer(uint32_t resolutionLog2) {
    Dag& dag = dags_[resolutionLog2];
    if (!dag.isBuilt())
        dag = voxelize(world_.triangles(), viewOf(world_.staticTriangles()), grid(resolutionLog2));
    std::unique_ptr<FrameRenderer>& renderer = renderers_[resolutionLog2];
    if (!renderer)
        renderer = std::make_unique<FrameRenderer>(backend_, world_, dag);
    return *renderer;
}

void StabilityStage::drop(uint32_t resolutionLog2) {
    renderers_.erase(resolutionLog2);
    dags_.erase(resolutionLog2);
}

StabilityMethod::StabilityMethod(MatrixMethod method, const std::vector<std::string>& settings,
                                 uint32_t width)
    : setup_(cellSetup(settings)), model_(modelOf(method, setup_)) {
    setup_.frame.width = width;
    setup_.frame.height = std::max(width * 9 / 16, 1u);
}

StabilityFrame
StabilityMethod::measure(StabilityStage& stage, std::vector<uint8_t>& truth,
                         const std::function<void(const ErrorInputs&)>& withInputs) const {
    FrameRenderer& renderer = stage.renderer(setup_.resolutionLog2);
    if (!setup_.keepsFrames)
        renderer.reset();
    StabilityFrame result;
    result.frame = renderer.render(stage.camera(), *model_, setup_.frame);
    const GBufferView gbuffer = renderer.gbuffer();
    if (truth.empty())
        truth = stage.truth().visibility(gbuffer, stage.world().lights(), result.frame.pairs);
    const ErrorInputs inputs{
        gbuffer,
        stage.world().triangles(),
        viewOf(stage.world().lights()),
        result.frame.pairs,
        result.frame.visibility,
        result.frame.pairRoute,
        result.frame.pairServer,
        {renderer.rayInputs(setup_.frame.rays), renderer.shadowMaps(), setup_.frame.bias}};
    ErrorOptions options;
    options.nullSampleCount = 0;
    options.rays = setup_.frame.rays;
    options.bias = setup_.frame.bias;
    result.errors = computeError(inputs, stage.truth(), truth, options).total;
    if (withInputs)
        withInputs(inputs);
    return result;
}

} // namespace shadowdag
