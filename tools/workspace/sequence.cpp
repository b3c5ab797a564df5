// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/sequence.h"

#include "cuda/error.h"
#include "hybrid/judge/flicker.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/console.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/judge.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace shadowdag {

namespace {

/// Counts a frame's wrong results without explanation.
Json confusionJson(const PairList& pairs, const std::vector<uint8_t>& visibility,
                   const std::vector<uint8_t>& truth) {
    const ErrorCounts counts = countWrong(pairs, visibility, truth);
    return {{"pair_count", counts.pairCount},
            {"occluded_count", counts.occludedCount},
            {"false_shadow_count", counts.falseShadowCount},
            {"false_light_count", counts.falseLightCount},
            {"mean_abs_visibility_error", counts.meanAbsVisibilityError()}};
}

Json flickerJson(const FlickerCounts& counts) {
    const FlickerCounts::Class total = counts.total();
    Json json = {{"flicker_point_count", counts.pointCount},
                 {"flicker_answer_count", total.answerCount},
                 {"flicker_count", total.flickerCount},
                 {"flicker_explained_count", total.explainedCount},
                 {"flicker_contact_count", total.contactCount},
                 {"flicker_acne_count", total.acneCount},
                 {"flicker_magnified_count", total.magnifiedCount},
                 {"flicker_truth_change_count", counts.truthChangeCount},
                 {"flicker_unanswered_count", counts.missingResultCount},
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
        json[key + "_magnified_count"] = of.magnifiedCount;
    }
    return json;
}

/// One configuration with its state.
struct Player {
    /// @param role of its renderer
    Player(const RunParameters& run, Workspace& workspace, size_t role,
           const Experiment& experiment, const MeasureContext& context)
        : run(run), renderer(&workspace.renderer(run, role)), model(makeCostModel(run.model)),
          flicker(workspace.truth(), experiment.errorSeed, experiment.flickerPoints) {
        if (context.given != nullptr)
            giveCalibration(*model, *context.given);
        options = run.frame;
    }

    const RunParameters& run;
    FrameRenderer* renderer;
    std::unique_ptr<CostModel> model;
    FlickerMeter flicker;
    FrameOptions options;
    std::vector<glm::vec3> display; ///< the picture of the frame recorded before; empty: none
};

/// Shows a scene's frames to all configurations.
class SequencePlayer {
public:
    SequencePlayer(Workspace& workspace, const Experiment& experiment,
                   const std::vector<RunParameters>& runs, const MeasureContext& context)
        : workspace_(workspace), experiment_(experiment), context_(context),
          witness_(workspace.renderer(RunParameters{})),
          steps_(sequenceSteps(context.frames, experiment.leadIn)),
          part_(workspace.scene().geometryHash + "/" + workspace.scene().name + "/sequence/") {
        refuseModelsOfCosts(runs);
        for (size_t i = 0; i < runs.size(); ++i)
            players_.push_back(
                std::make_unique<Player>(runs[i], workspace, 1 + i, experiment, context));
        pairOptions_.width = experiment.width;
        pairOptions_.height = experiment.height;
    }

    SceneMeasurement measure() {
        const int rounds = experiment_.warmups + experiment_.repeats;
        stepCount_ = steps_.size() * size_t(1 + rounds);
        answer();
        for (int round = 0; round < rounds; ++round)
            time(round);
        const Json otherCpuShare = meanOtherShare(rounds);
        const std::vector<Timing> timings = gatherTimes();
        const auto embree = std::find_if(players_.begin(), players_.end(), [](const auto& player) {
            return methodOf(player->run.method).needs().embree;
        });
        const size_t embreeIndex = size_t(embree - players_.begin());
        SceneMeasurement out;
        for (size_t step = 0; step < steps_.size(); ++step)
            for (const Json& row : *part(partOfStep(step))) {
                Json json = Json::object();
                for (const auto& [key, value] : row.items()) {
                    json[key] = value;
                    if (key == "label") {
                        const size_t i = out.sequenceRuns.size();
                        json.update(timings[i].toJson());
                        if (embree != players_.end())
                            json.update(ratioJson("time_over_embree", timings[i],
                                                  timings[i - i % players_.size() + embreeIndex]));
                        json["other_cpu_share"] = otherCpuShare;
                    }
                }
                out.sequenceRuns.push_back(std::move(json));
            }
        return out;
    }

private:
    const Json* part(const std::string& name) const { return context_.journal->find(part_ + name); }
    static std::string partOfStep(size_t step) { return "answers/" + std::to_string(step); }
    static std::string partOfRound(int round) { return "times/" + std::to_string(round); }

    void progress(size_t steps) {
        stepsDone_ += steps;
        if (context_.progress)
            context_.progress(double(stepsDone_) / double(stepCount_));
    }

    void rewind() {
        show(steps_.front().frame);
        workspace_.resetRenderers();
        for (const std::unique_ptr<Player>& player : players_) {
            player->flicker.forget();
            player->display.clear();
        }
    }

    /// Moves the world and all that depend on it to a frame.
    void show(uint32_t frame) {
        workspace_.advance(experiment_.timeOfFrame(frame));
        view_ = workspace_.camera();
    }

    /// Pairs belong to the frame, not to a configuration, so any renderer may find them.
    PairList listPairs() { return witness_.listPairs(view_, pairOptions_); }
    std::vector<uint8_t> askTruth(const Truth& truth, const PairList& pairs) const {
        return truth.visibility(witness_.gbuffer(), workspace_.world().lights(), pairs);
    }

    FrameResult render(Player& player, bool recordPairs) {
        player.options.recordPairs = recordPairs;
        return player.renderer->render(view_, *player.model, player.options);
    }

    /// Renders everything once with recording, starting at the first step that the journal lacks.
    void answer() {
        size_t done = 0;
        while (done < steps_.size() && part(partOfStep(done)) != nullptr)
            ++done;
        if (done == steps_.size())
            return progress(done);
        rewind();
        setExposure();
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
            if (step.isCounted)
                fewPairsWarning(workspace_.scene().name + ", frame " + std::to_string(step.frame),
                                pairs.count(),
                                {experiment_.lightCount >= 0, workspace_.isCameraAutomatic()});
            const std::vector<uint8_t> visibility = askTruth(workspace_.truth(), pairs);
            const std::vector<glm::vec3> truthDisplay = displayOfTruth(pairs, visibility);
            for (const std::unique_ptr<Player>& player : players_) {
                const Json row = computeMethodResult(*player, pairs, visibility, truthDisplay);
                if (!step.isCounted)
                    continue;
                Json json = {
                    {"scene", workspace_.scene().name},    {"frame", step.frame},
                    {"camera_numbers", cameraText(view_)}, {"method", player->run.method},
                    {"model", player->run.model},          {"parameters", player->run.toJson()},
                    {"label", player->run.label()}};
                json.update(row);
                rows.push_back(std::move(json));
            }
            truthDisplay_ = truthDisplay;
            if (s >= done) // the one before is rendered again for the points that it draws
                context_.journal->set(part_ + partOfStep(s), std::move(rows));
            progress(1);
        }
    }

    /// Advances a player past a step whose results are known.
    void pass(Player& player) {
        render(player, false);
        player.flicker.skip();
    }

    /// Sets the exposure of all pictures: with one of its own each frame would change by it.
    void setExposure() {
        exposure_ = float(experiment_.exposure);
        if (exposure_ > 0)
            return;
        const PairList pairs = listPairs();
        exposure_ = autoExposure(shadePairs(witness_.gbuffer(), workspace_.world(), pairs,
                                            askTruth(workspace_.truth(), pairs)));
    }

    std::vector<glm::vec3> displayOfTruth(const PairList& pairs,
                                          const std::vector<uint8_t>& visibility) const {
        return toneMap(shadePairs(witness_.gbuffer(), workspace_.world(), pairs, visibility),
                       exposure_);
    }

    /// @param truthDisplay the truth's picture of this frame
    Json computeMethodResult(Player& player, const PairList& pairs,
                             const std::vector<uint8_t>& truthVisibility,
                             const std::vector<glm::vec3>& truthDisplay) {
        const PairResults answers =
            pairResultsOf(render(player, true), *player.renderer, player.options);
        const FrameResult& result = answers.frame;
        if (result.pairs.count() != pairs.count())
            throw std::logic_error("the pairs of " + player.run.label() +
                                   " differ from those of the truth");
        Json json = confusionJson(pairs, result.visibility, truthVisibility);
        if (player.options.rays.believesNone() &&
            (player.run.usesTriangles() || player.run.usesEmbree()))
            json.update(adjudicate(workspace_.world(), answers,
                                   wrongPairsOfExactRays(answers, truthVisibility))
                            .json());
        json.update(toJson(result.counts));
        uint64_t computations = result.counts.provenPairCount;
        for (const MapRecord& map : result.maps)
            computations += map.quantities.samples;
        json["lighting_computation_count"] = computations;
        json["dag_bytes"] = player.run.usesVoxels() ? player.renderer->dagBytes() : 0;
        json["exact_bytes"] = triangleBytes(player.run, *player.renderer);
        std::vector<glm::vec3> display = toneMap(result.color, exposure_);
        if (!player.display.empty())
            json["frame_difference_error"] =
                computeFrameDifferenceError(player.display, display, truthDisplay_, truthDisplay);
        player.display = std::move(display);
        json.update(
            flickerJson(experiment_.flickerPoints > 0
                            ? player.flicker.add({errorInputs(workspace_.world(), answers), view_})
                            : FlickerCounts{}));
        return json;
    }

    /// Renders everything once more for times alone, unless the journal has this round.
    void time(int round) {
        if (part(partOfRound(round)) != nullptr)
            return progress(steps_.size());
        rewind();
        const CpuUse use;
        Json times = Json::array(); // by counted frame and player: its stages
        for (size_t s = 0; s < steps_.size(); ++s) {
            checkInterrupted();
            show(steps_[s].frame);
            std::vector<Json> ofStep(players_.size());
            runInTurn(players_.size(), s + size_t(round),
                      [&](size_t i) { ofStep[i] = timeOne(*players_[i]).stagesMs; });
            if (steps_[s].isCounted)
                for (Json& stages : ofStep)
                    times.push_back(std::move(stages));
            progress(1);
        }
        context_.journal->set(
            part_ + partOfRound(round),
            {{"times", std::move(times)}, {"other_cpu_share", otherShareJson(use.otherShare())}});
    }

    /// Returns the mean share of others in the processor's time, of the rounds where it is known,
    /// also those that an earlier run measured; null if it is of none.
    Json meanOtherShare(int rounds) const {
        double sum = 0;
        int count = 0;
        for (int round = 0; round < rounds; ++round)
            if (const Json& share = (*part(partOfRound(round)))["other_cpu_share"];
                share.is_number()) {
                sum += share.get<double>();
                ++count;
            }
        return count > 0 ? Json(sum / count) : Json();
    }

    /// Returns the times of all counted rounds, by counted frame and player.
    std::vector<Timing> gatherTimes() const {
        std::vector<Timing> timings(context_.frames.size() * players_.size());
        for (int round = experiment_.warmups; round < experiment_.warmups + experiment_.repeats;
             ++round) {
            const Json& times = (*part(partOfRound(round)))["times"];
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
        const StageTimes drawn = render(player, false).stages;
        StageTimes stages;
        workspace_.followTimes(workspace_.voxelsOf(player.run)).addTo(stages, player.run);
        for (const auto& [name, timeMs] : drawn.stagesMs)
            stages.add(name, timeMs);
        return stages;
    }

    Workspace& workspace_;
    const Experiment& experiment_;
    const MeasureContext& context_;
    FrameRenderer& witness_;
    std::vector<SequenceStep> steps_;
    std::string part_;
    FrameOptions pairOptions_;
    std::vector<std::unique_ptr<Player>> players_;
    Camera view_;
    float exposure_ = 1.0f;
    std::vector<glm::vec3> truthDisplay_; ///< of the frame recorded before
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

void refuseModelsOfCosts(const std::vector<RunParameters>& runs) {
    for (const RunParameters& run : runs)
        if (run.isRouted() && makeCostModel(run.model)->needsCosts())
            throw Error(
                ErrorKind::kUsage,
                "model '" + run.model +
                    "' needs measured costs of every frame, which a sequence does not have; "
                    "omit it or compare independent frames");
}

SceneMeasurement measureSequence(Workspace& workspace, const Experiment& experiment,
                                 const std::vector<RunParameters>& runs,
                                 const MeasureContext& context) {
    return SequencePlayer(workspace, experiment, runs, context).measure();
}

} // namespace shadowdag
