// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/single_frame.h"

#include "cuda/error.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <chrono>

namespace shadowdag {

void MethodOptions::declare(CommandLine& commandLine, const std::string& methods) {
    commandLine.heading("Method");
    commandLine.text("--method", method, methods,
                     std::string(methods.starts_with("truth|") ? "truth: what errors are measured "
                                                                 "against; "
                                                               : "") +
                         "dag: all lights by rays, see "
                         "--believe; maps: all by virtual cube "
                         "shadow maps; hybrid: each by the method that --model chooses; "
                         "embree: all lights by Embree's packets [" +
                         method + "]");
    commandLine.text("--model", model, "M",
                     "For hybrid: texels:N (maps under N texels are traced), expr:EXPRESSION (rays "
                     "where it is over 0), "
                     "cost (the cheaper by the predicted costs on this machine, see --costs), "
                     "oracle (the cheaper by measured cost) [texels:96]");
    commandLine.text("--costs", costs, "F",
                     "Costs for --model cost, as calibrate writes them; or for --model oracle, as "
                     "compare writes them; without it these are measured");
    commandLine.text("--variant", variant, "NAME",
                     "Instead of --method and --model: a variant by name, as in PMCD-EB-4SM-u2; "
                     "compare --help lists the parts");
}

void MethodOptions::takeVariant(const CommandLine& commandLine) {
    if (!commandLine.given("--variant"))
        return;
    for (const char* option :
         {"--method", "--model", "--undersample", "--maps-per-light", "--polygon-lod"})
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) +
                                               " and --variant contradict each other: the name "
                                               "sets it; drop one of them");
    const Variant parsed = parseVariant("--variant", variant);
    if (parsed.taps != 0 && commandLine.given("--taps"))
        throw Error(ErrorKind::kUsage, "--taps and --variant '" + variant +
                                           "' contradict each other: the name sets it; drop one "
                                           "of them");
    if (!commandLine.given("--taps"))
        taps = kPaperTaps;
    if (!commandLine.given("--believe"))
        believe = kPaperBelieve;
    const RunParameters run = variantRun(parsed, FrameOptions{});
    method = run.method;
    model = run.isRouted() ? run.model : "";
    variant = run.variant;
}

RunParameters MethodOptions::run(const Experiment& experiment) const {
    RunParameters run;
    run.method = method;
    run.model = model.empty() ? "texels:96" : model;
    run.frame = baseOptions(experiment);
    if (taps)
        run.frame.maps.taps = run.frame.bias.taps = *taps;
    if (believe)
        run.frame.rays.believe = *believe;
    if (!variant.empty())
        run.frame = variantRun(parseVariant("--variant", variant), run.frame).frame;
    methodOf(method).takeOver(run.frame.rays);
    return run;
}

void MethodOptions::check(const CommandLine& commandLine, const Experiment& experiment,
                          const std::vector<std::string>& allowed, const Console& console) const {
    checkMethod("--method", method, allowed);
    if (!methodOf(method).needs().routing && commandLine.given("--model"))
        throw Error(ErrorKind::kUsage,
                    "--model is for --method hybrid, not for '" + method + "'; drop one of them");
    const std::unique_ptr<CostModel> chosen = makeModel();
    if (!chosen->needsCosts() && !chosen->needsCalibration() && commandLine.given("--costs"))
        throw Error(ErrorKind::kUsage,
                    "--costs is for --method hybrid --model cost or oracle; drop it");
    if (costs.empty())
        giveCalibration(*chosen, {}); // missing input is reported before any work
    const RunParameters asked = run(experiment);
    refuseUnread(asked, commandLine);
    if (const std::string remark = noVoxelsRemark({asked}, commandLine); !remark.empty())
        console.note(remark);
}

std::unique_ptr<CostModel> MethodOptions::makeModel() const {
    return makeCostModel(methodOf(method).modelText(model));
}

Experiment MethodOptions::ranAlone(Experiment experiment) const {
    Experiment& e = experiment;
    e.methods.clear();
    e.thresholds.clear();
    e.models.clear();
    e.variants.clear();
    if (taps)
        e.taps = {*taps};
    if (believe)
        e.believe = {*believe};
    if (!variant.empty()) {
        e.variants = {variant};
        return experiment;
    }
    const Method& kind = methodOf(method);
    if (!kind.isTruth())
        e.methods = {method};
    if (kind.needs().routing)
        e.models = {kind.modelText(model)};
    return experiment;
}

SingleFrames::SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                           const Experiment& experiment, const MethodOptions& method,
                           Backend backend, const Console& console)
    : console_(console), allowsStale_(options.allowStale), method_(method),
      model_(method.makeModel()), experiment_(experiment) {
    if (!method.costs.empty()) {
        costs_ = readCostSource(method.costs, buildProvenance(backend));
        if (model_->needsCosts() && !costs_.table)
            throw Error(ErrorKind::kUsage, "--costs " + method.costs +
                                               ": is a calibration for --model cost; --model "
                                               "oracle replays the costs.json of compare");
        giveCalibration(*model_, costs_);
        if (model_->needsCosts()) {
            std::vector<std::string> names;
            for (uint32_t view = 0; view < experiment.viewCount; ++view)
                names.push_back(experiment.viewName(sceneNames({sceneArgument}).front(), view));
            requireCosts(*costs_.table, method.costs, names, experiment.frames, experiment.start);
        }
    }
    const VoxelSource source{options.voxels, options.cache, options.allowStale};
    workspace_ = std::make_unique<Workspace>(
        loadSceneAndWorld(sceneArgument, experiment.lightCount, experiment.lightSeed, true,
                          console),
        WorkspaceOptions{backend, experiment.camera, source, &console, experiment.viewCount});
    judge_ =
        std::make_unique<Judge>(*workspace_, experiment.errorSeed, ErrorOptions{}.nullSampleCount);
    run_ = method.run(experiment);
    if (run_.usesVoxels())
        run_.resolution = 1u << workspace_->obtainVoxels(experiment.resolutionLog2).front();
    if (run_.frame.routeMargin > 0 && experiment.frames.size() < 2)
        throw Error(ErrorKind::kUsage, "--variant '" + method.variant +
                                           "': a margin of routes is for sequences of "
                                           "frames; give several with --frames, or drop RH");
    refuseLods({run_});
    for (const std::string& remark : remarksOn(costs_, {run_}))
        console.note(remark);
    workspace_->renderer(run_);
}

void SingleFrames::setView(const std::string& camera) {
    workspace_->setView(camera, sceneNames({workspace_->scene().argument}).front() + " " + camera);
}

const PairResults& SingleFrames::render(float timeSeconds, uint32_t frame) {
    workspace_->setTime(timeSeconds);
    frame_ = frame;
    judge_->forget();
    const Camera camera = workspace_->camera();
    const auto step = console_.step("render by " + method_.method);
    FrameRenderer& renderer = workspace_->renderer(run_);
    if (methodOf(method_.method).isTruth()) { // the method's own results are not used
        answers_ = {};
        answers_.frame.pairs = renderer.listPairs(camera, run_.frame);
        answers_.gbuffer = renderer.gbuffer();
        return answers_;
    }
    const bool areRoutesHeld = run_.frame.routeMargin > 0;
    if (model_->needsCosts()) {
        if (areRoutesHeld)
            throw Error(ErrorKind::kUsage,
                        "a margin of routes needs a sequence of frames, but model '" +
                            method_.model + "' measures each frame separately; drop one of them");
        renderer.reset();
        if (costs_.table)
            model_->setCosts(
                findCosts(*costs_.table, method_.costs, {sceneName(), frame, run_.frame.start},
                          costConditions(workspace_->scene(), camera, experiment_, timeSeconds),
                          allowsStale_, console_));
        else
            model_->setCosts(renderer.measureCosts(camera, run_.frame));
    }
    answers_ = pairResultsOf(areRoutesHeld ? renderer.render(camera, *model_, run_.frame)
                                           : renderFrom(renderer, camera, *model_, run_.frame),
                             renderer, run_.frame);
    return answers_;
}

FrameResult SingleFrames::renderNext(float timeSeconds, uint32_t frame) {
    if (methodOf(method_.method).isTruth() || model_->needsCosts())
        throw Error(ErrorKind::kUsage, "frames of method '" + method_.method + "'" +
                                           (model_->needsCosts() ? ", model oracle," : "") +
                                           " are no sequence that can be timed; choose another");
    frame_ = frame;
    judge_->forget();
    answers_ = {}; // nothing was recorded
    FrameRenderer& renderer = workspace_->renderer(run_);
    FrameOptions options = run_.frame;
    options.recordPairs = options.recordQuantities = false;
    const auto start = std::chrono::steady_clock::now();
    workspace_->advance(timeSeconds);
    const double updateMs =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    FrameResult result = renderer.render(workspace_->camera(), *model_, options);
    result.wallMs += updateMs;
    workspace_->followTimes(workspace_->voxelsOf(run_)).addTo(result.stages, run_);
    return result;
}

Json SingleFrames::reproduction() const {
    Experiment experiment = method_.ranAlone(experiment_);
    experiment.scenes = {workspace_->scene().argument};
    RunParameters run = run_;
    run.model = methodOf(method_.method).modelText(method_.model);
    return {{"scene", sceneName()},
            {"scene_hash", workspace_->scene().geometryHash},
            {"content_hash", workspace_->scene().contentHash},
            {"frame", frame_},
            {"time_s", world().timeSeconds()},
            {"camera_numbers", cameraText(workspace_->camera())},
            {"method", run.method},
            {"model", run.model},
            {"parameters", run.toJson()},
            {"light_count", world().lights().size()},
            {"experiment", toJson(experiment)},
            {"provenance", buildProvenance(workspace_->backend())}};
}

const std::vector<uint8_t>& SingleFrames::truthVisibility() {
    const auto step = console_.step("Embree's answers");
    return judge_->truth(0, answers_.gbuffer, answers_.frame.pairs).visibility;
}

ErrorReport SingleFrames::judge() {
    truthVisibility();
    const auto step = console_.step("explain errors");
    return judge_->judge(0, answers_);
}

SelfChecks SingleFrames::checkItself(const ErrorReport& report) {
    if (answers_.frame.color.size() != answers_.gbuffer.count())
        return {}; // the truth has no frame
    const auto step = console_.step("check the frame itself");
    return checkFrame(*workspace_, answers_, report);
}

const FrameTruth& SingleFrames::truthPicture(float exposure) {
    const auto step = console_.step("Embree's picture");
    return judge_->picture(0, answers_.gbuffer, answers_.frame.pairs, exposure);
}

} // namespace shadowdag
