// SPDX-License-Identifier: Apache-2.0
// The table of subcommands: one file each.
#pragma once

#include "tools/settings/command_line.h"

#include <functional>

namespace shadowdag {

/// Each function declares its options and returns the function that runs the command.
std::function<void()> declareScene(CommandLine& commandLine);
std::function<void()> declareVoxelize(CommandLine& commandLine);
std::function<void()> declareMerge(CommandLine& commandLine);
std::function<void()> declareInfo(CommandLine& commandLine);
std::function<void()> declareExport(CommandLine& commandLine);
std::function<void()> declareImport(CommandLine& commandLine);
std::function<void()> declareRender(CommandLine& commandLine);
std::function<void()> declareValidate(CommandLine& commandLine);
std::function<void()> declareCompare(CommandLine& commandLine);
std::function<void()> declareStudy(CommandLine& commandLine);
std::function<void()> declareRays(CommandLine& commandLine);
std::function<void()> declareDiff(CommandLine& commandLine);
std::function<void()> declareFigures(CommandLine& commandLine);
std::function<void()> declareFit(CommandLine& commandLine);
std::function<void()> declareBench(CommandLine& commandLine);
std::function<void()> declareCalibrate(CommandLine& commandLine);
std::function<void()> declareView(CommandLine& commandLine);

} // namespace shadowdag
