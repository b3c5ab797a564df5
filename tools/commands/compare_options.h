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
    std::string output, experiment, methods = "embree,dag,maps,hybrid", repeats = "5",
                                    warmups = "1", costs, title, part, variants, leadIn = "1",
                                    flickerPoints = "20000", only;
    bool resume = false, isSequence = false, noCharts = false, noOracle = false, join = false;
};

/// Options that an experiment file fixes; what it leaves to the command line is not listed.
inline constexpr const char* kFixedByExperiment[] = {
    "--size",       "--camera",    "--exposure",       "--frames",         "--fps",
    "--lights",     "--seed",      "--resolution",     "--dag-resolution", "--thresholds",
    "--model",      "--no-oracle", "--methods",        "--undersample",    "--page-size",
    "--pool",       "--max-face",  "--bias",           "--taps",           "--offset",
    "--lod",        "--repeats",   "--warmups",        "--title",          "--variants",
    "--sequence",   "--lead-in",   "--flicker-points", "--maps-per-light", "--route-margin",
    "--polygon-lod"};

/// Runs `compare failures`, `stability`, `mechanisms` or `real` where a scene of that name stands
/// first (a file of that name is ./NAME); returns whether one was. Throws Error kUsage for options
/// that it fixes itself, and what the compare throws.
bool runNamedCompare(const CompareOptions& options, const CommandLine& commandLine);

} // namespace shadowdag
