// SPDX-License-Identifier: Apache-2.0
// What `--backend gl` cannot do of what was asked for: refused where somebody named it, left out
// and told where a list stands for it.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Takes out of an experiment the methods, variants and levels of detail that frames in OpenGL do
/// not follow, on Backend::kGl; on others nothing. Returns what was taken out and why, a text each,
/// which is told on standard error as well. Of a list of levels of detail that is left empty the
/// default takes the place.
/// Throws Error kUsage naming the option and its value for what the command line names itself
/// (`paper`, defaults and experiment files name nothing), and where neither a method nor a variant
/// would be left.
/// @param namedVariants on the command line, besides lists of them
std::vector<std::string> leaveOutOnGl(Experiment& experiment, Backend backend,
                                      const CommandLine& commandLine,
                                      const std::vector<std::string>& namedVariants,
                                      const Console& console);

/// Throws Error kUsage naming the option, on Backend::kGl, where one frame's options ask for what
/// it does not follow. @param method,variant as --method and --variant have them; may be empty
/// @param methodOption the option that named the method
void refuseOnGl(const Experiment& experiment, Backend backend, const std::string& method,
                const std::string& variant, const std::string& methodOption = "--method");

} // namespace shadowdag
