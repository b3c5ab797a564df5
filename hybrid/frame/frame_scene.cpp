// SPDX-License-Identifier: Apache-2.0
// Brings the world to the backend and keeps it current.
#include "hybrid/frame/frame_scene.h"

#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "hybrid/clusters/cluster_rays.h"
#include "hybrid/clusters/light_bvh.h"
#include "hybrid/frame/frame_device.h"
#include "voxel/dag_lod.h"
#include "voxel/wide_dag_trace.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <numeric>
#include <utility>

namespace shadowdag {

FrameScene::FrameScene(Backend asked, const World& world, const Dag& dag,
                       const BatchOptions& batchOptions)
    : backend_(passBackend(asked)), world_(world), hostDag_(dag), batchOptions_(batchOptions),
      batchSet_(world, batchOptions), movers_(backend_), geometry_(backend_, "world"),
      levelGeometry_(backend_, "polygon level"), lights_(backend_, "lights"),
      lightBoxes_(backend_, "light boxes"), lightItems_(backend_, "light items"),
      materials_(backend_, "materials"), triangleMaterial_(backend_, "triangle materials"),
      baseColors_(backend_), triangleInstance_(backend_, "triangle instances"),
      dagWords_(backend_, "dag words"), coveredWords_(backend_, "dag words with coverage"),
      bvhNodes_(backend_, "hierarchy of triangles"),
      bvhLeaves_(backend_, "leaves of the hierarchy of triangles") {
    for (const Material& material : world.scene().materials)
        hostMaterials_.push_back({material.baseColor, material.emission});
    materials_.set(hostMaterials_);
    triangleMaterial_.set(world.triangleMaterial());
    if (!world.baseColors().empty()) {
        baseColors_.set(world.baseColors());
        triangleInstance_.set(world.triangleInstance());
    }
    geometry_.set(world.triangles(), batchSet_.view());
    dagWords_.set(hostDag_.words);
    if (asked == Backend::kCpu)
        wideDag_ = buildWideDag(hostDag_);
    device_ =
        makeSceneDevice(asked, world_.triangles(), batchSet_.view().triangles, hostDag_.view());
    setMoving();
}

FrameScene::~FrameScene() = default;

void FrameScene::setMoving() {
    setLights();
    isFollowed_ = false;
    device_->setPositions(world_.triangles().positions);
}

void FrameScene::setLights() {
    const std::vector<Light>& lights = world_.lights();
    const auto areBytesEqual = [](const std::vector<Light>& a, const std::vector<Light>& b) {
        return a.size() == b.size() &&
               (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Light)) == 0);
    };
    if (areLightsSet_ && areBytesEqual(lights, setLights_))
        return;
    areLightsSet_ = false; // until all of them are
    setLights_ = lights;
    lights_.set(lights);
    if (isMutant(Mutant::kLightPulled)) {
        static std::vector<Light> pulled; // outlives the view
        pulled = world_.lights();
        pulled.front().positionWorld.x += 0.02f * pulled.front().rangeWorld;
        lights_.set(pulled);
    }
    hostLightBvh_ = buildLightBvh(world_.lights());
    lightBoxes_.set(hostLightBvh_.view().boxes);
    lightItems_.set(hostLightBvh_.view().items);
    areLightsSet_ = true;
}

void FrameScene::readMovers() {
    areMoversRead_ = true;
    followMotion();
}

void FrameScene::followMotion() {
    if (isFollowed_)
        return;
    const TruthSpace before = std::exchange(space_, truthSpaceOf(boundsOfPositions()));
    if (hasBvh_ && before.origin != space_.origin) {
        hasBvh_ = false; // built again if this fails
        moveToSpace(bvh_, before.origin, space_.origin);
        setBvh();
        hasBvh_ = true;
    }
    movers_.update(world_, batchSet_.view(), space_, triangles(), batches());
    isFollowed_ = true;
}

Box FrameScene::boundsOfPositions() {
    const View<const glm::vec3> positions = world_.triangles().positions;
    const std::vector<Instance>& instances = world_.instances();
    std::vector<Box> boxes(instances.size());
    const auto addAll = [&](Box& box, bool isMoving) {
        parallelFor<CpuTag>(
            instances.size(),
            [&](size_t i) {
                boxes[i] = Box{};
                if (instances[i].isMoving == isMoving)
                    for (uint32_t v = 0; v < instances[i].vertexCount; ++v)
                        boxes[i].add(positions[instances[i].firstVertex + v]);
            },
            8);
        for (const Box& of : boxes)
            box.add(of);
    };
    if (!hasStillBounds_)
        addAll(stillBounds_, false);
    hasStillBounds_ = true;
    Box bounds = stillBounds_;
    addAll(bounds, true);
    return bounds;
}

void FrameScene::update(const std::vector<uint32_t>& movedInstances, StageTimes& stages,
                        StageTimes& ofLevels, StageTimes& ofRays) {
    const bool wasCancelled = std::exchange(isUpdating_, true);
    const auto mark = [wasCancelled](std::vector<uint32_t>& all, const BatchSet& set) {
        if (wasCancelled) { // what that one moved is not known
            all.resize(set.size());
            std::iota(all.begin(), all.end(), 0u);
            return;
        }
        const std::vector<uint32_t>& moved = set.movedBatches();
        std::vector<uint32_t> both;
        both.reserve(all.size() + moved.size());
        std::set_union(all.begin(), all.end(), moved.begin(), moved.end(),
                       std::back_inserter(both));
        all = std::move(both);
    };
    batchSet_.update(world_, movedInstances, &stages);
    if (polygonLod_)
        polygonLod_->update(movedInstances, &ofLevels);
    for (MovedBatches* listener : listeners_) {
        mark(listener->full_, batchSet_);
        if (polygonLod_)
            mark(listener->levels_, polygonLod_->batchSet());
    }
    const bool areMoversRead = std::exchange(areMoversRead_, false);
    {
        const StageTimer timer(backend_, stages, "scene update");
        if (wasCancelled) { // what it changed is not known
            geometry_.set(world_.triangles(), batchSet_.view());
            if (polygonLod_)
                levelGeometry_.set(polygonLod_->triangles(), polygonLod_->batches(0.0f));
        } else {
            setMoved(movedInstances);
        }
        setMoving();
        isUpdating_ = false;
    }
    if (areMoversRead) {
        const StageTimer timer(backend_, ofRays, "scene update");
        followMotion();
    }
}

void FrameScene::setMoved(const std::vector<uint32_t>& movedInstances) {
    std::vector<ArrayRange> moved;
    for (const uint32_t i : movedInstances)
        moved.push_back({world_.instances()[i].firstVertex, world_.instances()[i].vertexCount});
    std::sort(moved.begin(), moved.end(),
              [](const ArrayRange& a, const ArrayRange& b) { return a.first < b.first; });
    geometry_.setMoved(world_.triangles(), batchSet_.view(), moved, batchSet_.movedRanges());
    if (polygonLod_) {
        const TriangleView levels = polygonLod_->triangles();
        levelGeometry_.setMoved(levels, polygonLod_->batches(0.0f), {{0, levels.positions.count}},
                                polygonLod_->batchSet().movedRanges());
    }
}

MapGeometry FrameScene::mapGeometry(float lodTexels) {
    if (!(lodTexels > 0.0f))
        return {world_.triangles(), hostBatches()};
    if (!polygonLod_) {
        auto made = std::make_unique<PolygonLod>(world_, batchOptions_);
        levelGeometry_.set(made->triangles(), made->batches(0.0f));
        polygonLod_ = std::move(made); // not before it is on the backend
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
    // Maps of the other kind are drawn again when they are requested next.
    std::vector<uint32_t> moved = std::move(lodTexels > 0.0f ? levels_ : full_);
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
        Dag made = withCoverage(hostDag_);
        coveredWords_.set(made.words);
        wideCoverage_ = wideCoverage(made, wideDag_);
        coveredDag_ = std::move(made); // its words stay in place
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

RayInputs FrameScene::rayInputs(const RayOptions& options, const RayDetail& detail, bool isTraced) {
    prepare(options);
    const DagView traced = dag();
    if (!options.believesNone() && options.level > traced.grid.resolutionLog2)
        throw Error(ErrorKind::kUsage, "level of detail " + std::to_string(options.level) +
                                           " of a voxel DAG of " +
                                           std::to_string(traced.grid.resolutionLog2) +
                                           " levels; use at most as many");
    return {options.lod == LodRule::kCoverage ? coveredDag() : traced,
            options,
            isTraced ? movers() : MoverView{},
            isTraced && options.asksExact() ? exact() : ExactView{},
            detail,
            embree_.get()};
}

RayInputs FrameScene::hostRayInputs(const RayOptions& options, const RayDetail& detail) {
    prepare(options);
    return {options.lod == LodRule::kCoverage ? hostCoveredDag() : hostDag(),
            options,
            hostMovers(),
            hostExact(),
            detail,
            embree_.get()};
}

void FrameScene::prepare(const RayOptions& options) {
    if (options.asksExact())
        prepareExact();
    if (options.triangleRays != TriangleRays::kEmbree || embree_)
        return;
    embree_ = std::make_unique<EmbreeScene>(world_.triangles(), viewOf(world_.staticTriangles()));
}

void FrameScene::prepareExact() {
    if (hasBvh_)
        return;
    followMotion();
    bvh_ = buildTriangleBvh(geometry(world_.triangles()), viewOf(world_.staticTriangles()));
    setBvh();
    hasBvh_ = true;
}

void FrameScene::setBvh() {
    bvhNodes_.set(bvh_.nodes);
    bvhLeaves_.set(bvh_.leaves);
}

uint64_t FrameScene::exactBytes() const {
    if (!hasBvh_)
        return 0;
    const TriangleView& all = world_.triangles();
    return bvh_.bytes() + all.positions.count * sizeof(glm::vec3) +
           all.triangles.count * sizeof(glm::uvec3);
}

MoverView FrameScene::movers() {
    readMovers();
    return movers_.view(geometry(triangles()), batches().batches, batches().triangles);
}

MoverView FrameScene::hostMovers() {
    readMovers();
    return movers_.hostView(geometry(world_.triangles()), batchSet_.view());
}

} // namespace shadowdag
