// SPDX-License-Identifier: Apache-2.0
// Options of `compare` that change nothing because no run that was asked for has a use for them.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/experiment.h"

#include <cstddef>
#include <string>

namespace shadowdag {

/// Throws Error kUsage naming the first option on the command line that no configuration of the
/// experiment heeds, and options of `compare` that contradict each other about it.
/// @param assetCount of --voxels
/// @param experimentFile that fixed the runs; "": options did
void refuseUnheeded(const Experiment& experiment, size_t assetCount,
                    const std::string& experimentFile, const CommandLine& commandLine);

} // namespace shadowdag
