// SPDX-License-Identifier: Apache-2.0
// What is run: scene, view, voxels, maps, rays and the sweeps over them. Read from an experiment
// file or from options; every command is a special case (render is a sweep of one).
//
// An experiment file is one JSON object; an unknown key is an error. Keys, defaults and ranges
// stand in settings_table.cpp, a row each; `shadowdag compare --help` prints them as options.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/json.h"
#include "tools/settings/lod_option.h"
#include "tools/settings/method.h"

#include <string>
#include <vector>

namespace shadowdag {

struct Experiment {
    std::string title;
    std::vector<std::string> scenes;
    uint32_t width = 640, height = 360;
    std::string camera;
    double exposure = 0;          ///< 0: found
    std::string framesText = "0"; ///< as written; `frames` is what it means
    std::vector<uint32_t> frames{0};
    double fps = 30;
    int lightCount = -1;
    uint64_t lightSeed = 1;
    std::vector<uint32_t> resolutionLog2{10};
    std::vector<uint32_t> dagResolutionLog2;
    std::vector<std::string> methods{"embree", "dag", "maps", "hybrid"};
    std::vector<float> thresholds; ///< texels, ascending, infinity allowed
    std::vector<std::string> models{"oracle"};
    std::vector<std::string> variants; ///< canonical names
    bool isSequence = false;
    uint32_t leadIn = 1;
    uint32_t flickerPoints = 20000;
    std::vector<float> routeMargin{FrameOptions{}.routeMargin};
    std::vector<float> undersample{1};
    std::vector<uint32_t> mapsPerLight{FrameOptions{}.mapsPerLight};
    std::vector<uint32_t> pageTexels{ShadowMapOptions{}.pageTexels};
    std::vector<uint32_t> poolMib{256};
    std::vector<uint32_t> maxFaceTexels{FrameOptions{}.maxFaceTexels};
    std::vector<float> bias{ShadowMapBias{}.constantTexels};
    std::vector<uint32_t> taps{ShadowMapBias{}.taps};
    std::vector<float> polygonLod{ShadowMapOptions{}.lodTexels};
    std::vector<float> offset{RayOptions{}.offset};
    std::vector<LodChoice> lod{0};
    int repeats = 5;
    int warmups = 1;
    uint64_t errorSeed = 1;

    Experiment();
    /// Returns the scene's time of a frame, seconds.
    float timeOfFrame(uint32_t frame) const { return float(double(frame) / fps); }
    /// Returns whether a map keeps its method from frame to frame (FrameOptions::routeMargin).
    bool holdsRoutes() const;
    /// Returns the exposure of pictures; where it is to be found, that of `linear`.
    float exposureOf(const std::vector<glm::vec3>& linear) const;
};

/// The greatest exposure that is taken.
constexpr double kMaxExposure = 1e9;

/// The greatest margin of routing that is taken: beyond it nothing ever changes its method.
constexpr double kMaxRouteMargin = 1000;

/// Throws Error kUsage naming the option, the method and those that are allowed, where it is none
/// of them.
void checkMethod(const std::string& option, const std::string& method,
                 const std::vector<std::string>& allowed = methodNames());

/// One configuration: everything but scene and frame.
struct RunParameters {
    std::string method; ///< a name of methods() (method.h)
    std::string model;  ///< as makeCostModel takes it; "" for embree
    uint32_t dag =
        0; ///< index into the resolutions (or assets) of the run; meaningless for embree and maps
    uint32_t resolution = 0; ///< of that DAG; 0 where none is used
    FrameOptions frame;
    std::string variant; ///< its name where it is one by name (tools/settings/variants.h), else ""

    const Method& kind() const { return methodOf(method); }
    /// Returns whether voxels are asked: by rays, or for proofs that a pair is lit.
    bool usesRays() const {
        return kind().needs().voxels || (usesMaps() && frame.pruning == PairPruning::kLit);
    }
    /// Returns whether rays stop at voxels: offset and level of detail matter.
    bool usesVoxelRays() const { return usesRays() && !kind().needs().triangles; }
    bool usesMaps() const { return kind().needs().maps; }
    /// Returns whether a cost model chooses the method of each map.
    bool isRouted() const { return kind().needs().routing; }
    /// Returns whether it is the truth itself.
    bool isTruth() const { return kind().isTruth(); }
    /// Returns the parameters that this method depends on, as JSON.
    Json toJson() const;
    /// Returns a short label, unique within an experiment: "hybrid texels:96 1024^3", or the name
    /// of the variant.
    std::string label() const;
    /// Returns the label as a file name, unique where labels are and short enough for any file
    /// system.
    std::string slug() const;
};

/// Returns a text as (part of) a file name of letters, digits, '.', '-' and '_', at most 60
/// characters. A text that does not survive that gets eight hex digits of its hash, so that unlike
/// texts have unlike names.
std::string fileSlug(const std::string& text);

/// Returns what all configurations of an experiment share: its size, and the first of every list.
FrameOptions baseOptions(const Experiment& experiment);
/// Reads an experiment file. Throws Error kInput naming the file, the key and the value.
Experiment readExperiment(const std::string& path);
/// Reads an experiment from JSON; `where` heads messages.
Experiment experimentFromJson(const Json& json, const std::string& where);
/// Returns every key of the experiment, defaults written out; experimentFromJson gives the same
/// back.
Json toJson(const Experiment& experiment);

/// Throws Error kUsage for the first run whose level of detail its voxels do not have.
void refuseDeepLods(const std::vector<RunParameters>& runs);

/// Returns the resolutions that an experiment's runs count through RunParameters::dag, as log2.
std::vector<uint32_t> allResolutions(const Experiment& experiment);
/// Returns the configurations of an experiment in the order in which they are charted: embree, then
/// for every combination of the lists the thresholds, then the DAG-only resolutions, then the
/// models; or, where variants are named, embree and these, at the first of every list. No two are
/// equal.
/// @param dagResolutions of the DAGs at hand: the experiment's resolutions then its DAG-only ones,
/// or those of the assets given
/// @param fullCount how many of them take part in the whole sweep; the others in method dag alone
std::vector<RunParameters> configurations(const Experiment& experiment,
                                          const std::vector<uint32_t>& dagResolutions,
                                          size_t fullCount);

} // namespace shadowdag
