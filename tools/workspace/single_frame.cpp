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
    model = run.isRouted() ? run.model : "";
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
    if (!methodOf(method).needs().routing && commandLine.given("--model"))
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
    return makeCostModel(methodOf(method).modelText(model));
}

SingleFrames::SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                           const Experiment& experiment, const MethodOptions& method,
                           Backend backend, const Console& console)
    : method_(method), model_(method.makeModel()) {
    if (!method.costs.empty()) {
        costs_ = readCostSource(method.costs, buildProvenance(backend));
        if (model_->needsCosts() && !costs_.table)
            throw Error(ErrorKind::kUsage, "--costs " + method.costs +
                                               ": is a calibration for --model cost; --model "
                                               "oracle replays what compare writes to costs.json");
        giveCalibration(*model_, costs_);
    }
    const VoxelSource source{options.voxels, options.cache, options.allowStale};
    workspace_ =
        std::make_unique<Workspace>(loadSceneAndWorld(sceneArgument, experiment.lightCount,
                                                      experiment.lightSeed, true, console),
                                    WorkspaceOptions{backend, experiment.camera, source, &console});
    judge_ =
        std::make_unique<Judge>(*workspace_, experiment.errorSeed, ErrorOptions{}.nullSampleCount);
    run_.method = method.method;
    run_.model = method.model.empty() ? "texels:96" : method.model;
    run_.frame = baseOptions(experiment);
    if (method.taps)
        run_.frame.maps.taps = run_.frame.bias.taps = *method.taps;
    methodOf(method.method).configure(run_.frame);
    if (const std::optional<RunParameters> named = method.named(run_.frame))
        run_.frame = named->frame;
    if (run_.usesRays()) {
        refuseStaleExact(methodOf(method.method).needs().triangles, options.allowStale);
        run_.resolution = 1u << workspace_->obtainVoxels(experiment.resolutionLog2).front();
    }
    if (run_.frame.routeMargin > 0 && experiment.frames.size() < 2)
        throw Error(ErrorKind::kUsage, "--variant '" + method.variant +
                                           "': a margin of routes is for frames that follow each "
                                           "other; name several with --frames, or drop RH");
    refuseDeepLods({run_});
    for (const std::string& remark : remarksOn(costs_, {run_}))
        console.note(remark);
    workspace_->renderer(run_);
}

const Answers& SingleFrames::render(float timeSeconds, uint32_t frame) {
    workspace_->setTime(timeSeconds);
    judge_->forget();
    FrameRenderer& renderer = workspace_->renderer(run_);
    const Camera camera = workspace_->camera();
    if (methodOf(method_.method).isTruth()) { // what a method would answer nobody looks at
        answers_ = {};
        answers_.frame.pairs = renderer.listPairs(camera, run_.frame);
        answers_.gbuffer = renderer.gbuffer();
        return answers_;
    }
    const bool areRoutesHeld = run_.frame.routeMargin > 0;
    if (model_->needsCosts()) {
        if (areRoutesHeld)
            throw Error(ErrorKind::kUsage,
                        "a margin of routes needs frames that follow each other, and model '" +
                            method_.model + "' measures each for itself; drop one of them");
        renderer.reset();
        model_->setCosts(costs_.table ? findCosts(*costs_.table, method_.costs, sceneName(), frame)
                                      : renderer.measureCosts(camera, run_.frame));
    }
    if (!areRoutesHeld)
        renderer.reset();
    answers_ = answersOf(renderer.render(camera, *model_, run_.frame), renderer, run_.frame);
    return answers_;
}

const std::vector<uint8_t>& SingleFrames::truthVisibility() {
    return judge_->truth(0, answers_.gbuffer, answers_.frame.pairs).visibility;
}

const FrameTruth& SingleFrames::truthPicture(float exposure) {
    return judge_->picture(0, answers_.gbuffer, answers_.frame.pairs, exposure);
}

} // namespace shadowdag
