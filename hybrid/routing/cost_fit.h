// SPDX-License-Identifier: Apache-2.0
// Fits what maps cost to what they were measured to cost: the simplest sums that route well, judged
// on frames and scenes that were held out.
//
// The first form is a constant for either method, which is the better single one. Then all choices
// of terms are tried, by their number: a term that helps in neither sum by itself may help in both.
// The choice of a size that loses least by its routes on what was held out (regret) replaces the
// smaller one that was kept where that falls by more than the standard error of what it falls by.
// What is kept is the best of thousands of choices: its held-out regret is a little better than
// what new frames will show.
#pragma once

#include "hybrid/routing/cost_terms.h"

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// A frame whose maps were measured by both methods.
struct ObservedFrame {
    std::string scene;
    std::string view; ///< what tells frames of one number apart: the picture's size, options
    uint32_t frame = 0;
    std::vector<MapQuantities> maps;
    std::vector<MapCost> costs;                    ///< one a map, in their order
    std::array<double, kCountNameCount> countMs{}; ///< what counting quantities took
};

/// Returns the time that the routes lose against the cheaper method of every map, over the time
/// that these take: 0.1 is a tenth slower. 0 for a frame without maps.
/// @param counts what the frame counts for them, a set of Counts; its time is lost as well
double routingRegret(const ObservedFrame& frame, const std::vector<Route>& routes, uint32_t counts);

/// Regret over frames: their mean, and its standard error. In a fit what is held out together
/// counts as one: views of one frame, or all frames of a scene.
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

/// Returns whether something is left to fit to when any of the frames is held out.
bool canHoldOut(const ObservedFrames& frames, HeldOut heldOut);

/// Returns the regret of every frame when a model is fitted to what is not held out with it; needs
/// canHoldOut.
std::vector<double>
heldOutRegret(const ObservedFrames& frames, HeldOut heldOut,
              const std::function<std::unique_ptr<CostModel>(const ObservedFrames&)>& fit);

/// A form that was tried: terms and held-out regret.
struct FitTrial {
    CostCalibration form;                   ///< coefficients 0
    std::optional<Regret> byScene, byFrame; ///< held out so; none where nothing can be
    Regret gain; ///< of the regret that judges, over the form kept before
    bool isKept = false;
};

struct CostFit {
    CostCalibration calibration;
    /// What judged: scenes, where two of them at least gain by routing, otherwise frames; none for
    /// a single frame, which is given the better single method.
    std::optional<HeldOut> judgedBy;
    std::vector<FitTrial> trials;           ///< the first form, then the best of every size
    std::optional<Regret> byScene, byFrame; ///< of what was kept
    /// Of other models on the same frames: single methods and texels:96, which are fitted to
    /// nothing, and the best single threshold.
    Regret rays, maps, texels96;
    std::optional<Regret> thresholdByScene, thresholdByFrame;
    double threshold = 0; ///< texels, the best single one of all frames
};

/// Fits all of the frames. Throws Error kUsage when no frame has a map.
CostFit fitCosts(const std::vector<ObservedFrame>& frames);

/// Returns a sum for people: "maps + samples", with coefficients where they are not 0.
std::string formText(const std::vector<CostSummand>& sum);

} // namespace shadowdag
