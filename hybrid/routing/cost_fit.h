// SPDX-License-Identifier: Apache-2.0
// Fits predicted costs of maps to measured ones: the simplest sums that route well, judged on
// frames and scenes that were held out.
//
// The first form is a constant for either method, which chooses the better single one. Then all
// choices of terms are tried, by their number: a term that helps in neither sum alone may help in
// both. The choice of a size with the least held-out regret (loss by its routes) replaces the
// smaller one kept before if it lowers the regret by more than the standard error of the
// difference. The result is the best of thousands of choices, so its held-out regret is slightly
// better than that of new frames.
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
    std::string view; ///< distinguishes frames of one number: the picture's size, options
    uint32_t frame = 0;
    std::vector<MapQuantities> maps;
    std::vector<MapCost> costs;                    ///< one a map, in their order
    std::array<double, kCountNameCount> countMs{}; ///< times of counting quantities
};

/// Returns the time that the routes lose against the cheaper method of every map, as a share of the
/// time of the cheaper methods: 0.1 is a tenth slower. 0 for a frame without maps. @param counts
/// quantities that the frame counts for them, a set of Counts; their time is lost as well
double routingRegret(const ObservedFrame& frame, const std::vector<Route>& routes, uint32_t counts);

/// Regret over frames: their mean, and its standard error. In a fit a group that is held out
/// together counts as one: views of one frame, or all frames of a scene.
struct Regret {
    double mean = 0, standardError = 0;
};
Regret meanRegret(const std::vector<double>& ofFrames);

using ObservedFrames = std::vector<const ObservedFrame*>;

/// Returns the sums of a form's terms, with coefficients fitted to the frames. A residual has
/// weight 1 / sqrt(raysMs + mapMs): long times are measured with larger errors, and cheap maps are
/// many.
CostCalibration fitForm(const ObservedFrames& frames, const CostCalibration& form);

/// Returns the N of the model texels:N with the least regret over the frames: the requirement of
/// some map, or infinity; the least among equals.
double bestThreshold(const ObservedFrames& frames);

/// The groups that are held out.
enum class HeldOut : uint8_t {
    kScenes, ///< all frames of a scene
    kFrames, ///< every frame by itself
};

/// Returns whether data remain for the fit when any of the groups is held out.
bool canHoldOut(const ObservedFrames& frames, HeldOut heldOut);

/// Returns the regret of every frame when a model is fitted to the frames outside its group; needs
/// canHoldOut.
std::vector<double>
heldOutRegret(const ObservedFrames& frames, HeldOut heldOut,
              const std::function<std::unique_ptr<CostModel>(const ObservedFrames&)>& fit);

/// A form that was tried: terms and held-out regret.
struct FitTrial {
    CostCalibration form;                   ///< coefficients 0
    std::optional<Regret> byScene, byFrame; ///< held out; none if that is impossible
    Regret gain; ///< of the regret that judges, over the form kept before
    bool isKept = false;
};

struct CostFit {
    CostCalibration calibration;
    /// The groups that judged: scenes, if at least two of them gain by routing, otherwise frames;
    /// none for a single frame, which gets the better single method.
    std::optional<HeldOut> judgedBy;
    std::vector<FitTrial> trials;           ///< the first form, then the best of every size
    std::optional<Regret> byScene, byFrame; ///< of the chosen form
    /// Of other models on the same frames: single methods and texels:96, which are not fitted, and
    /// the best single threshold.
    Regret rays, maps, texels96;
    std::optional<Regret> thresholdByScene, thresholdByFrame;
    double threshold = 0; ///< texels, the best single one of all frames
};

/// Fits all of the frames. Throws Error kInput when no frame has a map.
CostFit fitCosts(const std::vector<ObservedFrame>& frames);

/// Returns a sum as text: "maps + samples", with coefficients that are not 0.
std::string formText(const std::vector<CostSummand>& sum);

} // namespace shadowdag
