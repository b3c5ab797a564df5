// SPDX-License-Identifier: Apache-2.0
// What is run: scene, view, voxels, maps, rays and the sweeps over them. Read from an experiment
// file or from options; every command is a special case (render is a sweep of one).
//
// An experiment file is one JSON object. An unknown key is an error. Keys, with their defaults:
//
// clang-format off
//   "title"            ""            heads the report
//   "scenes"           []            what SCENE may be on the command line; empty: given there
//   "size"             "640x360"     pixels
//   "camera"           ""            auto | NAME | "px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]]"; "" = the scene's first, else auto
//   "exposure"         0             what pictures multiply radiance by before the tone curve, up to 1e9; 0: found, as
//                                    autoExposure finds it; changes no number but those of displayed pictures
//   "frames"           "0"           A:B[:STEP], both ends included, or a comma list
//   "fps"              30            frame f shows the scene at f / fps seconds: a fixed clock
//   "lights"           -1            >= 0: replaces the scene's lights by that many placed ones
//   "light_seed"       1             where they are placed
//   "resolutions"      [1024]        voxels an axis; every one with every threshold
//   "dag_resolutions"  []            more of them, for methods dag and dag-exact alone
//   "methods"          [embree, dag, maps, hybrid]  some of these and dag-exact
//   "thresholds"       [0, 8, 16, 32, 64, 96, 192, "inf"]  texels; 0 is method maps, "inf" method dag
//   "models"           ["oracle"]    further cost models for hybrid, at the first of every list below
//   "variants"         []            instead of thresholds and models: variants by name (tools/settings/variants.h), "paper"
//                                    for all that the paper measured; methods are then ["embree"] or []
//   "sequence"         false         frames in order, what is kept from frame to frame kept (tools/workspace/sequence.h);
//                                    otherwise every frame stands for itself
//   "lead_in"          1             sequence: rendered uncounted before each frame, so many frames back at the fixed
//                                    clock, so that frames with a step between them have true predecessors
//   "flicker_points"   20000         sequence: surface points whose answers are followed between frames; 0 for none
//   "route_margin"     0             sequence: a map changes its method only when the other is cheaper by more than
//                                    the factor 1 + margin, 0 to 1000
//   "undersample"      [1]           divisors of the required resolution
//   "maps_per_light"   [one]         FrameOptions' default; 1 to 16
//   "page_size"        [one]         ShadowMapOptions' default; texels a side, powers of two from 16 to 256
//   "pool_mib"         256           byte budget of the page pool, MiB
//   "bias"             [one]         ShadowMapBias' default; texels
//   "taps"             [one]         ShadowMapBias' default, with variants the paper's 9; 1, 4 or 9
//   "polygon_lod"      [0]           ShadowMapOptions::lodTexels: maps draw what is simplified by less than so many texels
//   "offset"           [1]           of rays, in units of the derived offset
//   "lod"              [0]           level of detail of rays: numbers, cells of 2^lod voxels, and texts as --lod
//                                    takes them: "footprint:SCALE", "coverage:SHARE:SCALE"
//   "repeats"          5             timed runs of every configuration, interleaved
//   "warmups"          1             runs before them that are not counted
//   "max_face_texels"  2048          the most texels across a face of a map, 16 to 8192
//   "error_seed"       1             of the shifted rays that explain errors
// clang-format on
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/json.h"
#include "tools/settings/lod_option.h"

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
    float routeMargin = 0;
    std::vector<float> undersample{1};
    std::vector<uint32_t> mapsPerLight{FrameOptions{}.mapsPerLight};
    std::vector<uint32_t> pageTexels{ShadowMapOptions{}.pageTexels};
    uint32_t poolMib = 256;
    uint32_t maxFaceTexels = FrameOptions{}.maxFaceTexels;
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
    /// Returns the exposure of pictures; where it is to be found, that of `linear`.
    float exposureOf(const std::vector<glm::vec3>& linear) const;
};

/// The greatest exposure that is taken.
constexpr double kMaxExposure = 1e9;

/// The greatest margin of routing that is taken: beyond it nothing ever changes its method.
constexpr double kMaxRouteMargin = 1000;

/// Every method, in the order in which they are charted.
inline const std::vector<std::string> kMethods{"embree", "dag", "dag-exact", "maps", "hybrid"};

/// Returns whether a method traces rays through voxels.
inline bool methodUsesVoxels(const std::string& method) {
    return method == "dag" || method == "dag-exact" || method == "hybrid";
}

/// Returns the cost model that a method means, as makeCostModel takes it: `model`, texels:96 where
/// that is empty, of hybrid; one that draws all maps or none of the others (of embree, whose pairs
/// alone are used, maps).
std::string modelText(const std::string& method, const std::string& model);
/// Throws Error kUsage naming the option, the method and those that are allowed, where it is none
/// of them.
void checkMethod(const std::string& option, const std::string& method,
                 const std::vector<std::string>& allowed = kMethods);

/// One configuration: everything but scene and frame.
struct RunParameters {
    std::string method; ///< one of kMethods
    std::string model;  ///< as makeCostModel takes it; "" for embree
    uint32_t dag =
        0; ///< index into the resolutions (or assets) of the run; meaningless for embree and maps
    uint32_t resolution = 0; ///< of that DAG; 0 where none is used
    FrameOptions frame;
    std::string variant; ///< its name where it is one by name (tools/settings/variants.h), else ""

    /// Returns whether voxels are asked: by rays, or for proofs that a pair is lit.
    bool usesRays() const {
        return methodUsesVoxels(method) || (usesMaps() && frame.pruning == PairPruning::kLit);
    }
    /// Returns whether rays stop at voxels: offset and level of detail matter.
    bool usesVoxelRays() const { return usesRays() && method != "dag-exact"; }
    bool usesMaps() const { return method == "maps" || method == "hybrid"; }
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

/// Returns what all configurations of an experiment share: its size, pool and margin, and the first
/// of every list.
FrameOptions baseOptions(const Experiment& experiment);
/// Reads an experiment file. Throws Error kInput naming the file, the key and the value.
Experiment readExperiment(const std::string& path);
/// Reads an experiment from JSON; `where` heads messages.
Experiment experimentFromJson(const Json& json, const std::string& where);
/// Adds the choice that a text is to those before it (see parseLod). Throws Error kUsage for one
/// that is there already, however it is spelled: "coverage" is "coverage:0.75".
void addLod(std::vector<LodChoice>& lods, const std::string& option, const std::string& text);
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
