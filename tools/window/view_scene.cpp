// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_scene.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace shadowdag {

namespace {

/// Returns half of the machine's memory: the other half is for the open scene.
uint64_t memoryToBuildIn() {
    const long pages = sysconf(_SC_PHYS_PAGES), bytes = sysconf(_SC_PAGESIZE);
    return pages > 0 && bytes > 0 ? uint64_t(pages) * uint64_t(bytes) / 2 : 0;
}

} // namespace

uint32_t largestVoxelsLog2(uint32_t log2, uint64_t bytes, uint64_t memoryBytes) {
    constexpr uint32_t kLeast = 12, kMost = 17;
    uint32_t largest = kLeast;
    if (bytes == 0)
        return largest;
    const auto needed = [&](uint32_t at) {
        return 4.0 * double(bytes) * std::pow(4.0, double(at) - double(log2));
    };
    while (largest < kMost && needed(largest + 1) <= double(memoryBytes))
        ++largest;
    return largest;
}

void ViewScene::setBackend(Backend backend) {
    workspace.setBackend(backend);
    measured.reset();
}

void ViewScene::giveVoxels(const ViewSettings& settings, uint32_t resolutionLog2,
                           const std::string& asset, const Console& console) {
    VoxelSource source{{}, settings.cacheDirectory, settings.allowStale};
    if (!asset.empty())
        source.assetPaths.push_back(asset);
    workspace.replaceVoxels(
        std::move(obtainDags(workspace.scene(), {resolutionLog2}, source, console).front()));
    measured.reset();
    assetPath = asset;
}

void ViewScene::moveTo(uint32_t to, const Experiment& experiment) {
    workspace.setTime(experiment.timeOfFrame(to));
    frame = to;
}

CostModel& ViewScene::model(const ViewSide& side, const CostSource& costs) {
    const std::string text = methodOf(side.method).modelText(side.model);
    std::unique_ptr<CostModel>& kept = models[text];
    if (!kept) {
        std::unique_ptr<CostModel> made = makeCostModel(text);
        giveCalibration(*made, costs);
        kept = std::move(made);
    }
    return *kept;
}

Camera ViewScene::camera(const std::string& text) {
    if (text == "auto" || (text.empty() && world().cameras().empty()))
        return workspace.camera();
    if (text.starts_with("auto-"))
        return placed.try_emplace(text, text).first->second.at(world());
    return chooseCamera(world(), text);
}

ViewSceneInfo ViewScene::info(const Experiment& experiment) {
    const World& world = workspace.world();
    const Dag& dag = this->dag();
    ViewSceneInfo info;
    info.serial = serial;
    info.argument = workspace.scene().argument;
    info.triangleCount = world.triangles().count();
    info.voxelResolution = dag.isBuilt() ? dag.grid.resolution() : 0;
    info.voxelBytes = dag.words.size() * sizeof(uint32_t);
    if (dag.isBuilt())
        info.largestLog2 =
            largestVoxelsLog2(dag.grid.resolutionLog2, info.voxelBytes, memoryToBuildIn());
    info.lights = world.lights();
    // Of several with one name --camera finds the first; numbers and "auto" mean something else.
    for (const std::string& name : cameraNames(world))
        if (!name.empty() && name != "auto" && name.find(',') == std::string::npos &&
            std::find(info.cameras.begin(), info.cameras.end(), name) == info.cameras.end())
            info.cameras.push_back(name);
    info.cameraText = cameraText;
    info.camera = camera(cameraText);
    info.isPlaced = cameraText == "auto" || cameraText.starts_with("auto-") ||
                    (cameraText.empty() && world.cameras().empty());
    info.isCameraAnimated = isCameraAnimated(world, cameraText);
    info.bounds = world.boundsWorld();
    constexpr double kMostFrames = 1e6; // as --frames
    info.frameCount =
        uint32_t(std::min(std::floor(double(world.scene().durationSeconds()) * experiment.fps),
                          kMostFrames)) +
        1;
    return info;
}

} // namespace shadowdag
