// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/unused_options.h"

#include "cuda/error.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <initializer_list>
#include <memory>

namespace shadowdag {

namespace {

/// Returns whether the variant of a run leaves its taps, or its margin, to the option.
bool leavesTaps(const RunParameters& run) {
    return run.usesMaps() &&
           (run.variant.empty() || parseVariant("variants", run.variant).taps == 0);
}
bool leavesMargin(const RunParameters& run) {
    return run.method == "hybrid" &&
           (run.variant.empty() || !parseVariant("variants", run.variant).routeMargin);
}

} // namespace

void refuseUnheeded(const Experiment& e, size_t assetCount, const std::string& experimentFile,
                    const CommandLine& commandLine) {
    // Which resolutions assets have makes no difference to what is heeded.
    const std::vector<uint32_t> resolutions =
        assetCount > 0 ? std::vector<uint32_t>(assetCount, 1) : allResolutions(e);
    const std::vector<RunParameters> runs =
        configurations(e, resolutions, assetCount > 0 ? assetCount : e.resolutionLog2.size());
    if (runs.empty())
        return;                                  // whoever measures says what leaves none
    const auto given = [&](const char* option) { // fit has fewer options than compare
        return commandLine.declares(option) && commandLine.given(option);
    };
    const std::string by = !experimentFile.empty() ? experimentFile
                           : e.variants.empty()    ? "--methods"
                                                   : "--variants";
    const auto refuse = [&](std::initializer_list<const char*> names, const std::string& what,
                            const std::string& remedy, const auto& heeds) {
        for (const char* option : names)
            if (given(option) && !std::any_of(runs.begin(), runs.end(), heeds))
                throw Error(ErrorKind::kUsage, std::string(option) + " is for " + what +
                                                   ", which " + by + " leaves out; " + remedy +
                                                   "drop it");
    };
    using Run = RunParameters;
    const bool isNamed = !e.variants.empty();
    const std::string addRays = isNamed ? "add RT or Hybrid, or " : "add dag or hybrid, or ",
                      addMaps =
                          isNamed ? "add a culling or Hybrid, or " : "add maps or hybrid, or ",
                      addHybrid = isNamed ? "add Hybrid, or " : "add hybrid, or ";
    refuse({"--offset", "--lod"}, "rays that stop at voxels", addRays,
           [](const Run& run) { return run.usesVoxelRays(); });
    refuse({"--voxels", "--resolution"}, "methods that trace voxels", addRays,
           [](const Run& run) { return run.usesRays(); });
    refuse({"--dag-resolution"}, "rays alone", "add dag or dag-exact, or ",
           [](const Run& run) { return run.method == "dag" || run.method == "dag-exact"; });
    refuse({"--page-size", "--pool", "--max-face", "--bias", "--undersample", "--maps-per-light",
            "--polygon-lod"},
           "methods that draw maps", addMaps, [](const Run& run) { return run.usesMaps(); });
    refuse({"--taps"}, "maps whose names do not say their taps", addMaps, leavesTaps);
    refuse({"--thresholds", "--model", "--no-oracle"}, "method hybrid", addHybrid,
           [](const Run& run) { return run.method == "hybrid"; });
    refuse({"--route-margin"}, "hybrids whose names do not say their margin", addHybrid,
           leavesMargin);
    if (given("--no-oracle") && given("--model"))
        throw Error(ErrorKind::kUsage, "--no-oracle and --model contradict each other: the oracle "
                                       "is run where no model is given; drop one of them");
    if (given("--route-margin") && !e.isSequence)
        throw Error(ErrorKind::kUsage,
                    "--route-margin is for --sequence, elsewhere no frame knows the one before; "
                    "add that or drop it");
    for (const Run& run : runs)
        if (isNamed && !e.isSequence && run.frame.routeMargin > 0)
            throw Error(ErrorKind::kUsage,
                        "--variants '" + run.variant +
                            "': a margin of routes is for --sequence, elsewhere "
                            "no frame knows the one before; add that or drop RH");
    // Costs are replayed where maps and rays are charted side by side, too.
    const auto needsCosts = [](const Run& run) {
        const std::unique_ptr<CostModel> model =
            makeCostModel(run.model.empty() ? "texels:0" : run.model);
        return model->needsCosts() || model->needsCalibration();
    };
    const auto chartsCosts = [&](const Run& run) {
        return !isNamed && !e.isSequence && run.usesVoxelRays() &&
               std::any_of(runs.begin(), runs.end(), [](const Run& r) { return r.usesMaps(); });
    };
    refuse({"--costs"}, "models cost and oracle and for charts of maps beside rays",
           "add a model, or ", [&](const Run& run) { return needsCosts(run) || chartsCosts(run); });
}

} // namespace shadowdag
