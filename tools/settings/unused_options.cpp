// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/unused_options.h"

#include "cuda/error.h"
#include "tools/settings/setting.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <functional>
#include <memory>

namespace shadowdag {

namespace {

/// Whose settings are refused where none of them runs, and what to add so that one does.
struct Readers {
    ReadBy readBy;
    const char* name;
    const char* added;        ///< of --methods
    const char* addedVariant; ///< of --variants
};

constexpr Readers kReaders[] = {
    {ReadBy::kVoxelRays, "rays that stop at voxels", "dag or hybrid", "RT or Hybrid"},
    {ReadBy::kVoxels, "methods that trace voxels", "dag or hybrid", "RT or Hybrid"},
    {ReadBy::kRaysAlone, "rays alone", "dag or dag-exact", "RT"},
    {ReadBy::kMaps, "methods that draw maps", "maps or hybrid", "a culling or Hybrid"},
    {ReadBy::kHybrid, "method hybrid", "hybrid", "Hybrid"},
};

const Readers& readersOf(ReadBy readBy) {
    return *std::find_if(std::begin(kReaders), std::end(kReaders),
                         [&](const Readers& readers) { return readers.readBy == readBy; });
}

bool needsCosts(const RunParameters& run) {
    const std::unique_ptr<CostModel> model =
        makeCostModel(run.model.empty() ? "texels:0" : run.model);
    return model->needsCosts() || model->needsCalibration();
}

} // namespace

void refuseUnused(const Experiment& e, size_t assetCount, const std::string& experimentFile,
                  const CommandLine& commandLine) {
    // Which resolutions assets have makes no difference to which settings are read.
    const std::vector<uint32_t> resolutions =
        assetCount > 0 ? std::vector<uint32_t>(assetCount, 1) : allResolutions(e);
    const std::vector<RunParameters> runs =
        configurations(e, resolutions, assetCount > 0 ? assetCount : e.resolutionLog2.size());
    if (runs.empty())
        return;                                         // the measurement says what leaves none
    const auto given = [&](const std::string& option) { // fit has fewer options than compare
        return commandLine.declares(option) && commandLine.given(option);
    };
    const bool isNamed = !e.variants.empty();
    const std::string by = !experimentFile.empty() ? experimentFile
                           : isNamed               ? "--variants"
                                                   : "--methods";
    const auto refuse = [&](const std::string& option, const std::string& what,
                            const std::string& remedy,
                            const std::function<bool(const RunParameters&)>& uses) {
        if (given(option) && !std::any_of(runs.begin(), runs.end(), uses))
            throw Error(ErrorKind::kUsage, option + " is for " + what + ", which " + by +
                                               " leaves out; " + remedy + "drop it");
    };
    const auto refuseFor = [&](const std::string& option, const Setting* setting, ReadBy readBy) {
        const Readers& readers = readersOf(readBy);
        const bool mayBeSaid = setting != nullptr && setting->mayBeSaidByVariants;
        refuse(option,
               mayBeSaid && isNamed ? std::string(readBy == ReadBy::kMaps ? "maps" : "hybrids") +
                                          " whose names do not say it"
                                    : std::string(readers.name),
               std::string("add ") + (isNamed ? readers.addedVariant : readers.added) + ", or ",
               [&](const RunParameters& run) {
                   return reads(run, readBy) &&
                          !(mayBeSaid && !run.variant.empty() &&
                            saysSetting(parseVariant("variants", run.variant), setting->key));
               });
    };
    for (const Setting& setting : settings())
        if (setting.readBy != ReadBy::kAll && !setting.option.empty())
            refuseFor(setting.option, &setting, setting.readBy);
    refuseFor("--voxels", nullptr, ReadBy::kVoxels);
    refuseFor("--no-oracle", nullptr, ReadBy::kHybrid);
    if (given("--no-oracle") && given("--model"))
        throw Error(ErrorKind::kUsage, "--no-oracle and --model contradict each other: the oracle "
                                       "is run where no model is given; drop one of them");
    if (given("--route-margin") && !e.isSequence)
        throw Error(ErrorKind::kUsage,
                    "--route-margin is for --sequence, elsewhere no frame knows the one before; "
                    "add that or drop it");
    for (const RunParameters& run : runs)
        if (isNamed && !e.isSequence && run.frame.routeMargin > 0)
            throw Error(ErrorKind::kUsage,
                        "--variants '" + run.variant +
                            "': a margin of routes is for --sequence, elsewhere "
                            "no frame knows the one before; add that or drop RH");
    // Costs are replayed where maps and rays are charted side by side, too.
    const bool drawsMaps = std::any_of(runs.begin(), runs.end(),
                                       [](const RunParameters& run) { return run.usesMaps(); });
    refuse("--costs", "models cost and oracle and for charts of maps beside rays",
           "add a model, or ", [&](const RunParameters& run) {
               return needsCosts(run) ||
                      (!isNamed && !e.isSequence && run.usesVoxelRays() && drawsMaps);
           });
}

void refuseUnread(const RunParameters& run, const CommandLine& commandLine) {
    for (const Setting& setting : settings()) {
        const bool isOfHybrid = setting.readBy == ReadBy::kHybrid; // told with its own remedy
        if (setting.option.empty() || isOfHybrid || reads(run, setting.readBy))
            continue;
        if (commandLine.declares(setting.option) && commandLine.given(setting.option))
            throw Error(ErrorKind::kUsage, setting.option + " is for " +
                                               readersOf(setting.readBy).name + ", not for '" +
                                               run.method + "'; drop it");
    }
    if (!run.usesRays() && commandLine.given("--voxels"))
        throw Error(ErrorKind::kUsage, std::string("--voxels is for ") +
                                           readersOf(ReadBy::kVoxels).name + ", not for '" +
                                           run.method + "'; drop it");
}

} // namespace shadowdag
