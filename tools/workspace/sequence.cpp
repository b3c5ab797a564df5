// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/sequence.h"

#include "cuda/error.h"
#include "hybrid/judge/flicker.h"
#include "tools/settings/console.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/timing.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>

namespace shadowdag {

namespace {

const Dag kNoDag;

/// Counts a frame's wrong answers without asking why.
Json confusionJson(const PairList& pairs, const std::vector<uint8_t>& visibility,
                   const std::vector<uint8_t>& truth) {
    uint64_t occluded = 0, falseShadow = 0, falseLight = 0, difference = 0;
    for (size_t p = 0; p < pairs.count(); ++p) {
        const bool isDark = visibility[p] < kHalfLit, isTruthDark = truth[p] < kHalfLit;
        occluded += isTruthDark;
        falseShadow += isDark && !isTruthDark;
        falseLight += !isDark && isTruthDark;
        difference += uint64_t(std::abs(int(visibility[p]) - int(truth[p])));
    }
    const double count = std::max<double>(1.0, double(pairs.count()));
    return {{"pair_count", pairs.count()},
            {"occluded_count", occluded},
            {"false_shadow_count", falseShadow},
            {"false_light_count", falseLight},
            {"mean_abs_visibility_error", double(difference) / double(kLit) / count}};
}

Json flickerJson(const FlickerCounts& counts) {
    const FlickerCounts::Class total = counts.total();
    Json json = {{"flicker_point_count", counts.pointCount},
                 {"flicker_answer_count", total.answerCount},
                 {"flicker_count", total.flickerCount},
                 {"flicker_explained_count", total.explainedCount},
                 {"flicker_contact_count", total.contactCount},
                 {"flicker_acne_count", total.acneCount},
                 {"flicker_truth_change_count", counts.truthChangeCount},
                 {"flicker_unanswered_count", counts.unansweredCount},
                 {"flicker_missing_tap_count", counts.missingTapCount}};
    const std::pair<const char*, FlickerChange> kinds[] = {
        {"held", FlickerChange::kHeld},
        {"resolution_switch", FlickerChange::kResolutionSwitch},
        {"method_switch", FlickerChange::kMethodSwitch}};
    for (const auto& [name, change] : kinds) {
        const FlickerCounts::Class& of = counts.of(change);
        const std::string key = std::string("flicker_") + name;
        json[key + "_answer_count"] = of.answerCount;
        json[key + "_count"] = of.flickerCount;
        json[key + "_explained_count"] = of.explainedCount;
        json[key + "_contact_count"] = of.contactCount;
        json[key + "_acne_count"] = of.acneCount;
    }
    return json;
}

/// One configuration with what it keeps.
struct Player {
    /// @param scene shares what stands for the scene
    Player(const RunParameters& run, const FrameRenderer& scene, const Truth& truth,
           const Experiment& experiment, const MeasureContext& context)
        : run(run), isTruth(run.method == "embree"),
          renderer(isTruth ? nullptr : scene.shareScene()),
          model(makeCostModel(isTruth ? "texels:0" : run.model)),
          flicker(truth, experiment.errorSeed, experiment.flickerPoints) {
        if (model->needsCosts())
            throw Error(ErrorKind::kUsage,
                        "model '" + run.model +
                            "' needs the costs of every frame measured, and a sequence has none; "
                            "leave it out or compare frames that stand for themselves");
        if (context.given != nullptr)
            giveCalibration(*model, *context.given);
        options = run.frame;
    }

    const RunParameters& run;
    bool isTruth;
    std::unique_ptr<FrameRenderer> renderer; ///< none for the truth
    std::unique_ptr<CostModel> model;
    FlickerMeter flicker;
    FrameOptions options;
    StageTimes update; ///< of following the frame shown now
};

/// What stands for the scene with one DAG, held by a renderer, and those who share it.
struct SharedScene {
    std::unique_ptr<FrameRenderer> renderer;
    std::vector<Player*> players;
};

double msSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

/// Plays a scene's frames to all configurations.
class SequencePlayer {
public:
    SequencePlayer(LoadedScene& scene, const std::vector<Dag>& dags, const Experiment& experiment,
                   const std::vector<RunParameters>& runs, const MeasureContext& context)
        : scene_(scene), experiment_(experiment), context_(context), truth_(*scene.world),
          steps_(sequenceSteps(context.frames, experiment.leadIn)),
          part_(scene.geometryHash + "/" + scene.name + "/sequence/") {
        // Those without rays share the scene with those that trace the first DAG.
        std::vector<size_t> sceneOf;
        for (const RunParameters& run : runs)
            sceneOf.push_back(run.usesRays() ? run.dag : 0);
        scenes_.resize(1 + *std::max_element(sceneOf.begin(), sceneOf.end()));
        sceneOf.push_back(0);
        for (const size_t s : sceneOf)
            if (!scenes_[s].renderer)
                scenes_[s].renderer = std::make_unique<FrameRenderer>(
                    context.backend, *scene.world, s < dags.size() ? dags[s] : kNoDag);
        for (size_t i = 0; i < runs.size(); ++i) {
            players_.push_back(std::make_unique<Player>(runs[i], *scenes_[sceneOf[i]].renderer,
                                                        truth_, experiment, context));
            scenes_[sceneOf[i]].players.push_back(players_.back().get());
        }
        pairOptions_.width = experiment.width;
        pairOptions_.height = experiment.height;
    }

    SceneMeasurement measure() {
        const int rounds = experiment_.warmups + experiment_.repeats;
        stepCount_ = steps_.size() * size_t(1 + rounds);
        answer();
        for (int round = 0; round < rounds; ++round)
            time(round);
        const std::vector<Timing> timings = gatherTimes();
        SceneMeasurement out;
        for (size_t step = 0; step < steps_.size(); ++step)
            for (const Json& row : *part(answersOf(step))) {
                Json json = Json::object();
                for (const auto& [key, value] : row.items()) {
                    json[key] = value;
                    if (key == "label")
                        json.update(timings[out.sequenceRuns.size()].toJson());
                }
                out.sequenceRuns.push_back(std::move(json));
            }
        return out;
    }

private:
    const Json* part(const std::string& name) const { return context_.journal->find(part_ + name); }
    static std::string answersOf(size_t step) { return "answers/" + std::to_string(step); }
    static std::string timesOf(int round) { return "times/" + std::to_string(round); }

    void progress(size_t steps) {
        stepsDone_ += steps;
        if (context_.progress)
            context_.progress(double(stepsDone_) / double(stepCount_));
    }

    void rewind() {
        camera_ = std::make_unique<FrameCamera>(experiment_.camera);
        show(steps_.front().frame);
        for (const std::unique_ptr<Player>& player : players_)
            if (!player->isTruth) {
                player->renderer->reset();
                player->flicker.forget();
            }
    }

    /// Moves the world and all that follow it to a frame.
    void show(uint32_t frame) {
        World& world = *scene_.world;
        const std::vector<uint32_t> moved = world.setTime(experiment_.timeOfFrame(frame));
        for (const SharedScene& scene : scenes_) {
            if (!scene.renderer)
                continue;
            StageTimes ofLevels;
            const StageTimes stages = scene.renderer->worldChanged(moved, &ofLevels);
            for (Player* player : scene.players) {
                player->update = stages;
                if (player->options.maps.lodTexels > 0.0f)
                    for (const auto& [name, timeMs] : ofLevels.stagesMs)
                        player->update.add(name, timeMs);
            }
        }
        isTruthStale_ |= !moved.empty();
        view_ = camera_->at(world);
    }

    const Truth& truth() {
        if (isTruthStale_)
            truth_.update(*scene_.world);
        isTruthStale_ = false;
        return truth_;
    }

    /// Pairs and truth belong to the frame, not to a configuration: whose renderer finds them.
    FrameRenderer& witness() { return *scenes_.front().renderer; }
    PairList listPairs() { return witness().listPairs(view_, pairOptions_); }

    FrameResult render(Player& player, bool recordPairs) {
        player.options.recordPairs = recordPairs;
        return player.renderer->render(view_, *player.model, player.options);
    }

    /// Renders everything once with recording, from the first step on that the journal lacks.
    void answer() {
        size_t done = 0;
        while (done < steps_.size() && part(answersOf(done)) != nullptr)
            ++done;
        if (done == steps_.size())
            return progress(done);
        rewind();
        for (size_t s = 0; s < steps_.size(); ++s) {
            checkInterrupted();
            const SequenceStep& step = steps_[s];
            show(step.frame);
            if (s + 1 < done) {
                for (const std::unique_ptr<Player>& player : players_)
                    pass(*player);
                progress(1);
                continue;
            }
            Json rows = Json::array();
            const PairList pairs = listPairs();
            const std::vector<uint8_t> visibility =
                truth().visibility(witness().gbuffer(), scene_.world->lights(), pairs);
            for (const std::unique_ptr<Player>& player : players_) {
                Json row = player->isTruth ? answerTruth(pairs, visibility)
                                           : answerMethod(*player, pairs, visibility);
                if (!step.isCounted)
                    continue;
                Json json = {{"scene", scene_.name},
                             {"frame", step.frame},
                             {"method", player->run.method},
                             {"model", player->run.model},
                             {"parameters", player->run.toJson()},
                             {"label", player->run.label()}};
                json.update(row);
                rows.push_back(std::move(json));
            }
            if (s >= done) // the one before is rendered again for the points that it draws
                context_.journal->set(part_ + answersOf(s), std::move(rows));
            progress(1);
        }
    }

    /// Brings a player past a step whose answers are known.
    void pass(Player& player) {
        if (player.isTruth)
            return;
        render(player, false);
        player.flicker.skip();
    }

    Json answerTruth(const PairList& pairs, const std::vector<uint8_t>& visibility) const {
        Json json = confusionJson(pairs, visibility, visibility);
        FrameCounts counts;
        counts.rayCount = pairs.count();
        json.update(toJson(counts));
        json["lighting_computation_count"] = 0;
        json.update(flickerJson({}));
        return json;
    }

    Json answerMethod(Player& player, const PairList& pairs,
                      const std::vector<uint8_t>& truthVisibility) {
        const FrameResult result = render(player, true);
        if (result.pairs.count() != pairs.count())
            throw std::logic_error("the pairs of " + player.run.label() +
                                   " differ from those of the truth");
        Json json = confusionJson(pairs, result.visibility, truthVisibility);
        json.update(toJson(result.counts));
        uint64_t computations = result.counts.provenPairCount;
        for (const MapRecord& map : result.maps)
            computations += map.quantities.samples;
        json["lighting_computation_count"] = computations;
        json["dag_bytes"] = player.run.usesRays() ? player.renderer->dagBytes() : 0;
        if (experiment_.flickerPoints > 0) {
            const World& world = *scene_.world;
            const ErrorInputs inputs{player.renderer->gbuffer(),
                                     world.triangles(),
                                     viewOf(world.lights()),
                                     result.pairs,
                                     result.visibility,
                                     result.pairRoute,
                                     result.pairServer,
                                     {player.renderer->rayInputs(player.options.rays),
                                      player.renderer->shadowMaps(), player.options.bias}};
            json.update(flickerJson(player.flicker.add({inputs, view_})));
        } else {
            json.update(flickerJson({}));
        }
        return json;
    }

    /// Renders everything once more for time alone, unless the journal knows this round.
    void time(int round) {
        if (part(timesOf(round)) != nullptr)
            return progress(steps_.size());
        rewind();
        Json times = Json::array(); // by counted frame and player: its stages
        for (size_t s = 0; s < steps_.size(); ++s) {
            checkInterrupted();
            show(steps_[s].frame);
            std::vector<Json> ofStep(players_.size());
            for (size_t i = 0; i < players_.size(); ++i) {
                const size_t index = (i + s + size_t(round)) % players_.size();
                ofStep[index] = timeOne(*players_[index]).stagesMs;
            }
            if (steps_[s].isCounted)
                for (Json& stages : ofStep)
                    times.push_back(std::move(stages));
            progress(1);
        }
        context_.journal->set(part_ + timesOf(round), std::move(times));
    }

    /// Returns the times of all rounds that count, by counted frame and player.
    std::vector<Timing> gatherTimes() const {
        std::vector<Timing> timings(context_.frames.size() * players_.size());
        for (int round = experiment_.warmups; round < experiment_.warmups + experiment_.repeats;
             ++round) {
            const Json& times = *part(timesOf(round));
            for (size_t i = 0; i < timings.size(); ++i) {
                StageTimes stages;
                for (const Json& stage : times[i])
                    stages.add(stage[0].get<std::string>(), stage[1].get<double>());
                timings[i].add(stages);
            }
        }
        return timings;
    }

    StageTimes timeOne(Player& player) {
        StageTimes stages;
        if (player.isTruth) {
            const PairList pairs = listPairs();
            const Truth& embree = truth();
            const auto start = std::chrono::steady_clock::now();
            embree.visibility(witness().gbuffer(), scene_.world->lights(), pairs);
            stages.add("embree rays", msSince(start));
            return stages;
        }
        stages = player.update;
        for (const auto& [name, timeMs] : render(player, false).stages.stagesMs)
            stages.add(name, timeMs);
        return stages;
    }

    LoadedScene& scene_;
    const Experiment& experiment_;
    const MeasureContext& context_;
    Truth truth_;
    std::vector<SequenceStep> steps_;
    std::string part_;
    FrameOptions pairOptions_;
    std::vector<SharedScene> scenes_; ///< by DAG; the first is always there
    std::vector<std::unique_ptr<Player>> players_;
    std::unique_ptr<FrameCamera> camera_;
    Camera view_;
    bool isTruthStale_ = false;
    size_t stepCount_ = 1, stepsDone_ = 0;
};

} // namespace

std::vector<SequenceStep> sequenceSteps(const std::vector<uint32_t>& frames, uint32_t leadIn) {
    std::vector<SequenceStep> steps;
    for (const uint32_t frame : frames) {
        const uint32_t first = frame - std::min(frame, leadIn);
        for (uint32_t before = first; before < frame; ++before)
            if (steps.empty() || before > steps.back().frame)
                steps.push_back({before, false});
        if (frame == 0 && leadIn > 0)
            steps.push_back({0, false});
        steps.push_back({frame, true});
    }
    return steps;
}

SceneMeasurement measureSequence(LoadedScene& scene, const std::vector<Dag>& dags,
                                 const Experiment& experiment,
                                 const std::vector<RunParameters>& runs,
                                 const MeasureContext& context) {
    return SequencePlayer(scene, dags, experiment, runs, context).measure();
}

} // namespace shadowdag
