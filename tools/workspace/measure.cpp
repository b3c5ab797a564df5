// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/measure.h"

#include "cuda/error.h"
#include "hybrid/judge/error.h"
#include "tools/settings/console.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/timing.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>

namespace shadowdag {

namespace {

/// Returns a scene's name as part of a file name; no file that is read as a scene lacks a dot.
std::string sceneSlug(const std::string& name) {
    return name.starts_with("builtin:") ? "builtin_" + fileSlug(name.substr(8)) : fileSlug(name);
}

/// One frame of one scene: the truth once, then every configuration.
class FrameMeasurement {
public:
    FrameMeasurement(const LoadedScene& scene, uint32_t frame, const Experiment& experiment,
                     const std::vector<RunParameters>& runs,
                     std::vector<std::unique_ptr<FrameRenderer>>& renderers, const Truth& truth,
                     const MeasureContext& context)
        : scene_(scene), frame_(frame), experiment_(experiment), runs_(runs), renderers_(renderers),
          truth_(truth), context_(context),
          part_(scene.geometryHash + "/" + scene.name + "/" + std::to_string(frame) + "/") {}

    void measure(const Camera& camera, bool withPictures, const std::function<void()>& step,
                 SceneMeasurement& out) {
        camera_ = camera;
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

    FrameRenderer& rendererOf(const RunParameters& run) {
        return *renderers_[std::min<size_t>(run.dag, renderers_.size() - 1)];
    }

    const RunParameters* firstRun(bool (RunParameters::*uses)() const) const {
        for (const RunParameters& run : runs_)
            if ((run.*uses)())
                return &run;
        return nullptr;
    }

    /// Renders one configuration from nothing.
    FrameResult render(const RunParameters& run, bool recordPairs) {
        FrameRenderer& renderer = rendererOf(run);
        const std::unique_ptr<CostModel> model =
            makeCostModel(run.model.empty() ? "texels:0" : run.model);
        if (model->needsCosts())
            model->setCosts(frameCosts_);
        if (context_.given != nullptr)
            giveCalibration(*model, *context_.given);
        FrameOptions options = run.frame;
        options.recordPairs = recordPairs;
        if (run.method == "embree")
            options.undersample = 1024; // only the pairs are wanted: the least maps
        renderer.reset();
        return renderer.render(camera_, *model, options);
    }

    /// Finds the pairs of the frame and the truth about them.
    void prepareTruth() {
        // Any configuration gives the same pairs: they follow from view and lights.
        const RunParameters* maps = firstRun(&RunParameters::usesMaps);
        RunParameters probe = maps != nullptr ? *maps : runs_.front();
        probe.method = "embree";
        probe.model.clear();
        FrameResult result = render(probe, true);
        gbufferRenderer_ = &rendererOf(probe);
        pairs_ = std::move(result.pairs);
        quantities_ = std::move(result.maps);
        const std::vector<Light>& lights = scene_.world->lights();
        truthVisibility_ = truth_.visibility(gbufferRenderer_->gbuffer(), lights, pairs_);
        const std::vector<glm::vec3> color =
            shadePairs(gbufferRenderer_->gbuffer(), *scene_.world, pairs_, truthVisibility_);
        exposure_ = experiment_.exposureOf(color);
        truthDisplay_ = toneMap(color, exposure_);
        if (withPictures_)
            writePng(context_.directory + "/" + pictureBase() + "truth.png", experiment_.width,
                     experiment_.height, truthDisplay_);
    }

    /// Measures what every map costs by rays and by map alone, or takes the costs that were given.
    void measureCosts(const std::function<void()>& step, SceneMeasurement& out) {
        const RunParameters* base = firstRun(&RunParameters::usesVoxelRays);
        // Variants are charted without; only a model that routes by costs needs them.
        const bool isOfUse = std::any_of(runs_.begin(), runs_.end(), [&](const RunParameters& run) {
            return run.method != "embree" && ((run.variant.empty() && context_.measuresMapCosts) ||
                                              makeCostModel(run.model)->needsCosts());
        });
        const bool isWanted =
            isOfUse && base != nullptr && firstRun(&RunParameters::usesMaps) != nullptr;
        if (isWanted) {
            if (part("costs") == nullptr) {
                checkInterrupted();
                RunParameters run = *base;
                for (const RunParameters& candidate : runs_)
                    if (candidate.method == "hybrid") {
                        run = candidate; // its options hold those of both methods
                        break;
                    }
                if (context_.costs != nullptr) {
                    frameCosts_ =
                        findCosts(*context_.costs, context_.costsPath, scene_.name, frame_);
                } else {
                    FrameOptions options = run.frame;
                    options.recordPairs = false;
                    rendererOf(run).reset();
                    frameCosts_ = rendererOf(run).measureCosts(camera_, options);
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
        if (run.method == "embree")
            answerTruth(json);
        else
            answerMethod(run, json, lights);
        context_.journal->set(part_ + "answer/" + run.label(),
                              {{"run", std::move(json)}, {"lights", std::move(lights)}});
    }

    /// The truth held against itself: no error by definition, kept as a row so that tables and
    /// charts show its time.
    void answerTruth(Json& json) {
        ErrorCounts counts;
        counts.pairCount = pairs_.count();
        for (const uint8_t visibility : truthVisibility_)
            counts.occludedCount += visibility < kHalfLit ? 1 : 0;
        json.update(toJson(counts));
        json.update(nullRatesJson({}));
        json["rmse"] = 0.0;
        json["flip"] = 0.0;
        FrameCounts none;
        none.rayCount = pairs_.count();
        none.tracedLightCount = uint32_t(quantities_.size());
        json.update(toJson(none));
        json["dag_bytes"] = 0;
    }

    void answerMethod(const RunParameters& run, Json& json, Json& lights) {
        const FrameResult result = render(run, true);
        if (result.pairs.count() != pairs_.count())
            throw std::logic_error("the pairs of " + run.label() +
                                   " differ from those of the truth");
        ErrorOptions options;
        options.seed = experiment_.errorSeed;
        options.rays = run.frame.rays;
        options.bias = run.frame.bias;
        const ErrorReport report =
            computeError(rendererOf(run), result, *scene_.world, truth_, truthVisibility_, options);
        json.update(toJson(report.total));
        json.update(nullRatesJson(report));
        const std::vector<glm::vec3> display = toneMap(result.color, exposure_);
        json["rmse"] = computeRmse(truthDisplay_, display);
        json["flip"] = computeFlip(truthDisplay_, display, experiment_.width, experiment_.height);
        json.update(toJson(result.counts));
        if (frameCosts_.degradeDivisor > 1 && makeCostModel(run.model)->needsCosts())
            json["costs_degrade_divisor"] = frameCosts_.degradeDivisor;
        json["dag_bytes"] = run.usesRays() ? rendererOf(run).dagBytes() : 0;
        if (run.method == "dag-exact")
            json["exact_bytes"] = rendererOf(run).exactBytes();
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
        write("error", errorPicture(truthDisplay_,
                                    countPixelErrors(pairs_, result.visibility, truthVisibility_)));
        write("method", methodPicture(truthDisplay_, rayShare(result.pairs, result.pairRoute),
                                      result.maps, scene_.world->lights(), camera_, width, height));
    }

    void measureTimes(const std::function<void()>& step) {
        const int rounds = experiment_.warmups + experiment_.repeats;
        if (part(context_.times) != nullptr) {
            for (int i = 0; i < rounds * int(runs_.size()); ++i)
                step();
            return;
        }
        std::vector<Timing> timings(runs_.size());
        for (int round = 0; round < rounds; ++round)
            for (size_t i = 0; i < runs_.size(); ++i) {
                const size_t index = (i + size_t(round)) % runs_.size();
                const RunParameters& run = runs_[index];
                StageTimes stages;
                if (run.method == "embree") {
                    const auto start = std::chrono::steady_clock::now();
                    truth_.visibility(gbufferRenderer_->gbuffer(), scene_.world->lights(), pairs_);
                    const std::chrono::duration<double, std::milli> time =
                        std::chrono::steady_clock::now() - start;
                    stages.add("embree rays", time.count());
                } else {
                    stages = render(run, false).stages;
                }
                if (round >= experiment_.warmups)
                    timings[index].add(stages);
                step();
            }
        Json times = Json::object();
        for (size_t i = 0; i < runs_.size(); ++i) {
            times[runs_[i].label()] =
                experiment_.repeats > 0 ? timings[i].toJson() : Json::object();
            if (experiment_.repeats > 0 && context_.heedTiming)
                context_.heedTiming(frame_, runs_[i], timings[i]);
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
                if (key == "label")
                    json.update(times[run.label()]);
            }
            out.runs.push_back(std::move(json));
            for (const Json& light : saved["lights"])
                out.lights.push_back(light);
        }
        if (withPictures_)
            out.truthImages.push_back(
                {{"scene", scene_.name}, {"frame", frame_}, {"file", pictureBase() + "truth.png"}});
    }

    const LoadedScene& scene_;
    uint32_t frame_;
    const Experiment& experiment_;
    const std::vector<RunParameters>& runs_;
    std::vector<std::unique_ptr<FrameRenderer>>& renderers_;
    const Truth& truth_;
    const MeasureContext& context_;
    std::string part_;
    bool withPictures_ = false;
    Camera camera_;
    FrameRenderer* gbufferRenderer_ = nullptr;
    PairList pairs_;
    std::vector<MapRecord> quantities_;
    std::vector<uint8_t> truthVisibility_;
    std::vector<glm::vec3> truthDisplay_;
    float exposure_ = 1;
    FrameCosts frameCosts_;
};

} // namespace

SceneMeasurer::SceneMeasurer(LoadedScene& scene, const std::vector<Dag>& dags, Backend backend)
    : scene_(scene) {
    static const Dag kNoDag;
    for (const Dag& dag : dags) {
        checkInterrupted();
        renderers_.push_back(std::make_unique<FrameRenderer>(backend, *scene.world, dag));
    }
    if (renderers_.empty())
        renderers_.push_back(std::make_unique<FrameRenderer>(backend, *scene.world, kNoDag));
    checkInterrupted();
    truth_ = std::make_unique<Truth>(*scene.world);
    checkInterrupted();
}

SceneMeasurer::~SceneMeasurer() = default;

SceneMeasurement SceneMeasurer::measure(const Experiment& experiment,
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
    World& world = *scene_.world;
    const auto show = [&](uint32_t frame) {
        const float time = experiment.timeOfFrame(frame);
        if (time == world.timeSeconds())
            return;
        const std::vector<uint32_t> moved = world.setTime(time);
        for (const std::unique_ptr<FrameRenderer>& renderer : renderers_)
            renderer->worldChanged(moved);
        if (!moved.empty())
            truth_->update(world);
    };
    FrameCamera camera(experiment.camera);
    show(experiment.frames.front());
    camera.at(world); // places it where a compare of all frames does
    for (const uint32_t frame : context.frames) {
        show(frame);
        FrameMeasurement measurement(scene_, frame, experiment, runs, renderers_, *truth_, context);
        measurement.measure(camera.at(world),
                            context.writesPictures && frame == experiment.frames.front(), step,
                            out);
    }
    return out;
}

SceneMeasurement measureScene(LoadedScene& scene, const std::vector<Dag>& dags,
                              const Experiment& experiment, const std::vector<RunParameters>& runs,
                              const MeasureContext& context) {
    return SceneMeasurer(scene, dags, context.backend).measure(experiment, runs, context);
}

} // namespace shadowdag
