// SPDX-License-Identifier: Apache-2.0
// Measures all methods on a grown scene: builds, bytes, errors, times in turn.
#include "tools/studies/cell_setup.h"
#include "tools/studies/scale.h"

#include "cuda/error.h"
#include "cuda/process_memory.h"
#include "cuda/quantile_interval.h"
#include "tools/settings/console.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/timing.h"
#include "voxel/memory_limit.h"

#include <algorithm>
#include <chrono>
#include <optional>

namespace shadowdag {

namespace {

constexpr uint64_t kScaleSeed = 1; ///< of placed lights
/// The part of a frame's time that shadows take, as a stage.
constexpr const char* kShadowStage = "shadows";

/// Who answers the pairs of a frame.
struct ScaleMethod {
    std::string name;
    MatrixMethod method;
    TriangleRays triangleRays = TriangleRays::kExact;
    uint32_t resolutionLog2 = kNoVoxels;
    FrameStart start = FrameStart::kCold;

    /// Returns the renderer's role: frames that follow each other keep their state in one of their
    /// own.
    size_t role() const { return start == FrameStart::kWarm ? 1 : 0; }
};

std::vector<ScaleMethod> methodsOf(const ScaleRow& row) {
    std::vector<ScaleMethod> methods = {
        {"embree", MatrixMethod::kDagNone, TriangleRays::kEmbree},
        {"exact rays", MatrixMethod::kDagNone},
    };
    for (const uint32_t log2 : row.resolutionLog2)
        methods.push_back({"voxels " + std::to_string(1u << log2), MatrixMethod::kDagAll,
                           TriangleRays::kExact, log2});
    methods.push_back({"maps cold", MatrixMethod::kMaps});
    methods.push_back(
        {"maps warm", MatrixMethod::kMaps, TriangleRays::kExact, kNoVoxels, FrameStart::kWarm});
    return methods;
}

/// A scene before it grows.
struct BaseScene {
    LoadedScene scene;
    bool arePlaced; ///< its lights, because it has none that shine
};

/// Returns the row's scene with lights: its own, or, if it has none, placed ones.
BaseScene loadBase(const ScaleTable& table, const ScaleRow& row, const Console& console) {
    LoadedScene scene =
        loadSceneAndWorld(row.scene, -1, kScaleSeed, table.placedLightCount == 0, console);
    if (!scene.world->lights().empty())
        return {std::move(scene), false};
    return {loadSceneAndWorld(row.scene, int(table.placedLightCount), kScaleSeed, true, console),
            true};
}

/// Replaces a scene's lights by placed ones, which a grown world would place elsewhere.
void authorPointLights(Scene& scene, const std::vector<Light>& lights) {
    for (Node& node : scene.nodes)
        node.light = kNone;
    scene.lights.clear();
    for (const Light& light : lights) {
        LightSource source;
        source.color = light.intensity;
        source.rangeWorld = light.rangeWorld;
        Node node;
        node.local.translation = light.positionWorld;
        node.light = int(scene.lights.size());
        scene.lights.push_back(source);
        scene.roots.push_back(int(scene.nodes.size()));
        scene.nodes.push_back(node);
    }
}

double secondsSince(std::chrono::steady_clock::time_point start) {
    return 1e-3 * msSince(start);
}

/// A scene at one number of triangles.
class GrownScene {
public:
    GrownScene(const ScaleTable& table, const ScaleRow& row, const BaseScene& base, uint64_t step,
               const StudyRequest& request)
        : table_(table), row_(row), camera_(chooseCamera(*base.scene.world, row.camera)),
          workspace_(grow(row, base, step, growSeconds_), {request.backend, "", {}}),
          judge_(workspace_) {}

    const World& world() const { return workspace_.world(); }
    double growSeconds() const { return growSeconds_; }
    uint64_t pairCount() const { return pairs_.count(); }

    /// Finds the frame's pairs and the truth about them.
    void prepareTruth() {
        const CellSetup setup = setupOf({"", MatrixMethod::kDagNone}).first;
        FrameRenderer& renderer = workspace_.renderer(kNoVoxels);
        pairs_ = renderer.listPairs(camera_, setup.frame);
        fewPairsWarning(row_.name, pairs_.count());
        judge_.truth(0, renderer.gbuffer(), pairs_);
    }

    /// Builds what a method reads, times that, and judges its frame. Returns its cell without
    /// times.
    Json measure(const ScaleMethod& method) {
        checkInterrupted();
        const auto [setup, model] = setupOf(method);
        const double buildSeconds = build(method, setup);
        FrameRenderer& renderer = rendererOf(method);
        const FrameResult frame = renderFrom(renderer, camera_, *model, setup.frame);
        const ErrorCounts errors =
            countWrong(frame.pairs, frame.visibility,
                       judge_.truth(0, renderer.gbuffer(), frame.pairs).visibility);
        return {
            {"method", method.name},
            {"resolution", method.resolutionLog2 == kNoVoxels ? 0u : 1u << method.resolutionLog2},
            {"build_s", buildSeconds},
            {"bytes", bytesOf(method, renderer, frame)},
            {"pair_count", frame.pairs.count()},
            {"false_shadow_count", errors.falseShadowCount},
            {"false_light_count", errors.falseLightCount}};
    }

    /// Renders a frame of a method that measure() has rendered one of, and returns its time: of
    /// shadows, and of all else.
    StageTimes time(const ScaleMethod& method) {
        checkInterrupted();
        auto [setup, model] = setupOf(method);
        setup.frame.recordPairs = setup.frame.recordQuantities = false;
        FrameRenderer& renderer = rendererOf(method);
        if (method.start == FrameStart::kCold)
            renderer.reset();
        const StageTimes stages = renderer.render(camera_, *model, setup.frame).stages;
        const double shadowMs = servingMs(stages);
        StageTimes parts;
        parts.add(kShadowStage, shadowMs);
        parts.add("other", stages.totalMs() - shadowMs);
        return parts;
    }

private:
    FrameRenderer& rendererOf(const ScaleMethod& method) {
        return workspace_.renderer(method.resolutionLog2, method.role());
    }

    static LoadedScene grow(const ScaleRow& row, const BaseScene& base, uint64_t step,
                            double& seconds) {
        const auto start = std::chrono::steady_clock::now();
        Scene scene = grownScene(*base.scene.world, row.growth, step, row.leaves);
        if (base.arePlaced)
            authorPointLights(scene, base.scene.world->lights());
        seconds = secondsSince(start);
        return loadedScene(std::move(scene));
    }

    std::pair<CellSetup, std::unique_ptr<CostModel>> setupOf(const ScaleMethod& method) const {
        CellSetup setup = cellSetup({table_.settings});
        setup.frame.width = table_.width;
        setup.frame.height = table_.height;
        setup.frame.start = method.start;
        std::unique_ptr<CostModel> model = modelOf(method.method, setup);
        setup.frame.rays.triangleRays = method.triangleRays;
        return {std::move(setup), std::move(model)};
    }

    /// Returns the seconds that the method's own structures take to build.
    double build(const ScaleMethod& method, const CellSetup& setup) {
        const bool hasVoxels = method.resolutionLog2 != kNoVoxels;
        FrameRenderer* renderer = hasVoxels ? nullptr : &workspace_.renderer(kNoVoxels);
        const auto start = std::chrono::steady_clock::now();
        if (hasVoxels) {
            const Dag& dag = workspace_.dag(method.resolutionLog2);
            const WideDag wide = buildWideDag(dag); // as renderers do
        } else if (method.method == MatrixMethod::kDagNone) {
            renderer->rayInputs(setup.frame.rays); // builds the hierarchy, ours or Embree's
        } else {
            return 0; // maps are drawn in each frame
        }
        return secondsSince(start);
    }

    static uint64_t bytesOf(const ScaleMethod& method, const FrameRenderer& renderer,
                            const FrameResult& frame) {
        if (method.method == MatrixMethod::kMaps)
            return frame.counts.maps.mapBytes;
        if (method.method == MatrixMethod::kDagAll)
            return renderer.dagBytes();
        return method.triangleRays == TriangleRays::kEmbree ? renderer.embreeBytes()
                                                            : renderer.exactBytes();
    }

    const ScaleTable& table_;
    const ScaleRow& row_;
    double growSeconds_ = 0; // before workspace_, whose scene it is the time of
    Camera camera_;
    Workspace workspace_;
    Judge judge_;
    PairList pairs_;
};

/// Adds the times of a method to its cell.
void addTimes(const Timing& timing, Json& cell) {
    cell.update(timing.toJson());
    cell.erase("stages_ms");
    const auto shadows =
        std::find_if(timing.stagesMs.begin(), timing.stagesMs.end(),
                     [](const auto& stage) { return stage.first == kShadowStage; });
    const QuantileInterval interval = medianInterval(shadows->second);
    const double scale = 1e6 / std::max(1.0, cell["pair_count"].get<double>());
    cell["shadow_ms"] = interval.value;
    cell["ns_per_pair"] = interval.value * scale;
    cell["ns_per_pair_low"] = interval.low * scale;
    cell["ns_per_pair_high"] = interval.high * scale;
    cell["ns_per_pair_confidence"] = interval.confidence;
}

} // namespace

Json measureScale(const ScaleTable& table, const ScaleRow& row, size_t index,
                  const StudyRequest& request, const Console& console) {
    Json results = {{"steps", Json::array()}, {"cells", Json::array()}, {"skipped", Json::array()}};
    std::optional<BaseScene> base = loadBase(table, row, console);
    const uint64_t baseCount = base->scene.world->triangles().count(),
                   asked = row.triangleCounts.at(index),
                   step = nearestStep(row.growth, baseCount, asked),
                   count = grownCount(row.growth, baseCount, step);
    const Json of = {{"row", row.name},
                     {"scene", row.scene},
                     {"growth", kGrowthNames[size_t(row.growth)]},
                     {"asked_triangle_count", asked},
                     {"triangle_count", count}};
    if (index > 0 && step == nearestStep(row.growth, baseCount, row.triangleCounts[index - 1])) {
        Json skipped = of;
        skipped["reason"] = "the scene with the nearest number of triangles is the one of the "
                            "number before";
        results["skipped"].push_back(std::move(skipped));
        return results;
    }
    requireScaleMemory(row.name, count, row.resolutionLog2.size(), processMemoryBytes());
    GrownScene scene(table, row, *base, step, request);
    base.reset(); // of the largest scenes it takes some GiB
    const std::vector<ScaleMethod> methods = methodsOf(row);
    const double stepCount =
        1.0 + double(methods.size()) * double(1 + table.warmups + table.repeats);
    double stepsDone = 0;
    const auto done = [&] {
        if (request.progress)
            request.progress(++stepsDone / stepCount);
    };
    scene.prepareTruth();
    done();
    for (const ScaleMethod& method : methods) {
        Json cell = of;
        cell.update(scene.measure(method));
        results["cells"].push_back(std::move(cell));
        done();
    }
    const std::vector<Timing> timings =
        timeInTurn(methods.size(), table.warmups, table.repeats, [&](size_t i) {
            const StageTimes stages = scene.time(methods[i]);
            done();
            return stages;
        });
    for (size_t i = 0; i < methods.size(); ++i)
        addTimes(timings[i], results["cells"][i]);
    Json measured = of;
    measured.update({{"grow_s", scene.growSeconds()},
                     {"light_count", scene.world().lights().size()},
                     {"pair_count", scene.pairCount()},
                     {"resident_bytes", residentBytes()}});
    results["steps"].push_back(std::move(measured));
    return results;
}

} // namespace shadowdag
