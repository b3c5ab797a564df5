// SPDX-License-Identifier: Apache-2.0
// The options that several subcommands share, and what they mean as an Experiment.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/setting.h"

#include <map>
#include <string>
#include <vector>

namespace shadowdag {

/// --json, --threads, --backend, --gl-pages: on every subcommand.
struct GlobalOptions {
    bool json = false;
    std::string threads = "0";
    std::string backend = "auto";
    std::string glPages = "auto";

    void declare(CommandLine& commandLine);
    /// Sets the thread count and where OpenGL keeps pages, chooses the backend, says on standard
    /// error what auto chose when `announce`, and of gl what it runs on.
    /// @param drawsFrames false: what has no frames neither looks for OpenGL nor runs on it, and gl
    /// is the cpu; --gl-pages is then Error kUsage
    Backend apply(const Console& console, bool announce, bool drawsFrames = true) const;
};

/// Gives an experiment the page size that frames of a backend have: in sparse textures the
/// device's. Throws Error kUsage for another one that was asked for.
void followGlPages(Experiment& experiment, Backend backend, const CommandLine& commandLine);

/// The options of settings, and those that belong to them: texts until `experiment` reads them.
class CommonOptions {
public:
    std::vector<std::string> voxels;
    std::string cache, time;
    bool allowStale = false;
    bool isWindow = false; ///< --size is a window's, --fps what it plays by

    CommonOptions();

    /// Returns the text of a setting's option, its default until the command line is read; another
    /// default is assigned before `declare`.
    std::string& text(const std::string& option);
    const std::string& text(const std::string& option) const;
    /// Returns what was given of --model, which may be given several times.
    const std::vector<std::string>& models() const { return models_; }

    /// Declares the options of the groups, each under its heading, in order.
    /// @param isSweep what a sweep varies takes a list
    void declare(CommandLine& commandLine, const std::vector<SettingGroup>& groups, bool isSweep);
    /// Declares one setting's option under the present heading.
    void declare(CommandLine& commandLine, const Setting& setting, bool isSweep);
    /// Declares --cache under the present heading.
    void declareCache(CommandLine& commandLine);

    /// Returns the options as an experiment; settings whose options were not declared have the
    /// defaults of this object. With `isSweep` false a list in any of them is Error kUsage.
    /// Contradictions are Error kUsage naming both options.
    Experiment experiment(const CommandLine& commandLine, bool isSweep) const;
    /// Returns the time to show: --time, or that of --frames' first; for commands that show one.
    float timeSeconds(const Experiment& experiment) const;

private:
    std::map<std::string, std::string> texts_; ///< by option
    std::vector<std::string> models_;
    bool isSequence_ = false;
};

} // namespace shadowdag
