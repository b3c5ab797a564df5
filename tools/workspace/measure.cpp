// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/measure.h"

#include "cuda/error.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/console.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/judge.h"

#include <algorithm>
#include <map>
#include <memory>
#include <stdexcept>

namespace shadowdag {

namespace {

/// Returns a scene's name as part of a file name; every scene file's name contains a dot.
std::string sceneSlug(const std::string& name) {
    return name.starts_with("builtin:") ? "builtin_" + fileSlug(name.substr(8)) : fileSlug(name);
}

/// Returns whether the isolated costs of a run's maps are of use. Charts of variants do not use
/// them; only a model that routes by costs needs them.
bool wantsMapCosts(const RunParameters& run, bool measuresMapCosts) {
    return (run.variant.empty() && measuresMapCosts && run.usesMaps()) ||
           makeCostModel(run.model)->needsCosts();
}

/// Receives progress, in units of about one rendered frame.
using Steps = std::function<void(size_t count)>;
/// How many frames take about as long as the truth, as judging a configuration, and as measuring
/// the costs of all maps: estimates for the display alone.
constexpr size_t kTruthSteps = 10, kAnswerSteps = 10, kCostSteps = 20;

/// One frame of one scene: the truth once, then every configuration.
class FrameMeasurement {
public:
    FrameMeasurement(Workspace& workspace, Judge& judge, uint32_t frame,
                     const Experiment& experiment, const std::vector<RunParameters>& runs,
                     const MeasureContext& context)
        : workspace_(workspace), scene_(workspace.scene()), judge_(judge), frame_(frame),
          experiment_(experiment), runs_(runs), context_(context),
          part_(scene_.geometryHash + "/" + scene_.name + "/" + std::to_string(frame) + "/") {}

    void measure(bool withPictures, size_t costSteps, const Steps& step, SceneMeasurement& out) {
        camera_ = workspace_.camera();
        withPictures_ = withPictures;
        if (!isDone())
            prepareTruth();
        step(kTruthSteps);
        measureCosts(out);
        step(costSteps);
        for (const RunParameters& run : runs_) {
            answer(run);
            step(kAnswerSteps);
        }
        measureTimes(step);
        collect(out);
    }

    /// Adds that no map of the frame has costs, so that the costs of all frames can be replayed.
    void addNoCosts(SceneMeasurement& out) const {
        FrameCosts none;
        none.frame = frame_;
        for (const RunParameters& run : runs_)
            if (usesMapCosts(runs_) && wantsMapCosts(run, context_.measuresMapCosts))
                out.costs[{scene_.name, frame_, run.frame.start}] = {none, conditions()};
    }

private:
    const Json* part(const std::string& name) const { return context_.journal->find(part_ + name); }
    std::string pictureBase() const {
        return "images/" + sceneSlug(scene_.name) + "_f" + std::to_string(frame_) + "_";
    }

    std::string truthPicture() const {
        return context_.directory + "/" + pictureBase() + "truth.png";
    }

    bool isDone() const {
        if (part(context_.times) == nullptr || (withPictures_ && !isWholePng(truthPicture())))
            return false;
        return std::all_of(runs_.begin(), runs_.end(), [&](const RunParameters& run) {
            return part("answer/" + run.label()) != nullptr;
        });
    }

    const RunParameters* firstRun(bool (RunParameters::*uses)() const) const {
        for (const RunParameters& run : runs_)
            if ((run.*uses)())
                return &run;
        return nullptr;
    }

    /// Renders one configuration, whatever was rendered before.
    FrameResult render(const RunParameters& run, bool recordPairs) {
        FrameRenderer& renderer = workspace_.renderer(run);
        const std::unique_ptr<CostModel> model = makeCostModel(run.model);
        if (model->needsCosts())
            model->setCosts(costsOf(run));
        if (context_.given != nullptr)
            giveCalibration(*model, *context_.given);
        FrameOptions options = run.frame;
        options.recordPairs = recordPairs;
        return renderFrom(renderer, camera_, *model, options);
    }

    FrameCosts& costsOf(const RunParameters& run) { return frameCosts_[run.frame.start]; }

    /// Finds the pairs of the frame and the truth about them.
    void prepareTruth() {
        // Any configuration gives the same pairs: they depend on view and lights.
        FrameRenderer& renderer = workspace_.renderer(runs_.front());
        pairs_ = renderer.listPairs(camera_, runs_.front().frame);
        fewPairsWarning(scene_.name + ", frame " + std::to_string(frame_), pairs_.count(),
                        {experiment_.lightCount >= 0, workspace_.isCameraAutomatic()});
        truth_ = &judge_.picture(frame_, renderer.gbuffer(), pairs_, float(experiment_.exposure));
        if (withPictures_)
            writePng(truthPicture(), experiment_.width, experiment_.height, truth_->display);
    }

    /// Measures the cost of every map by rays and by map alone, of every start of a frame that is
    /// of use, or takes the given costs.
    void measureCosts(SceneMeasurement& out) {
        std::map<FrameStart, RunParameters> wanted;
        const RunParameters* rays = firstRun(&RunParameters::usesRays);
        if (rays != nullptr && firstRun(&RunParameters::usesMaps) != nullptr)
            for (const RunParameters& run : runs_)
                if (wantsMapCosts(run, context_.measuresMapCosts)) {
                    RunParameters& of = wanted.try_emplace(run.frame.start, *rays).first->second;
                    if (run.isRouted() && !of.isRouted())
                        of = run; // its options contain those of both methods
                    of.frame.start = run.frame.start;
                }
        for (const auto& [start, run] : wanted) {
            const std::string name =
                std::string("costs") + (start == FrameStart::kWarm ? " warm" : "");
            if (part(name) == nullptr)
                measureCosts(run, name);
            readCosts(*part(name), frameCosts_[start], out);
            const CostKey key{scene_.name, frame_, start};
            out.costs[key] = {frameCosts_[start],
                              context_.costs != nullptr
                                  ? findCosts(*context_.costs, context_.costsPath, key).of
                                  : conditions()};
        }
    }

    Json conditions() const {
        return costConditions(scene_, camera_, experiment_, experiment_.timeOfFrame(frame_));
    }

    /// Measures or takes the costs of a run and notes them in the journal.
    void measureCosts(const RunParameters& run, const std::string& name) {
        checkInterrupted();
        FrameRenderer& renderer = workspace_.renderer(run);
        FrameCosts& costs = costsOf(run);
        if (context_.costs != nullptr) {
            costs = findCosts(*context_.costs, context_.costsPath,
                              {scene_.name, frame_, run.frame.start}, conditions(),
                              context_.allowsStaleCosts, *context_.console);
        } else {
            FrameOptions options = run.frame;
            options.recordPairs = false;
            costs = renderer.measureCosts(camera_, options);
        }
        costs.frame = frame_;
        RunParameters drawAll = run;
        drawAll.model = "texels:0";
        const FrameResult result = render(drawAll, true);
        context_.journal->set(part_ + name, costsJson(costs, run.frame.start, result.maps));
    }

    void readCosts(const Json& saved, FrameCosts& costs, SceneMeasurement& out) const {
        costs = {};
        costs.frame = frame_;
        for (const Json& map : saved) {
            costs.maps.push_back({map.at("light").get<uint32_t>(), map.value("octave", 0u),
                                  map.at("rays_ms").get<double>(), map.at("map_ms").get<double>()});
            costs.raysScale = map.value("rays_scale", 1.0);
            costs.mapsScale = map.value("maps_scale", 1.0);
            costs.degradeDivisor = map.value("degrade_divisor", 1.0);
            if (map.contains("whole_frame"))
                costs.wholeFrameTexels = wholeFrameFromJson(map["whole_frame"], "the journal");
            out.mapCosts.push_back(map);
        }
    }

    Json costsJson(const FrameCosts& costs, FrameStart start,
                   const std::vector<MapRecord>& maps) const {
        Json list = Json::array();
        const Json quantities = toJson(maps);
        for (const MapCost& cost : costs.maps)
            for (const Json& map : quantities)
                if (map.at("light") == cost.light && map.at("octave") == cost.octave) {
                    Json entry = {{"scene", scene_.name}, {"frame", frame_}};
                    if (start == FrameStart::kWarm)
                        entry["start"] = "warm";
                    entry.update(map);
                    entry.erase("route");
                    entry["rays_ms"] = cost.raysMs;
                    entry["map_ms"] = cost.mapMs;
                    entry["rays_scale"] = costs.raysScale;
                    entry["maps_scale"] = costs.mapsScale;
                    if (costs.degradeDivisor > 1)
                        entry["degrade_divisor"] = costs.degradeDivisor;
                    if (costs.wholeFrameTexels)
                        entry["whole_frame"] = wholeFrameJson(*costs.wholeFrameTexels);
                    list.push_back(std::move(entry));
                }
        return list;
    }

    void answer(const RunParameters& run) {
        if (part("answer/" + run.label()) != nullptr)
            return;
        checkInterrupted();
        Json json = {{"scene", scene_.name},       {"frame", frame_},
                     {"method", run.method},       {"model", run.model},
                     {"parameters", run.toJson()}, {"label", run.label()}};
        Json lights = Json::array();
        computeMethodResult(run, json, lights);
        context_.journal->set(part_ + "answer/" + run.label(),
                              {{"run", std::move(json)}, {"lights", std::move(lights)}});
    }

    void computeMethodResult(const RunParameters& run, Json& json, Json& lights) {
        const FrameRenderer& renderer = workspace_.renderer(run);
        const PairResults answers = pairResultsOf(render(run, true), renderer, run.frame);
        const FrameResult& result = answers.frame;
        if (result.pairs.count() != pairs_.count())
            throw std::logic_error("the pairs of " + run.label() +
                                   " differ from those of the truth");
        const ErrorReport report = judge_.judge(frame_, answers);
        json.update(toJson(report.total));
        json.update(nullRatesJson(report));
        if (run.usesTriangles() || run.usesEmbree())
            json.update(adjudicate(workspace_.world(), answers, report.exactWrongPairs).json());
        const std::vector<glm::vec3> display = toneMap(result.color, truth_->exposure);
        json["rmse"] = computeRmse(truth_->display, display);
        json["flip"] = computeFlip(truth_->display, display, experiment_.width, experiment_.height);
        json.update(toJson(result.counts));
        if (costsOf(run).degradeDivisor > 1 && makeCostModel(run.model)->needsCosts())
            json["costs_degrade_divisor"] = costsOf(run).degradeDivisor;
        json["dag_bytes"] = run.usesVoxels() ? renderer.dagBytes() : 0;
        json["exact_bytes"] = triangleBytes(run, renderer);
        json["visibility_histogram"] = report.visibilityHistogram;
        for (Json& entry : lightsJson(result.maps)) {
            Json row = {{"scene", scene_.name}, {"frame", frame_}, {"label", run.label()}};
            row.update(entry);
            row.update(toJson(report.perLight[entry["light"].get<size_t>()]));
            lights.push_back(std::move(row));
        }
        if (withPictures_)
            writePictures(run, result, display, json);
    }

    void writePictures(const RunParameters& run, const FrameResult& result,
                       const std::vector<glm::vec3>& display, Json& json) {
        const uint32_t width = experiment_.width, height = experiment_.height;
        const auto write = [&](const char* kind, const std::vector<glm::vec3>& picture) {
            const std::string file = pictureBase() + run.slug() + "_" + kind + ".png";
            writePng(context_.directory + "/" + file, width, height, picture);
            json["images"][kind] = file;
        };
        write("color", display);
        write("error", errorPicture(truth_->display, countPixelErrors(pairs_, result.visibility,
                                                                      truth_->visibility)));
        write("method",
              methodPicture(truth_->display, rayShare(result.pairs, result.pairRoute), result.maps,
                            workspace_.world().lights(), camera_, width, height));
    }

    void measureTimes(const Steps& step) {
        if (part(context_.times) != nullptr) {
            const int rounds = experiment_.warmups + experiment_.repeats;
            step(size_t(rounds) * runs_.size());
            return;
        }
        const CpuUse use;
        const std::vector<Timing> timings =
            timeInTurn(runs_.size(), experiment_.warmups, experiment_.repeats, [&](size_t i) {
                const FrameResult frame = render(runs_[i], false);
                step(1);
                return RunTimes(frame.stages, frame.wallMs);
            });
        const Json otherCpuShare = otherShareJson(use.otherShare());
        const auto embree = std::find_if(runs_.begin(), runs_.end(), [](const RunParameters& run) {
            return methodOf(run.method).needs().embree;
        });
        Json times = Json::object();
        for (size_t i = 0; i < runs_.size(); ++i) {
            Json& of = times[runs_[i].label()];
            of = experiment_.repeats > 0 ? timings[i].toJson() : Json::object();
            if (experiment_.repeats > 0) {
                of["other_cpu_share"] = otherCpuShare;
                if (embree != runs_.end())
                    of.update(ratioJson("time_over_embree", timings[i],
                                        timings[size_t(embree - runs_.begin())]));
            }
            if (experiment_.repeats > 0 && context_.onTiming)
                context_.onTiming(frame_, runs_[i], timings[i]);
        }
        context_.journal->set(part_ + context_.times, std::move(times));
    }

    void collect(SceneMeasurement& out) const {
        const Json& times = *part(context_.times);
        for (const RunParameters& run : runs_) {
            const Json& saved = *part("answer/" + run.label());
            Json json = Json::object();
            for (const auto& [key, value] : saved["run"].items()) {
                json[key] = value;
                if (key == "label") {
                    json.update(times[run.label()]);
                    json["camera_numbers"] = cameraText(camera_);
                }
            }
            out.runs.push_back(std::move(json));
            for (const Json& light : saved["lights"])
                out.lights.push_back(light);
        }
        if (withPictures_)
            out.truthImages.push_back({{"scene", scene_.name},
                                       {"frame", frame_},
                                       {"file", pictureBase() + "truth.png"},
                                       {"lights", lightsInPicture()}});
    }

    /// Returns {"light", "x", "y"}, in pixels, of every light with a position within the picture.
    Json lightsInPicture() const {
        Json list = Json::array();
        const std::vector<Light>& lights = workspace_.world().lights();
        for (size_t light = 0; light < lights.size(); ++light) {
            const auto pixel = pixelOf(lights[light].positionWorld, camera_, experiment_.width,
                                       experiment_.height);
            if (lights[light].kind != Light::kSun && pixel && pixel->x >= 0 && pixel->y >= 0 &&
                pixel->x < float(experiment_.width) && pixel->y < float(experiment_.height))
                list.push_back({{"light", light}, {"x", pixel->x}, {"y", pixel->y}});
        }
        return list;
    }

    Workspace& workspace_;
    const LoadedScene& scene_;
    Judge& judge_;
    uint32_t frame_;
    const Experiment& experiment_;
    const std::vector<RunParameters>& runs_;
    const MeasureContext& context_;
    std::string part_;
    bool withPictures_ = false;
    Camera camera_;
    PairList pairs_;
    const FrameTruth* truth_ = nullptr;
    std::map<FrameStart, FrameCosts> frameCosts_;
};

} // namespace

bool usesMapCosts(const std::vector<RunParameters>& runs) {
    const auto any = [&](const auto& holds) {
        return std::any_of(runs.begin(), runs.end(), holds);
    };
    return any([](const RunParameters& run) { return run.usesRays(); }) &&
           any([](const RunParameters& run) { return run.usesMaps(); }) &&
           any([](const RunParameters& run) { return wantsMapCosts(run, true); });
}

SceneMeasurement measureScene(Workspace& workspace, const Experiment& experiment,
                              const std::vector<RunParameters>& runs,
                              const MeasureContext& context) {
    SceneMeasurement out;
    const size_t costSteps =
        usesMapCosts(runs) && context.measuresMapCosts && !context.costs ? kCostSteps : 0;
    const size_t stepsAFrame =
        kTruthSteps + costSteps +
        runs.size() * (kAnswerSteps + size_t(experiment.warmups + experiment.repeats));
    const double stepCount = double(stepsAFrame * context.frames.size());
    size_t stepsDone = 0;
    const auto step = [&](size_t count) {
        stepsDone += count;
        if (context.progress)
            context.progress(double(stepsDone) / stepCount);
    };
    for (const RunParameters& run : runs)
        workspace.renderer(run); // before any motion, as in all compares
    Judge judge(workspace, experiment.errorSeed, ErrorOptions{}.nullSampleCount);
    workspace.setTime(experiment.timeOfFrame(experiment.frames.front()));
    workspace.camera(); // placed where a compare of all frames places it
    for (const uint32_t frame : context.frames) {
        workspace.setTime(experiment.timeOfFrame(frame));
        FrameMeasurement measurement(workspace, judge, frame, experiment, runs, context);
        const size_t stepsBefore = stepsDone;
        try {
            measurement.measure(context.writesPictures && frame == experiment.frames.front(),
                                costSteps, step, out);
        } catch (const NothingToCompare& error) {
            if (!context.onLeftOut)
                throw;
            context.onLeftOut(error.what());
            measurement.addNoCosts(out);
            stepsDone = stepsBefore;
            step(stepsAFrame);
        }
        judge.forget();
    }
    return out;
}

} // namespace shadowdag
