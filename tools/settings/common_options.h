// SPDX-License-Identifier: Apache-2.0
// The options that several subcommands share, and what they mean as an Experiment.
#pragma once

#include "tools/settings/command_line.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"

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

/// The texts of the shared options. A list is what `compare` takes; the others want one value of
/// each.
struct CommonOptions {
    std::string size = "640x360", camera, time, frames, fps = "30", exposure = "0";
    bool isWindow = false; ///< --size is a window's, --fps what it plays by
    std::string lights = "-1", seed = "1";
    std::vector<std::string> voxels;
    std::string resolution = "1024", dagResolution, cache;
    bool allowStale = false;
    std::string thresholds = "0,8,16,32,64,96,192,inf";
    // Defaults come from where the methods state theirs: one text.
    std::string undersample = "1", mapsPerLight = std::to_string(FrameOptions{}.mapsPerLight),
                pageSize = std::to_string(ShadowMapOptions{}.pageTexels), pool = "256M",
                maxFace = std::to_string(FrameOptions{}.maxFaceTexels);
    std::string bias = numberText(ShadowMapBias{}.constantTexels),
                taps = std::to_string(ShadowMapBias{}.taps),
                polygonLod = numberText(ShadowMapOptions{}.lodTexels);
    std::string offset = numberText(RayOptions{}.offset), lod = "0";
    std::string routeMargin = numberText(FrameOptions{}.routeMargin);
    std::vector<std::string> models;
    std::string costs;

    void declareView(CommandLine& commandLine, bool isSweep);
    /// For commands that write or show pictures.
    void declareExposure(CommandLine& commandLine);
    void declareLights(CommandLine& commandLine);
    void declareVoxels(CommandLine& commandLine, bool isSweep);
    void declareMaps(CommandLine& commandLine, bool isSweep);
    void declareRays(CommandLine& commandLine, bool isSweep);
    /// For commands that show frames one after the other.
    void declareRoutes(CommandLine& commandLine);

    /// Returns the options as an experiment (scenes, methods, repeats left at their defaults). With
    /// `isSweep` false a list in any of them is Error kUsage. Contradictions are Error kUsage
    /// naming both options.
    Experiment experiment(const CommandLine& commandLine, bool isSweep) const;
    /// Returns the time to show: --time, or that of --frames' first; for commands that show one.
    float timeSeconds(const Experiment& experiment) const;
};

} // namespace shadowdag
