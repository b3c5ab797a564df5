// SPDX-License-Identifier: Apache-2.0
// Refuses options without effect, because no requested configuration reads them.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/experiment.h"
#include "tools/settings/setting.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// Throws Error kUsage naming the first option on the command line that no configuration of the
/// experiment reads, and options of a sweep that contradict each other about it.
/// @param assetCount of --voxels
/// @param experimentFile with the configurations; "": they come from options
void refuseUnused(const Experiment& experiment, size_t assetCount,
                  const std::string& experimentFile, const CommandLine& commandLine);

/// Returns a remark where --resolution or --voxels is given but no run uses voxels, because rays
/// believe none; else "".
std::string noVoxelsRemark(const std::vector<RunParameters>& runs, const CommandLine& commandLine);

/// Returns a remark about the cost models that run at one value only of lists with several values;
/// "" if there are none. @param runs the experiment's configurations
std::string oneValueRemark(const Experiment& experiment, const std::vector<RunParameters>& runs);

/// As refuseUnused for one configuration, for commands that render one method.
void refuseUnread(const RunParameters& run, const CommandLine& commandLine);

/// The same for settings that are given by other means than options.
/// @param nameOf returns a setting's name in messages, "" if it is not given
void refuseUnread(const RunParameters& run,
                  const std::function<std::string(const Setting&)>& nameOf);

} // namespace shadowdag
