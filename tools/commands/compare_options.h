// SPDX-License-Identifier: Apache-2.0
// What `shadowdag compare` is asked on its command line, and the compares that are no sweep over
// scenes. Not for other subcommands.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/common_options.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The options as given; numbers and lists are texts until they are read.
struct CompareOptions {
    GlobalOptions global;
    CommonOptions common;
    std::vector<std::string> scenes;
    std::string output, experiment, costs, part, only;
    bool resume = false, noCharts = false, noOracle = false, join = false;
};

/// Returns the options that an experiment file fixes: those of settings, and --no-oracle.
std::vector<std::string> optionsOfExperiments();

/// Runs `compare failures`, `stability`, `mechanisms` or `real` where a scene of that name stands
/// first (a file of that name is ./NAME); returns whether one was. Throws Error kUsage for options
/// that it fixes itself, and what the compare throws.
bool runNamedCompare(const CompareOptions& options, const CommandLine& commandLine);

} // namespace shadowdag
