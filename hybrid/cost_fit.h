// SPDX-License-Identifier: Apache-2.0
// Fits what maps cost to what they were measured to cost: the simplest sums that route well, judged
// on frames and scenes that were held out.
//
// Both sums start as a constant, which is the better single method; terms are added one at a time,
// or one to either sum at once, while that lowers the held-out regret by more than the standard
// error of what it lowers it by.
#pragma once

#include "hybrid/cost_terms.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// A frame whose maps were measured by both methods.
struct ObservedFrame {
    std::string scene;
    std::string view; ///< what tells frames of one number apart: the picture's size, options
    uint32_t frame = 0;
    std::vector<MapQuantities> maps;
    std::vector<MapCost> costs; ///< one a map, in their order
    double geometryMs = 0;      ///< what counting pages, triangles and batches took
};

/// Returns the time that the routes lose against the cheaper method of every map, over the time
/// that these take: 0.1 is a tenth slower. 0 for a frame without maps.
/// @param paysForGeometry whether the frame counts geometry (CostModel::needsGeometryCounts)
double routingRegret(const ObservedFrame& frame, const std::vector<Route>& routes,
                     bool paysForGeometry);

/// Regret over frames: their mean, and its standard error.
struct Regret {
    double mean = 0, standardError = 0;
};
Regret meanRegret(const std::vector<double>& ofFrames);

using ObservedFrames = std::vector<const ObservedFrame*>;

/// Returns the sums of a form's terms, with coefficients fitted to the frames. A residual weighs
/// 1 / sqrt(raysMs + mapMs): what takes longer is measured worse, and cheap maps are many.
CostCalibration fitForm(const ObservedFrames& frames, const CostCalibration& form);

/// Returns the N of the model texels:N that regrets least over the frames: what some map requires,
/// or infinity; the least among equals.
double bestThreshold(const ObservedFrames& frames);

/// What is held out together.
enum class HeldOut : uint8_t {
    kScenes, ///< all frames of a scene
    kFrames, ///< every frame by itself
};

/// Returns the regret of every frame when a model is fitted to what is not held out with it. A
/// frame that nothing is left to fit to is routed by a model that saw all.
std::vector<double>
heldOutRegret(const ObservedFrames& frames, HeldOut heldOut,
              const std::function<std::unique_ptr<CostModel>(const ObservedFrames&)>& fit);

/// A form that was tried: terms and held-out regret.
struct FitTrial {
    CostCalibration form;    ///< coefficients 0
    Regret byScene, byFrame; ///< held out so
    Regret gain;             ///< of the regret that judges, over the form kept before
    bool isKept = false;
};

struct CostFit {
    CostCalibration calibration;
    HeldOut judgedBy = HeldOut::kScenes; ///< kFrames when there is one scene only
    std::vector<FitTrial> trials;        ///< the first form, then of every round the best addition
    Regret byScene, byFrame;             ///< of what was kept
    /// Of other models on the same frames: single methods, texels:96, the best single threshold.
    Regret rays, maps, texels96, thresholdByScene, thresholdByFrame;
    double threshold = 0; ///< texels, the best single one of all frames
};

/// Fits all of the frames. Throws Error kUsage when no frame has a map.
CostFit fitCosts(const std::vector<ObservedFrame>& frames);

/// Returns a sum for people: "maps + samples", with coefficients where they are not 0.
std::string formText(const std::vector<CostSummand>& sum);

} // namespace shadowdag
