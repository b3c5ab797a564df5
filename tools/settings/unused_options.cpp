// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/unused_options.h"

#include "cuda/error.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <functional>
#include <memory>

namespace shadowdag {

namespace {

/// A group of settings that is refused if no run reads it, with methods to add so that one does.
struct Readers {
    ReadBy readBy;
    const char* name;
    const char* added;        ///< of --methods
    const char* addedVariant; ///< of --variants
};

constexpr Readers kReaders[] = {
    {ReadBy::kRays, "methods dag and hybrid", "dag or hybrid", "RT or Hybrid"},
    {ReadBy::kExactRays, "rays that believe no voxel", "dag or hybrid with --believe none",
     "RT or Hybrid"},
    {ReadBy::kVoxels, "rays through voxels", "dag or hybrid with --believe all", "RT or Hybrid"},
    {ReadBy::kVoxelsAlone, "rays alone through voxels", "dag with --believe all", "RT"},
    {ReadBy::kMaps, "methods that draw maps", "maps or hybrid", "a culling or Hybrid"},
    {ReadBy::kKept, "methods that keep maps or beams", "maps or hybrid", "a culling or Hybrid"},
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

[[noreturn]] void refuseUnread(const RunParameters& run, const std::string& name, ReadBy readBy) {
    throw Error(ErrorKind::kUsage, name + " is for " + readersOf(readBy).name + ", not for '" +
                                       run.method + "'" +
                                       (run.usesRays() && readBy == ReadBy::kExactRays
                                            ? " that believes voxels; add --believe none or drop it"
                                        : run.usesRays() && readBy == ReadBy::kVoxels
                                            ? " that believes none; add --believe all or drop it"
                                            : "; drop it"));
}

} // namespace

void refuseUnused(const Experiment& e, size_t assetCount, const std::string& experimentFile,
                  const CommandLine& commandLine) {
    // The resolutions of assets do not affect which settings are read.
    const std::vector<uint32_t> resolutions =
        assetCount > 0 ? std::vector<uint32_t>(assetCount, 1) : allResolutions(e);
    const std::vector<RunParameters> runs =
        configurations(e, resolutions, assetCount > 0 ? assetCount : e.resolutionLog2.size());
    if (runs.empty())
        return; // the measurement reports an empty selection
    const bool isNamed = !e.variants.empty();
    const auto findSetting = [](const std::string& option) {
        return std::find_if(settings().begin(), settings().end(),
                            [&](const Setting& setting) { return setting.option == option; });
    };
    const auto isOfFile = [&](const std::string& option) {
        return !experimentFile.empty() && findSetting(option) != settings().end();
    };
    const auto given = [&](const std::string& option) { // fit has fewer options than compare
        // A file that a run wrote has every key; names of variants change some defaults.
        if (const auto setting = findSetting(option);
            !experimentFile.empty() && setting != settings().end() &&
            option != "--thresholds") // 0 and inf select maps and dag
            return !isNamed && !setting->texts(e).empty() &&
                   setting->texts(e) != setting->texts(Experiment());
        return commandLine.declares(option) && commandLine.given(option);
    };
    const std::string by = !experimentFile.empty() ? experimentFile
                           : isNamed               ? "--variants"
                                                   : "--methods";
    const auto refuse = [&](const std::string& option, const std::string& what,
                            const std::string& remedy,
                            const std::function<bool(const RunParameters&)>& uses) {
        if (given(option) && !std::any_of(runs.begin(), runs.end(), uses))
            throw Error(
                isOfFile(option) ? ErrorKind::kInput : ErrorKind::kUsage,
                (isOfFile(option) ? experimentFile + ": key \"" + findSetting(option)->key + "\""
                                  : option) +
                    " is for " + what + ", which " + by + " leaves out; " + remedy + "drop it");
    };
    const auto refuseFor = [&](const std::string& option, const Setting* setting, ReadBy readBy) {
        const Readers& readers = readersOf(readBy);
        const bool isSettable = setting != nullptr && setting->isSettableByVariants;
        refuse(option,
               isSettable && isNamed ? std::string(readBy == ReadBy::kMaps ? "maps" : "hybrids") +
                                           " whose names do not set it"
                                     : std::string(readers.name),
               std::string("add ") + (isNamed ? readers.addedVariant : readers.added) + ", or ",
               [&](const RunParameters& run) {
                   return reads(run, readBy) &&
                          !(isSettable && !run.variant.empty() &&
                            saysSetting(parseVariant("variants", run.variant), setting->key));
               });
    };
    for (const Setting& setting : settings())
        if (setting.readBy != ReadBy::kAll && !setting.option.empty())
            refuseFor(setting.option, &setting, setting.readBy);
    refuseFor("--voxels", nullptr, ReadBy::kRays);
    refuseFor("--no-oracle", nullptr, ReadBy::kHybrid);
    if (given("--no-oracle") && given("--model"))
        throw Error(ErrorKind::kUsage, "--no-oracle and --model contradict each other: the oracle "
                                       "is run if no model is given; drop one of them");
    if (given("--route-margin") && !e.isSequence)
        throw Error(ErrorKind::kUsage,
                    "--route-margin is for --sequence, otherwise frames are independent; "
                    "add that or drop it");
    if (given("--start") && e.isSequence)
        throw Error(ErrorKind::kUsage, "--start is for single frames, a --sequence keeps what its "
                                       "frames before have left; drop one of them");
    for (const RunParameters& run : runs)
        if (isNamed && !e.isSequence && run.frame.routeMargin > 0)
            throw Error(ErrorKind::kUsage, "--variants '" + run.variant +
                                               "': a margin of routes is for --sequence, otherwise "
                                               "frames are independent; add that or drop RH");
    // Costs are also replayed for charts that show maps and rays side by side.
    const bool drawsMaps = std::any_of(runs.begin(), runs.end(),
                                       [](const RunParameters& run) { return run.usesMaps(); });
    refuse("--costs", "models cost and oracle and for charts of maps beside rays",
           "add a model, or ", [&](const RunParameters& run) {
               return needsCosts(run) || (!isNamed && !e.isSequence && run.usesRays() && drawsMaps);
           });
}

std::string noVoxelsRemark(const std::vector<RunParameters>& runs, const CommandLine& commandLine) {
    if (std::any_of(runs.begin(), runs.end(),
                    [](const RunParameters& run) { return run.usesVoxels(); }))
        return "";
    for (const std::string option : {"--resolution", "--voxels"})
        if (commandLine.declares(option) && commandLine.given(option))
            return option + ": no voxels are used, because rays believe none of them; add "
                            "--believe all for rays through voxels";
    return "";
}

std::string oneValueRemark(const Experiment& e, const std::vector<RunParameters>& runs) {
    std::string models, values;
    const auto add = [](std::string& list, const std::string& text) {
        list += (list.empty() ? "" : ", ") + text;
    };
    for (const Setting* setting : frameSettings())
        if (setting->texts(e).size() > 1 && setting->option != "--start")
            add(values, setting->option + " " + setting->texts(e)[0]);
    if (e.resolutionLog2.size() > 1)
        add(values, "--resolution " + std::to_string(1u << e.resolutionLog2[0]));
    for (const std::string& model : e.models)
        if (std::count_if(runs.begin(), runs.end(), [&](const RunParameters& run) {
                return run.isRouted() && run.model == model;
            }) == ptrdiff_t(e.start.size()))
            add(models, model);
    if (models.empty() || values.empty())
        return "";
    return "--model " + models + ": run at the first value of every list only (" + values +
           "); lists are combined with thresholds";
}

void refuseUnread(const RunParameters& run,
                  const std::function<std::string(const Setting&)>& nameOf) {
    for (const Setting& setting : settings()) {
        const bool isOfHybrid = setting.readBy == ReadBy::kHybrid; // reported with its own remedy
        if (isOfHybrid || reads(run, setting.readBy))
            continue;
        if (const std::string name = nameOf(setting); !name.empty())
            refuseUnread(run, name, setting.readBy);
    }
}

void refuseUnread(const RunParameters& run, const CommandLine& commandLine) {
    const auto isGiven = [&](const std::string& option) {
        return !option.empty() && commandLine.declares(option) && commandLine.given(option);
    };
    refuseUnread(run, [&](const Setting& setting) {
        return isGiven(setting.option) ? setting.option : std::string();
    });
    if (!run.usesRays() && !run.usesVoxels() && isGiven("--voxels"))
        refuseUnread(run, "--voxels", ReadBy::kRays);
}

} // namespace shadowdag
