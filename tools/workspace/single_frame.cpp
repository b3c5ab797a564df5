// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/single_frame.h"

#include "cuda/error.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/settings/variants.h"

#include <algorithm>

namespace shadowdag {

void MethodOptions::declare(CommandLine& commandLine, const std::string& methods) {
    commandLine.heading("Method");
    commandLine.text("--method", method, methods,
                     "embree: the truth; dag: all lights by rays through voxels; dag-exact: the "
                     "same, every hit confirmed against triangles; maps: all by virtual cube "
                     "shadow maps; hybrid: each by the method that --model chooses [" +
                         method + "]");
    commandLine.text("--model", model, "M",
                     "For hybrid: texels:N (maps under N texels are traced), expr:EXPRESSION (rays "
                     "where it is over 0), "
                     "cost (the cheaper by what maps cost on this machine, as --costs knows it), "
                     "oracle (the cheaper by measured cost) [texels:96]");
    commandLine.text("--costs", costs, "F",
                     "Costs for --model cost, as calibrate writes them; or for --model oracle, as "
                     "compare writes them, else these are measured");
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
                                               "says it; drop one of them");
    const Variant parsed = parseVariant("--variant", variant);
    if (parsed.taps != 0 && commandLine.given("--taps"))
        throw Error(ErrorKind::kUsage, "--taps and --variant '" + variant +
                                           "' contradict each other: the name says it; drop one "
                                           "of them");
    if (!commandLine.given("--taps"))
        taps = kPaperTaps;
    const RunParameters run = variantRun(parsed, FrameOptions{});
    method = run.method;
    model = run.method == "hybrid" ? run.model : "";
    variant = run.variant;
}

std::optional<RunParameters> MethodOptions::named(const FrameOptions& base) const {
    if (variant.empty())
        return std::nullopt;
    return variantRun(parseVariant("--variant", variant), base);
}

void MethodOptions::check(const CommandLine& commandLine,
                          const std::vector<std::string>& allowed) const {
    checkMethod("--method", method, allowed);
    if (method != "hybrid" && commandLine.given("--model"))
        throw Error(ErrorKind::kUsage,
                    "--model is for --method hybrid, not for '" + method + "'; drop one of them");
    const std::unique_ptr<CostModel> chosen = makeModel();
    if (!chosen->needsCosts() && !chosen->needsCalibration() && commandLine.given("--costs"))
        throw Error(ErrorKind::kUsage,
                    "--costs is for --method hybrid --model cost or oracle; drop it");
    if (costs.empty())
        giveCalibration(*chosen, {}); // what is missing is told before any work
    RunParameters run = named({}).value_or(RunParameters());
    run.method = method;
    refuseUnread(run, commandLine);
}

std::unique_ptr<CostModel> MethodOptions::makeModel() const {
    return makeCostModel(modelText(method, model));
}

SingleFrames::SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                           const Experiment& experiment, const MethodOptions& method,
                           bool wantsTruth, Backend backend, const Console& console)
    : frameCamera_(experiment.camera), method_(method), model_(method.makeModel()) {
    if (!method.costs.empty()) {
        costs_ = readCostSource(method.costs, buildProvenance(backend));
        if (model_->needsCosts() && !costs_.table)
            throw Error(ErrorKind::kUsage, "--costs " + method.costs +
                                               ": is a calibration for --model cost; --model "
                                               "oracle replays what compare writes to costs.json");
        giveCalibration(*model_, costs_);
    }
    scene_ = loadSceneAndWorld(sceneArgument, experiment.lightCount, experiment.lightSeed, true,
                               console);
    const std::optional<RunParameters> named = method.named({});
    if (methodUsesVoxels(method.method) || (named && named->usesRays())) {
        refuseStaleExact(method.method == "dag-exact", options.allowStale);
        const VoxelSource source{options.voxels, options.cache, options.allowStale};
        dag_ = std::move(obtainDags(scene_, experiment.resolutionLog2, source, console).front());
    }
    frameOptions_ = baseOptions(experiment);
    if (method.taps)
        frameOptions_.maps.taps = frameOptions_.bias.taps = *method.taps;
    if (method.method == "dag-exact")
        frameOptions_.rays.kind = RayKind::kExact;
    if (const std::optional<RunParameters> run = method.named(frameOptions_))
        frameOptions_ = run->frame;
    if (frameOptions_.routeMargin > 0 && experiment.frames.size() < 2)
        throw Error(ErrorKind::kUsage, "--variant '" + method.variant +
                                           "': a margin of routes is for frames that follow each "
                                           "other; name several with --frames, or drop RH");
    RunParameters run;
    run.method = method.method;
    run.model = method.model.empty() ? "texels:96" : method.model;
    run.resolution = dag_.isBuilt() ? uint32_t(dag_.grid.resolution()) : 0;
    run.frame = frameOptions_;
    refuseDeepLods({run});
    for (const std::string& remark : remarksOn(costs_, {run}))
        console.note(remark);
    errorSeed_ = experiment.errorSeed;
    checkInterrupted();
    renderer_ = std::make_unique<FrameRenderer>(backend, *scene_.world, dag_);
    checkInterrupted();
    if (wantsTruth)
        truth_ = std::make_unique<Truth>(*scene_.world);
}

const FrameResult& SingleFrames::render(float timeSeconds, uint32_t frame) {
    if (timeSeconds != scene_.world->timeSeconds()) {
        const std::vector<uint32_t> moved = scene_.world->setTime(timeSeconds);
        renderer_->worldChanged(moved);
        if (truth_ && !moved.empty())
            truth_->update(*scene_.world);
    }
    camera_ = frameCamera_.at(*scene_.world);
    if (method_.method == "embree") { // what a method would answer nobody looks at
        result_ = {};
        result_.pairs = renderer_->listPairs(camera_, frameOptions_);
        return result_;
    }
    const bool areRoutesHeld = frameOptions_.routeMargin > 0;
    if (model_->needsCosts()) {
        if (areRoutesHeld)
            throw Error(ErrorKind::kUsage,
                        "a margin of routes needs frames that follow each other, and model '" +
                            method_.model + "' measures each for itself; drop one of them");
        renderer_->reset();
        model_->setCosts(costs_.table ? findCosts(*costs_.table, method_.costs, scene_.name, frame)
                                      : renderer_->measureCosts(camera_, frameOptions_));
    }
    if (!areRoutesHeld)
        renderer_->reset();
    result_ = renderer_->render(camera_, *model_, frameOptions_);
    return result_;
}

ErrorOptions SingleFrames::errorOptions() const {
    ErrorOptions options;
    options.seed = errorSeed_;
    options.rays = frameOptions_.rays;
    options.bias = frameOptions_.bias;
    return options;
}

std::vector<uint8_t> SingleFrames::truthVisibility(const FrameResult& frame) const {
    return truth_->visibility(renderer_->gbuffer(), scene_.world->lights(), frame.pairs);
}

} // namespace shadowdag
