// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/stability_stage.h"

#include "cuda/error.h"

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
                            "parts of such a scene cannot be shifted separately");
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

StabilityMethod::StabilityMethod(MatrixMethod method, const std::vector<std::string>& settings,
                                 uint32_t width)
    : setup_(cellSetup(settings)), model_(modelOf(method, setup_)) {
    setup_.frame.width = width;
    setup_.frame.height = std::max(width * 9 / 16, 1u);
}

StabilityFrame
StabilityMethod::measure(Workspace& workspace, Judge& judge, int frame,
                         const std::function<void(const ErrorInputs&)>& withInputs) const {
    FrameRenderer& renderer = workspace.renderer(setup_.resolutionLog2);
    if (!setup_.keepsFrames)
        renderer.reset();
    PairResults answers = pairResultsOf(renderer.render(workspace.camera(), *model_, setup_.frame),
                                        renderer, setup_.frame);
    StabilityFrame result;
    result.errors = judge.judge(frame, answers).total;
    if (withInputs)
        withInputs(errorInputs(workspace.world(), answers));
    result.frame = std::move(answers.frame);
    return result;
}

} // namespace shadowdag
