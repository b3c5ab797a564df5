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
#include <memory>
#include <stdexcept>

namespace shadowdag {

namespace {

/// Returns a scene's name as part of a file name; every scene file's name contains a dot.
std::string sceneSlug(const std::string& name) {
    return name.starts_with("builtin:") ? "builtin_" + fileSlug(name.substr(8)) : fileSlug(name);
}

/// One frame of one scene: the truth once, then every configuration.
class FrameMeasurement {
public:
    FrameMeasurement(Workspace& workspace, Judge& judge, uint32_t frame,
                     const Experiment& experiment, const std::vector<RunParameters>& runs,
                     const MeasureContext& context)
        : workspace_(workspace), scene_(workspace.scene()), judge_(judge), frame_(frame),
          experiment_(experiment), runs_(runs), context_(context),
          part_(scene_.geometryHash + "/" + scene_.name + "/" + std::to_string(frame) + "/") {}

    void measure(bool withPictures, const std::function<void()>& step, SceneMeasurement& out) {
        camera_ = workspace_.camera();
        withPictures_ = withPictures;
        if (!isDone())
            prepareTruth();
        measureCosts(step, out);
        for (const RunParameters& run : runs_) {
            answer(run);
            step();
        }
        measureTimes(step);
        collect(out);
    }

private:
    const Json* part(const std::string& name) const { return context_.journal->find(part_ + name); }
    std::string pictureBase() const {
        return "images/" + sceneSlug(scene_.name) + "_f" + std::to_string(frame_) + "_";
    }

    bool isDone() const {
        if (part(context_.times) == nullptr)
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

    /// Renders one configuration without earlier state.
    FrameResult render(const RunParameters& run, bool recordPairs) {
        FrameRenderer& renderer = workspace_.renderer(run);
        const std::unique_ptr<CostModel> model = makeCostModel(run.model);
        if (model->needsCosts())
            model->setCosts(frameCosts_);
        if (context_.given != nullptr)
            giveCalibration(*model, *context_.given);
        FrameOptions options = run.frame;
        options.recordPairs = recordPairs;
        renderer.reset();
        return renderer.render(camera_, *model, options);
    }

    /// Finds the pairs of the frame and the truth about them.
    void prepareTruth() {
        // Any configuration gives the same pairs: they depend on view and lights.
        FrameRenderer& renderer = workspace_.renderer(runs_.front());
        pairs_ = renderer.listPairs(camera_, runs_.front().frame);
        fewPairsWarning(scene_.name + ", frame " + std::to_string(frame_), pairs_.count());
        truth_ = &judge_.picture(frame_, renderer.gbuffer(), pairs_, float(experiment_.exposure));
        if (withPictures_)
            writePng(context_.directory + "/" + pictureBase() + "truth.png", experiment_.width,
                     experiment_.height, truth_->display);
    }

    /// Measures the cost of every map by rays and by map alone, or uses the given costs.
    void measureCosts(const std::function<void()>& step, SceneMeasurement& out) {
        const RunParameters* base = firstRun(&RunParameters::usesRays);
        // Charts of variants do not use them; only a model that routes by costs needs them.
        const bool isOfUse = std::any_of(runs_.begin(), runs_.end(), [&](const RunParameters& run) {
            return (run.variant.empty() && context_.measuresMapCosts) ||
                   makeCostModel(run.model)->needsCosts();
        });
        const bool isWanted =
            isOfUse && base != nullptr && firstRun(&RunParameters::usesMaps) != nullptr;
        if (isWanted) {
            if (part("costs") == nullptr) {
                checkInterrupted();
                RunParameters run = *base;
                for (const RunParameters& candidate : runs_)
                    if (candidate.isRouted()) {
                        run = candidate; // its options contain those of both methods
                        break;
                    }
                if (context_.costs != nullptr) {
                    frameCosts_ =
                        findCosts(*context_.costs, context_.costsPath, scene_.name, frame_);
                } else {
                    FrameOptions options = run.frame;
                    options.recordPairs = false;
                    FrameRenderer& renderer = workspace_.renderer(run);
                    renderer.reset();
                    frameCosts_ = renderer.measureCosts(camera_, options);
                }
                frameCosts_.frame = frame_;
                RunParameters drawAll = run;
                drawAll.model = "texels:0";
                const FrameResult result = render(drawAll, true);
                context_.journal->set(part_ + "costs", costsJson(result.maps));
            }
            const Json& saved = *part("costs");
            frameCosts_ = {};
            frameCosts_.frame = frame_;
            for (const Json& map : saved) {
                frameCosts_.maps.push_back(
                    {map.at("light").get<uint32_t>(), map.value("octave", 0u),
                     map.at("rays_ms").get<double>(), map.at("map_ms").get<double>()});
                frameCosts_.raysScale = map.value("rays_scale", 1.0);
                frameCosts_.mapsScale = map.value("maps_scale", 1.0);
                frameCosts_.degradeDivisor = map.value("degrade_divisor", 1.0);
                if (map.contains("whole_frame"))
                    frameCosts_.wholeFrame = routeNamed(map["whole_frame"], "the journal");
                out.mapCosts.push_back(map);
            }
            out.costs[{scene_.name, frame_}] = frameCosts_;
        }
        step();
    }

    Json costsJson(const std::vector<MapRecord>& maps) const {
        Json list = Json::array();
        const Json quantities = toJson(maps);
        for (const MapCost& cost : frameCosts_.maps)
            for (const Json& map : quantities)
                if (map.at("light") == cost.light && map.at("octave") == cost.octave) {
                    Json entry = {{"scene", scene_.name}, {"frame", frame_}};
                    entry.update(map);
                    entry.erase("route");
                    entry["rays_ms"] = cost.raysMs;
                    entry["map_ms"] = cost.mapMs;
                    entry["rays_scale"] = frameCosts_.raysScale;
                    entry["maps_scale"] = frameCosts_.mapsScale;
                    if (frameCosts_.degradeDivisor > 1)
                        entry["degrade_divisor"] = frameCosts_.degradeDivisor;
                    if (frameCosts_.wholeFrame)
                        entry["whole_frame"] = routeName(*frameCosts_.wholeFrame);
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
        const std::vector<glm::vec3> display = toneMap(result.color, truth_->exposure);
        json["rmse"] = computeRmse(truth_->display, display);
        json["flip"] = computeFlip(truth_->display, display, experiment_.width, experiment_.height);
        json.update(toJson(result.counts));
        if (frameCosts_.degradeDivisor > 1 && makeCostModel(run.model)->needsCosts())
            json["costs_degrade_divisor"] = frameCosts_.degradeDivisor;
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

    void measureTimes(const std::function<void()>& step) {
        if (part(context_.times) != nullptr) {
            const int rounds = experiment_.warmups + experiment_.repeats;
            for (int i = 0; i < rounds * int(runs_.size()); ++i)
                step();
            return;
        }
        const CpuUse use;
        const std::vector<Timing> timings =
            timeInTurn(runs_.size(), experiment_.warmups, experiment_.repeats, [&](size_t i) {
                StageTimes stages = render(runs_[i], false).stages;
                step();
                return stages;
            });
        const double otherCpuShare = use.otherShare();
        Json times = Json::object();
        for (size_t i = 0; i < runs_.size(); ++i) {
            Json& of = times[runs_[i].label()];
            of = experiment_.repeats > 0 ? timings[i].toJson() : Json::object();
            if (experiment_.repeats > 0)
                of["other_cpu_share"] = otherCpuShare;
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
            out.truthImages.push_back(
                {{"scene", scene_.name}, {"frame", frame_}, {"file", pictureBase() + "truth.png"}});
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
    FrameCosts frameCosts_;
};

} // namespace

SceneMeasurement measureScene(Workspace& workspace, const Experiment& experiment,
                              const std::vector<RunParameters>& runs,
                              const MeasureContext& context) {
    SceneMeasurement out;
    const size_t stepsAFrame =
        1 + runs.size() * size_t(1 + experiment.warmups + experiment.repeats);
    const double stepCount = double(stepsAFrame * context.frames.size());
    size_t stepsDone = 0;
    const auto step = [&] {
        ++stepsDone;
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
        measurement.measure(context.writesPictures && frame == experiment.frames.front(), step,
                            out);
        judge.forget();
    }
    return out;
}

} // namespace shadowdag
