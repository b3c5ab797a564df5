// SPDX-License-Identifier: Apache-2.0
// Runs charts.py and figures.py, which stand beside the program, with Debian's Python and its
// matplotlib.
#pragma once

#include "tools/settings/json.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Returns the path of a script: beside the program, or in ../share/shadowdag once installed.
/// Throws Error kUsage when it is missing, or when Python or matplotlib is, naming the package;
/// call it before any long work.
/// @param remedy what else the user may do, as in "pass --no-charts"; "" for nothing
std::string findCharts(const std::string& name = "charts.py",
                       const std::string& remedy = "pass --no-charts");

/// Draws the charts of a results file into a directory, with charts.json, the list of them with
/// captions and of what was left out for want of data. Throws Error kResource with the script's
/// last words when it fails or cannot write, kInput when it refused the results.
/// @param more further arguments of the script
void drawCharts(const std::string& script, const std::string& resultsPath,
                const std::string& directory, const std::vector<std::string>& more = {});

/// Returns one line for each chart that charts.json names as left out, with what it needs.
std::vector<std::string> leftOutLines(const Json& charts);

/// Runs a program to its end, with nothing to read; returns its exit status, 128 + the signal that
/// ended it, or 127 when it cannot be started.
/// @param errorText receives what it said on standard output and standard error, in the order it
/// said it; null throws that away
int runProgram(const std::vector<std::string>& arguments, std::string* errorText = nullptr);

/// Returns the directory of the running program.
std::string programDirectory();

} // namespace shadowdag
