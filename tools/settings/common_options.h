// SPDX-License-Identifier: Apache-2.0
// The options that several subcommands share, and their conversion to an Experiment.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/setting.h"

#include <map>
#include <string>
#include <vector>

namespace shadowdag {

/// Help of SCENE.
constexpr const char* kSceneHelp = "A .glb or .gltf file, one of another kind that Assimp reads "
                                   "(.obj, .ply, .stl, .fbx, .dae and more), or builtin:NAME";

constexpr int kMaxThreadCount = 4096;

/// --json, --threads, --backend, --gl-pages, --allow-outside: on every subcommand.
struct GlobalOptions {
    bool json = false;
    std::string threads = "0";
    std::string backend = "auto";
    std::string glPages = "auto";
    bool allowOutside = false;

    void declare(CommandLine& commandLine);
    /// Sets the thread count and the memory of OpenGL pages, chooses the backend, and prints on
    /// standard error the choice of auto when `announce`, and the device of gl. @param drawsFrames
    /// false: commands without frames neither look for OpenGL nor run on it, and gl is the cpu;
    /// --gl-pages is then Error kUsage
    Backend apply(const Console& console, bool announce, bool drawsFrames = true) const;
};

/// Sets the page size of an experiment to that of a backend's frames: in sparse textures the
/// device's. Throws Error kUsage if another one was requested.
void followGlPages(Experiment& experiment, Backend backend, const CommandLine& commandLine);

/// The options of settings, and those that belong to them, as texts until `experiment` parses them.
class CommonOptions {
public:
    std::vector<std::string> voxels;
    std::string cache, time;
    bool allowStale = false;
    bool isWindow = false; ///< --size is the window's, --fps its playback rate

    CommonOptions();

    /// Returns the text of a setting's option, its default until the command line is read; another
    /// default is assigned before `declare`.
    std::string& text(const std::string& option);
    const std::string& text(const std::string& option) const;
    /// Returns the values of --model, which may be given several times.
    const std::vector<std::string>& models() const { return models_; }

    /// Declares the options of the groups, each under its heading, in order.
    /// @param isSweep settings that a sweep varies take a list
    void declare(CommandLine& commandLine, const std::vector<SettingGroup>& groups, bool isSweep);
    /// Declares one setting's option under the current heading.
    void declare(CommandLine& commandLine, const Setting& setting, bool isSweep);
    /// Declares --cache under the current heading.
    void declareCache(CommandLine& commandLine);

    /// Returns the options as an experiment; settings whose options were not declared have the
    /// defaults of this object. With `isSweep` false a list in any of them is Error kUsage.
    /// Contradictions are Error kUsage naming both options. Throws what checkVoxels throws.
    Experiment experiment(const CommandLine& commandLine, bool isSweep) const;
    /// Throws Error kInput unless each asset of --voxels is a file that may be read, also where no
    /// run reads it.
    void checkVoxels() const;
    /// Returns the time to show: --time, or that of --frames' first; for commands that show one.
    float timeSeconds(const Experiment& experiment) const;

private:
    std::map<std::string, std::string> texts_; ///< by option
    std::vector<std::string> models_;
    bool isSequence_ = false;
};

} // namespace shadowdag
