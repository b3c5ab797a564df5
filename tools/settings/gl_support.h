// SPDX-License-Identifier: Apache-2.0
// The options that `--backend gl` does not support: refused if given by name, omitted with a
// message if they come from a list.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Removes from an experiment the methods, variants and values of settings that a backend does not
/// support: rays of Embree on all but the CPU, the others on Backend::kGl. Returns one text per
/// removed item with its reason, which is also printed on standard error. A list that becomes empty
/// gets the default. Throws Error kUsage naming the option and its value for items given on the
/// command line itself
/// (`paper`, defaults and experiment files do not count), and if neither a method nor a variant
/// would be left.
/// @param namedVariants on the command line, besides lists of them
std::vector<std::string> leaveOutUnsupported(Experiment& experiment, Backend backend,
                                             const CommandLine& commandLine,
                                             const std::vector<std::string>& namedVariants,
                                             const Console& console);

/// Sets the settings that the command line leaves out to the defaults of OpenGL (Setting::onGl), if
/// `backend`, as --backend has it, is "gl". To be called before settings are checked.
void takeGlDefaults(Experiment& experiment, const std::string& backend,
                    const CommandLine& commandLine);

/// Throws Error kUsage naming the option, on Backend::kGl, for options of one frame that it does
/// not support. @param variant as --variant has it; may be empty
void refuseOnGl(const Experiment& experiment, Backend backend, const std::string& variant);

} // namespace shadowdag
