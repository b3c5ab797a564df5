// SPDX-License-Identifier: Apache-2.0
// Brings the world to the backend and keeps it current.
#include "hybrid/frame/frame_scene.h"

#include "hybrid/clusters/light_bvh.h"
#include "hybrid/gl/frame_gl.h"
#include "voxel/dag_lod.h"
#include "voxel/wide_dag_trace.h"

#include <utility>

namespace shadowdag {

FrameScene::FrameScene(Backend asked, const World& world, const Dag& dag,
                       const BatchOptions& batchOptions)
    : FrameScene(passBackend(asked), world, dag, batchOptions, asked == Backend::kGl) {}

FrameScene::FrameScene(Backend backend, const World& world, const Dag& dag,
                       const BatchOptions& batchOptions, bool isGl)
    : backend_(backend), world_(world), hostDag_(dag), batchOptions_(batchOptions),
      batchSet_(world, batchOptions), movers_(backend), geometry_(backend, "world"),
      levelGeometry_(backend, "polygon level"), lights_(backend, "lights"),
      lightBoxes_(backend, "light boxes"), lightItems_(backend, "light items"),
      materials_(backend, "materials"), triangleMaterial_(backend, "triangle materials"),
      dagWords_(backend, "dag words"), coveredWords_(backend, "dag words with coverage"),
      exactWords_(backend, "triangles near voxels") {
    for (const Material& material : world.scene().materials)
        hostMaterials_.push_back({material.baseColor, material.emission});
    materials_.set(hostMaterials_);
    triangleMaterial_.set(world.triangleMaterial());
    geometry_.set(world.triangles(), batchSet_.view());
    dagWords_.set(hostDag_.words);
    if (isGl)
        gl_ = std::make_unique<GlScene>(world_.triangles(), batchSet_.view().triangles,
                                        hostDag_.view());
    else if (backend == Backend::kCpu)
        wideDag_ = buildWideDag(hostDag_);
    setMoving();
}

FrameScene::~FrameScene() = default;

void FrameScene::setMoving() {
    lights_.set(world_.lights());
    hostLightBvh_ = buildLightBvh(world_.lights());
    lightBoxes_.set(hostLightBvh_.view().boxes);
    lightItems_.set(hostLightBvh_.view().items);
    space_ = truthSpaceOf(world_.triangles().positions);
    movers_.update(world_, batchSet_.view(), space_);
    if (gl_)
        gl_->setPositions(world_.triangles().positions);
}

void FrameScene::update(const std::vector<uint32_t>& movedInstances, StageTimes& stages,
                        StageTimes& ofLevels) {
    const auto mark = [](std::vector<bool>& all, const BatchSet& set) {
        all.resize(set.view().batches.count, false);
        for (const uint32_t batch : set.movedBatches())
            all[batch] = true;
    };
    batchSet_.update(world_, movedInstances, &stages);
    if (polygonLod_)
        polygonLod_->update(movedInstances, &ofLevels);
    for (MovedBatches* listener : listeners_) {
        mark(listener->full_, batchSet_);
        if (polygonLod_)
            mark(listener->levels_, polygonLod_->batchSet());
    }
    const StageTimer timer(backend_, stages, "scene update");
    geometry_.setMoved(world_.triangles(), batchSet_.view());
    if (polygonLod_)
        levelGeometry_.setMoved(polygonLod_->triangles(), polygonLod_->batches(0.0f));
    setMoving();
}

MapGeometry FrameScene::mapGeometry(float lodTexels) {
    if (!(lodTexels > 0.0f))
        return {world_.triangles(), hostBatches()};
    if (!polygonLod_) {
        polygonLod_ = std::make_unique<PolygonLod>(world_, batchOptions_);
        levelGeometry_.set(polygonLod_->triangles(), polygonLod_->batches(0.0f));
    }
    return {polygonLod_->triangles(), polygonLod_->batches(lodTexels)};
}

MapGeometry FrameScene::mapGeometryOnBackend(float lodTexels) {
    const BatchView host = mapGeometry(lodTexels).batches;
    const ResidentGeometry& resident = lodTexels > 0.0f ? levelGeometry_ : geometry_;
    return {resident.triangles(), resident.batches(host)};
}

MovedBatches::MovedBatches(FrameScene& scene) : scene_(scene) {
    scene_.listeners_.push_back(this);
}

MovedBatches::~MovedBatches() {
    std::erase(scene_.listeners_, this);
}

std::vector<uint32_t> MovedBatches::take(float lodTexels) {
    // Maps of the other kind are drawn anew when they are asked for next.
    const std::vector<bool>& all = lodTexels > 0.0f ? levels_ : full_;
    std::vector<uint32_t> moved;
    for (size_t batch = 0; batch < all.size(); ++batch)
        if (all[batch])
            moved.push_back(uint32_t(batch));
    full_.clear();
    levels_.clear();
    return moved;
}

WideBvhView FrameScene::lightBvh() const {
    WideBvhView view = hostLightBvh_.view();
    view.boxes = lightBoxes_.view();
    view.items = lightItems_.view();
    return view;
}

DagView FrameScene::hostCoveredDag() {
    if (coveredDag_.empty() && !hostDag_.empty()) {
        coveredDag_ = withCoverage(hostDag_);
        coveredWords_.set(coveredDag_.words);
        wideCoverage_ = wideCoverage(coveredDag_, wideDag_);
    }
    DagView view{viewOf(coveredDag_.words), hostDag_.rootAddress, hostDag_.grid, wideDag_.view()};
    view.wide.coverage = viewOf(wideCoverage_);
    return view;
}

DagView FrameScene::coveredDag() {
    DagView view = hostCoveredDag();
    view.words = coveredWords_.view();
    return view;
}

DagView FrameScene::dag() const {
    return {dagWords_.view(), hostDag_.rootAddress, hostDag_.grid, wideDag_.view()};
}

void FrameScene::prepareExact() {
    if (hasTree_)
        return;
    tree_ = buildTriangleTree(world_.triangles(), viewOf(world_.staticTriangles()), hostDag_.grid);
    exactWords_.set(tree_.words);
    hasTree_ = true;
}

MoverView FrameScene::movers() const {
    return movers_.view(geometry(triangles()), batches().batches, batches().triangles);
}

MoverView FrameScene::hostMovers() const {
    return movers_.hostView(geometry(world_.triangles()), batchSet_.view());
}

} // namespace shadowdag
