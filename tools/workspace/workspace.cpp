// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/workspace.h"

#include "cuda/error.h"
#include "voxel/voxelize.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace shadowdag {

Workspace::Workspace(LoadedScene scene, WorkspaceOptions options)
    : scene_(std::move(scene)), options_(std::move(options)),
      camera_(options_.camera, options_.viewCount) {
    SDAG_ASSERT(!options_.voxels || options_.console != nullptr);
}

Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

void Workspace::setView(const std::string& camera, const std::string& name) {
    camera_.use(camera);
    scene_.name = name;
    resetRenderers();
}

Dag Workspace::obtain(uint32_t resolutionLog2) const {
    checkInterrupted();
    if (options_.voxels)
        return cachedDag(scene_, resolutionLog2, *options_.voxels, *options_.console);
    return voxelize(world().triangles(), viewOf(world().staticTriangles()), grid(resolutionLog2),
                    options_.console ? options_.console->progress("voxelize " + scene_.name)
                                     : Progress{});
}

std::vector<uint32_t> Workspace::obtainVoxels(const std::vector<uint32_t>& resolutionLog2) {
    std::vector<uint32_t> found;
    if (options_.voxels && !options_.voxels->assetPaths.empty()) {
        for (Dag& dag : obtainDags(scene_, {}, *options_.voxels, *options_.console)) {
            found.push_back(dag.grid.resolutionLog2);
            drop(found.back());
            voxels_[found.back()].dag = std::make_unique<Dag>(std::move(dag));
        }
    } else {
        found = resolutionLog2;
        for (const uint32_t log2 : found)
            dag(log2);
    }
    if (!found.empty())
        firstVoxels_ = found.front();
    return found;
}

Workspace::Voxels& Workspace::voxels(uint32_t resolutionLog2) {
    const auto found = voxels_.find(resolutionLog2);
    if (found != voxels_.end())
        return found->second;
    Voxels made;
    made.dag = std::make_unique<Dag>(resolutionLog2 == kNoVoxels ? Dag{} : obtain(resolutionLog2));
    return voxels_.emplace(resolutionLog2, std::move(made)).first->second;
}

const Dag& Workspace::dag(uint32_t resolutionLog2) {
    return *voxels(resolutionLog2).dag;
}

std::unique_ptr<FrameRenderer> Workspace::makeRenderer(Backend backend, const Dag& dag) const {
    checkInterrupted();
    std::shared_ptr<void> step; // a hierarchy of many triangles takes long, and so may a driver
    if (options_.console)
        step = options_.console->step(backend == Backend::kGl ? "compile the shaders of OpenGL"
                                                              : "prepare " + scene_.name);
    return std::make_unique<FrameRenderer>(backend, world(), dag);
}

void Workspace::replaceVoxels(Dag dag) {
    Voxels made;
    made.dag = std::make_unique<Dag>(std::move(dag));
    made.renderers.push_back(makeRenderer(options_.backend, *made.dag));
    voxels_.clear();
    firstVoxels_ = made.dag->isBuilt() ? made.dag->grid.resolutionLog2 : kNoVoxels;
    voxels_.emplace(firstVoxels_, std::move(made));
}

void Workspace::drop(uint32_t resolutionLog2) {
    voxels_.erase(resolutionLog2);
}

void Workspace::setBackend(Backend backend) {
    std::map<uint32_t, std::unique_ptr<FrameRenderer>> made;
    for (const auto& [resolutionLog2, of] : voxels_)
        if (!of.renderers.empty())
            made[resolutionLog2] = makeRenderer(backend, *of.dag);
    for (auto& [resolutionLog2, renderer] : made) {
        Voxels& of = voxels_.at(resolutionLog2);
        of.renderers.clear();
        of.renderers.push_back(std::move(renderer));
        of.moved.clear();
        of.isReported = true;
    }
    options_.backend = backend;
}

FrameRenderer& Workspace::renderer(uint32_t resolutionLog2, size_t role) {
    Voxels& of = voxels(resolutionLog2);
    if (of.renderers.empty())
        of.renderers.push_back(makeRenderer(options_.backend, *of.dag));
    if (role >= of.renderers.size())
        of.renderers.resize(role + 1);
    std::unique_ptr<FrameRenderer>& renderer = of.renderers[role];
    if (!renderer)
        renderer = of.renderers.front()->shareScene();
    return *renderer;
}

uint32_t Workspace::voxelsOf(const RunParameters& run) const {
    return run.resolution > 0 && run.usesVoxels() ? uint32_t(std::countr_zero(run.resolution))
                                                  : firstVoxels_;
}

void Workspace::setTime(float timeSeconds) {
    const bool areAllReported = std::all_of(voxels_.begin(), voxels_.end(),
                                            [](const auto& of) { return of.second.isReported; });
    if (timeSeconds != world().timeSeconds() || !areAllReported)
        advance(timeSeconds);
}

void Workspace::advance(float timeSeconds) {
    const std::vector<uint32_t> moved = scene_.world->setTime(timeSeconds);
    isTruthStale_ = isTruthStale_ || !moved.empty();
    for (auto& [resolutionLog2, of] : voxels_) {
        of.followTimes = {};
        if (of.renderers.empty())
            continue;
        of.isReported = false; // lights alone may have moved
        of.moved.insert(of.moved.end(), moved.begin(), moved.end());
    }
    for (auto& [resolutionLog2, of] : voxels_) {
        if (of.renderers.empty())
            continue;
        of.renderers.front()->queueWorldChange( // for all that share the scene
            of.moved, of.followTimes.stages, of.followTimes.ofLevels, of.followTimes.ofRays);
        of.moved.clear();
        of.isReported = true;
    }
}

void FollowTimes::addTo(StageTimes& times, const RunParameters& run) const {
    const auto add = [&](const StageTimes& part) {
        for (const auto& [name, timeMs] : part.stagesMs)
            times.add(name, timeMs);
        for (const StageTimes::Pending& one : part.pending)
            times.add(one.stage, one.waitMs());
    };
    add(stages);
    if (run.frame.maps.lodTexels > 0.0f)
        add(ofLevels);
    if (const MethodNeeds& needs = run.kind().needs(); needs.rays || needs.embree)
        add(ofRays);
}

const FollowTimes& Workspace::followTimes(uint32_t resolutionLog2) {
    return voxels(resolutionLog2).followTimes;
}

void Workspace::resetRenderers() {
    for (auto& [resolutionLog2, of] : voxels_)
        for (const std::unique_ptr<FrameRenderer>& renderer : of.renderers)
            if (renderer)
                renderer->reset();
}

const Truth& Workspace::truth() {
    if (!truth_) {
        checkInterrupted();
        truth_ = std::make_unique<Truth>(world());
    } else if (isTruthStale_) {
        truth_->update(world());
    }
    isTruthStale_ = false;
    return *truth_;
}

} // namespace shadowdag
