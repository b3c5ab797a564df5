// SPDX-License-Identifier: Apache-2.0
// The experiment: scene, view, voxels, maps, rays and the sweeps over them. Read from an experiment
// file or from options; every command is a special case (render is a sweep of one).
//
// An experiment file is one JSON object; an unknown key is an error. Keys, defaults and ranges are
// in settings_table.cpp, one row each; `shadowdag compare --help` prints them as options.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/json.h"
#include "tools/settings/lod_option.h"
#include "tools/settings/method.h"

#include <string>
#include <vector>

namespace shadowdag {

/// In place of thresholds: automaticThresholds() of each scene's first frame.
inline constexpr float kAutomaticThreshold = -1;
/// The paper's threshold (sec. IV-I), texels.
inline constexpr float kPaperTexels = 96;

struct Experiment {
    std::string title;
    std::vector<std::string> scenes;
    uint32_t width = 640, height = 360;
    std::string camera;
    uint32_t viewCount = 1;       ///< more than 1: automatic cameras, instead of `camera`
    double exposure = 0;          ///< 0: automatic
    std::string framesText = "0"; ///< as written; `frames` is its value
    std::vector<uint32_t> frames{0};
    double fps = 30;
    int lightCount = -1;
    uint64_t lightSeed = 1;
    std::vector<uint32_t> resolutionLog2{10};
    std::vector<uint32_t> dagResolutionLog2;
    std::vector<std::string> methods{"embree", "dag", "maps", "hybrid"};
    /// Texels, ascending, infinity allowed; or kAutomaticThreshold alone.
    std::vector<float> thresholds{kAutomaticThreshold};
    std::vector<std::string> models{"oracle"};
    std::vector<std::string> variants; ///< canonical names
    bool isSequence = false;
    uint32_t leadIn = 1;
    uint32_t flickerPoints = 20000;
    std::vector<FrameStart> start{FrameOptions{}.start};
    std::vector<float> routeMargin{FrameOptions{}.routeMargin};
    std::vector<float> undersample{1};
    std::vector<uint32_t> mapsPerLight{FrameOptions{}.mapsPerLight};
    std::vector<uint32_t> pageTexels{ShadowMapOptions{}.pageTexels};
    std::vector<uint32_t> poolMib{256};
    std::vector<uint32_t> maxFaceTexels{FrameOptions{}.maxFaceTexels};
    std::vector<float> bias{ShadowMapBias{}.constantTexels};
    std::vector<uint32_t> taps{ShadowMapBias{}.taps};
    std::vector<float> polygonLod{ShadowMapOptions{}.lodTexels};
    std::vector<uint32_t> beamsMib{0}; ///< 0: none
    std::vector<float> believe{0};     ///< pixels; infinity: all, 0: none
    std::vector<float> offset{RayOptions{}.offset};
    std::vector<LodChoice> lod{0};
    int repeats = 5;
    int warmups = 1;
    uint64_t errorSeed = 1;

    bool areThresholdsAutomatic() const {
        return thresholds == std::vector<float>{kAutomaticThreshold};
    }
    /// Returns the scene's time of a frame, seconds.
    float timeOfFrame(uint32_t frame) const { return float(double(frame) / fps); }
    /// Returns whether a map keeps its method from frame to frame (FrameOptions::routeMargin).
    bool holdsRoutes() const;
    /// Returns the camera of a view, as --camera takes it: `camera` if there is one view, else
    /// auto, auto-2 and so on. @param view less than viewCount
    std::string viewCamera(uint32_t view) const;
    /// Returns the name of a scene in a view, in results and costs: with the camera if there are
    /// several views.
    std::string viewName(const std::string& scene, uint32_t view) const;
    /// Returns the exposure of pictures; if it is automatic, that of `linear`.
    float exposureOf(const std::vector<glm::vec3>& linear) const;
};

/// The largest number of automatic views of a scene.
constexpr uint32_t kMaxViewCount = 16;

/// Throws Error kUsage if several views are asked for beside a camera that is not auto. @param by
/// the name of the setting of views, @param camera that of the camera
void refuseCameraOfViews(const Experiment& experiment, const std::string& by,
                         const std::string& camera);

/// The largest number of lights that an option can place.
constexpr int kMaxPlacedLightCount = 100000;

/// The largest valid exposure.
constexpr double kMaxExposure = 1e9;

/// The largest valid margin of routing; above it no method ever changes.
constexpr double kMaxRouteMargin = 1000;

/// Throws Error kUsage naming the option, the method and the valid ones, if it is none of them.
void checkMethod(const std::string& option, const std::string& method,
                 const std::vector<std::string>& allowed = methodNames());

/// One configuration: all settings except scene and frame.
struct RunParameters {
    std::string method; ///< a name of methods() (method.h)
    std::string model;  ///< as makeCostModel takes it; "" for the truth
    uint32_t dag =
        0; ///< index into the resolutions (or assets) of the run; meaningless for embree and maps
    uint32_t resolution = 0; ///< of that DAG; 0 if none is used
    FrameOptions frame;
    std::string variant; ///< its name if it is a variant (tools/settings/variants.h), else ""

    const Method& kind() const { return methodOf(method); }
    /// Returns whether rays of ours are traced, through voxels or triangles.
    bool usesRays() const { return kind().needs().rays; }
    /// Returns whether voxels are used: by rays, or for proofs that a pair is lit. Then resolution,
    /// offset and level of detail matter.
    bool usesVoxels() const {
        return (usesRays() && !frame.rays.believesNone()) ||
               (usesMaps() && frame.pruning == PairPruning::kLit);
    }
    /// Returns whether rays are tested against triangles.
    bool usesTriangles() const { return usesRays() && !frame.rays.believesAll(); }
    bool usesEmbree() const { return kind().needs().embree; }
    bool usesMaps() const { return kind().needs().maps; }
    /// Returns whether a cost model chooses the method of each map.
    bool isRouted() const { return kind().needs().routing; }
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
/// characters. A text that is changed by this gets eight hex digits of its hash, so that different
/// texts have different names.
std::string fileSlug(const std::string& text);

/// Returns the settings shared by all configurations of an experiment: its size, and the first of
/// every list.
FrameOptions baseOptions(const Experiment& experiment);
/// Reads an experiment file or pipe, once, and returns the experiment. Throws Error kInput naming
/// the file, the key and the value, and what else readJsonFile throws.
/// @param content receives its JSON, unless null
Experiment readExperiment(const std::string& path, Json* content = nullptr);
/// Reads an experiment from JSON; messages begin with `where`.
Experiment experimentFromJson(const Json& json, const std::string& where);
/// Returns every key of the experiment, with defaults; experimentFromJson gives the same
/// experiment.
Json toJson(const Experiment& experiment);

/// Throws Error kUsage for the first run whose level of detail its voxels do not have, or whose
/// voxels are believed to a displacement, which holds for no larger cells.
void refuseLods(const std::vector<RunParameters>& runs);

/// Returns thresholds, ascending, each of which routes a frame's maps in another way, and none as
/// maps or rays alone do: at up to six quantiles of the requests, each the roundest number that
/// routes so, with the paper's among them where it routes in its own way.
/// @param requests required resolutions of the maps, texels
std::vector<float> automaticThresholds(std::vector<float> requests);

/// Returns the resolutions that RunParameters::dag of an experiment's runs indexes, as log2.
std::vector<uint32_t> allResolutions(const Experiment& experiment);
/// A sweep of more combinations of values is refused: short lists of a small file multiply.
constexpr size_t kMaxCombinationCount = 16384;

/// Returns the configurations of an experiment in the order of charts: embree, then for every
/// combination of the lists the thresholds, then the DAG-only resolutions, then the models; or, if
/// variants are given, embree and these, at the first of every list. No two are equal. Automatic
/// thresholds are represented by the paper's.
/// @param dagResolutions of the available DAGs: the experiment's resolutions, then its DAG-only
/// ones, or those of the given assets
/// @param fullCount how many of them take part in the whole sweep; the others in method dag alone
std::vector<RunParameters> configurations(const Experiment& experiment,
                                          const std::vector<uint32_t>& dagResolutions,
                                          size_t fullCount);

} // namespace shadowdag
