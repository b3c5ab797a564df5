// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/fit_measure.h"

#include "cuda/error.h"
#include "cuda/statistics.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/judge.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace shadowdag {

struct FitMeasurer::FitScene {
    explicit FitScene(Workspace of) : workspace(std::move(of)) {}

    Workspace workspace;
    std::vector<uint32_t> resolutions; ///< log2, by RunParameters::dag
    Journal journal{"", "", false};
    std::vector<uint32_t> frames;
};

FitTime fitTime(const std::vector<double>& runsMs) {
    SDAG_ASSERT(runsMs.size() >= 2);
    const double count = double(runsMs.size());
    double mean = 0, squares = 0;
    for (const double ms : runsMs)
        mean += ms / count;
    for (const double ms : runsMs)
        squares += (ms - mean) * (ms - mean);
    constexpr double kOfMedian = 1.2533141373155003; // sqrt(pi / 2)
    return {median(runsMs), *std::min_element(runsMs.begin(), runsMs.end()),
            kOfMedian * std::sqrt(squares / (count - 1) / count)};
}

FitMeasurer::FitMeasurer(const Experiment& sweep, FitMetric metric, FitObjective objective,
                         Backend backend, const std::string& cacheDirectory,
                         const CostSource& costs, const Console& console)
    : sweep_(sweep), metric_(metric), objective_(objective), costs_(costs), console_(console) {
    const std::vector<std::string> names = sceneNames(sweep.scenes);
    const bool usesVoxels =
        std::any_of(sweep.methods.begin(), sweep.methods.end(),
                    [](const std::string& method) { return methodOf(method).needs().rays; }) &&
        std::any_of(sweep.believe.begin(), sweep.believe.end(), [](float w) { return w > 0; });
    for (size_t i = 0; i < names.size(); ++i) {
        checkInterrupted();
        LoadedScene loaded = openScene(sweep, i, console);
        const bool isStill = loaded.scene->animations.empty();
        auto scene = std::make_unique<FitScene>(
            Workspace(std::move(loaded),
                      {backend, sweep.camera, VoxelSource{{}, cacheDirectory, false}, &console}));
        if (usesVoxels)
            scene->resolutions = scene->workspace.obtainVoxels(sweep.resolutionLog2);
        for (const uint32_t log2 : scene->resolutions)
            scene->workspace.renderer(log2); // before any motion
        scene->frames = sweep.frames;
        if (isStill)
            scene->frames.resize(1);
        for (const uint32_t frame : scene->frames) {
            cellFrames_.push_back({i, frame});
            cellNames_.push_back({{"scene", names[i]}, {"frame", frame}});
        }
        scenes_.push_back(std::move(scene));
    }
}

FitMeasurer::~FitMeasurer() = default;

std::vector<uint64_t> FitMeasurer::dagBytes() const {
    std::vector<uint64_t> most(scenes_[0]->resolutions.size(), 0);
    for (const auto& scene : scenes_)
        for (size_t dag = 0; dag < most.size(); ++dag)
            most[dag] =
                std::max(most[dag], scene->workspace.renderer(scene->resolutions[dag]).dagBytes());
    return most;
}

void FitMeasurer::setModels(const FitModels& models) {
    models_ = &models;
    const size_t count = models.runs.size();
    cells_.assign(count, std::vector<FitCell>(cellCount()));
    screenTimes_.assign(count, {});
    finalTimes_.assign(count, {});
}

void FitMeasurer::run(size_t cell, const std::vector<size_t>& models, int repeats, int warmups,
                      const std::string& what, std::vector<std::vector<double>>* runsMs) {
    if (models.empty())
        return;
    const auto& [sceneIndex, frame] = cellFrames_[cell];
    FitScene& scene = *scenes_[sceneIndex];
    std::vector<RunParameters> runs;
    for (const size_t model : models)
        runs.push_back(models_->runs[model]);
    Experiment experiment = sweep_;
    experiment.repeats = repeats;
    experiment.warmups = warmups;
    MeasureContext context;
    context.given = &costs_;
    context.journal = &scene.journal;
    context.frames = {frame};
    context.progress = console_.progress("fit " + what + ", " + std::to_string(models.size()) +
                                         (models.size() == 1 ? " model" : " models"));
    context.writesPictures = false;
    context.measuresMapCosts = false;
    context.times = "times " + std::to_string(batchCount_++);
    if (runsMs != nullptr) {
        runsMs->clear();
        context.onTiming = [&](uint32_t, const RunParameters&, const Timing& timing) {
            runsMs->push_back(timing.totalMs); // in the order of the runs
        };
    }
    const SceneMeasurement measured = measureScene(scene.workspace, experiment, runs, context);
    Json& name = cellNames_[cell];
    if (!name.contains("camera_numbers")) { // once
        name["camera_numbers"] = measured.runs[0].at("camera_numbers");
        const std::string few = fewPairsWarning(name.at("scene").get<std::string>() + ", frame " +
                                                    std::to_string(frame),
                                                measured.runs[0].at("pair_count").get<uint64_t>());
        if (!few.empty()) {
            name["warning"] = few;
            console_.note("warning: " + few);
        }
    }
    for (size_t i = 0; i < models.size(); ++i) {
        const Json& row = measured.runs[i];
        otherCpuShare_ = largerOtherShare(otherCpuShare_, row);
        FitCell& found = cells_[models[i]][cell];
        found.isMeasured = true;
        found.pairCount = row.at("pair_count");
        found.falseShadowCount = row.at("false_shadow_count");
        found.falseLightCount = row.at("false_light_count");
        found.meanAbsVisibilityError = row.at("mean_abs_visibility_error");
        found.flip = row.at("flip");
        found.dagBytes =
            row.at("dag_bytes").get<uint64_t>() + row.value("exact_bytes", uint64_t(0));
        found.mapBytes = row.at("map_bytes");
        found.mappedLightCount = row.at("mapped_light_count");
        found.poolNote = poolNote(row);
        if (found.pairCount == 0)
            throw Error(ErrorKind::kInput,
                        cellNames_[cell].at("scene").get<std::string>() + ": frame " +
                            std::to_string(frame) +
                            " shows no surface within a light's range, so its error is not "
                            "defined; choose other --frames, --camera or --lights");
        const double wrong = double(found.falseShadowCount + found.falseLightCount);
        found.error = metric_ == FitMetric::kFalse        ? wrong / double(found.pairCount)
                      : metric_ == FitMetric::kVisibility ? found.meanAbsVisibilityError
                                                          : found.flip;
    }
}

void FitMeasurer::measure(const std::vector<FitRequest>& requests, const std::string& what) {
    for (size_t cell = 0; cell < cellCount(); ++cell) {
        std::vector<size_t> models;
        for (const FitRequest& request : requests)
            if ((cell == 0 || request.inAllCells) && !cells_[request.model][cell].isMeasured)
                models.push_back(request.model);
        if (cell > 0 || objective_ == FitObjective::kBytes) {
            run(cell, models, 0, 0, what, nullptr);
            continue;
        }
        std::vector<std::vector<double>> runsMs;
        // The measurement of errors was the warm-up.
        run(cell, models, kScreenRepeats, 0, what, &runsMs);
        for (size_t i = 0; i < models.size(); ++i)
            screenTimes_[models[i]] = fitTime(runsMs[i]);
    }
}

void FitMeasurer::time(const std::vector<size_t>& models, int repeats, int warmups,
                       const std::string& what) {
    std::vector<FitTime> sums(models.size());
    const double share = 1.0 / double(cellCount());
    for (size_t cell = 0; cell < cellCount(); ++cell) {
        std::vector<std::vector<double>> runsMs;
        run(cell, models, repeats, warmups, what, &runsMs);
        for (size_t i = 0; i < models.size(); ++i) {
            const FitTime time = fitTime(runsMs[i]);
            sums[i].medianMs += share * time.medianMs;
            sums[i].minMs += share * time.minMs;
            sums[i].standardErrorMs =
                std::hypot(sums[i].standardErrorMs, share * time.standardErrorMs);
        }
    }
    for (size_t i = 0; i < models.size(); ++i)
        finalTimes_[models[i]] = sums[i];
}

size_t FitMeasurer::raysAlone(size_t model) const {
    const RunParameters& run = models_->runs[model];
    if (!run.isRouted() ||
        std::any_of(cells_[model].begin(), cells_[model].end(),
                    [](const FitCell& cell) { return cell.mappedLightCount > 0; }))
        return SIZE_MAX;
    for (size_t other = 0; other < models_->runs.size(); ++other) {
        const RunParameters& alone = models_->runs[other];
        const MethodNeeds& needs = methodOf(alone.method).needs();
        if (needs.rays && !needs.maps && alone.dag == run.dag &&
            alone.frame.rays.believe == run.frame.rays.believe &&
            LodChoice(alone.frame.rays) == LodChoice(run.frame.rays))
            return other;
    }
    return SIZE_MAX;
}

FitObservation FitMeasurer::observation(size_t model) const {
    FitObservation found;
    found.isComplete = true;
    double bytes = 0;
    for (const FitCell& cell : cells_[model]) {
        found.isComplete = found.isComplete && cell.isMeasured;
        if (cell.isMeasured) {
            found.error = std::max(found.error, cell.error);
            bytes = std::max(bytes, double(cell.bytes()));
        }
    }
    found.firstError = cells_[model][0].error;
    const auto& time = screenTimes_[model];
    found.cost = objective_ == FitObjective::kBytes ? bytes : time->medianMs;
    found.leastCost = objective_ == FitObjective::kBytes ? bytes : time->minMs;
    return found;
}

Json FitMeasurer::scenes() const {
    Json list = Json::array();
    for (const auto& scene : scenes_)
        list.push_back({{"scene", scene->workspace.scene().name},
                        {"scene_hash", scene->workspace.scene().geometryHash},
                        {"content_hash", scene->workspace.scene().contentHash},
                        {"triangle_count", scene->workspace.world().triangles().count()},
                        {"light_count", scene->workspace.world().lights().size()},
                        {"frames", scene->frames}});
    return list;
}

} // namespace shadowdag
