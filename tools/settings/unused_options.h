// SPDX-License-Identifier: Apache-2.0
// Options that change nothing because no configuration that was asked for reads them.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/experiment.h"

#include <cstddef>
#include <string>

namespace shadowdag {

/// Throws Error kUsage naming the first option on the command line that no configuration of the
/// experiment reads, and options of a sweep that contradict each other about it.
/// @param assetCount of --voxels
/// @param experimentFile that fixed the configurations; "": options did
void refuseUnused(const Experiment& experiment, size_t assetCount,
                  const std::string& experimentFile, const CommandLine& commandLine);

/// The same of one configuration, for commands that render one method.
void refuseUnread(const RunParameters& run, const CommandLine& commandLine);

} // namespace shadowdag
