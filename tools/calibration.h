// SPDX-License-Identifier: Apache-2.0
// What `calibrate` measures of a frame: every map by both methods, and whole frames beside the sums
// of these.
#pragma once

#include "hybrid/cost_fit.h"
#include "hybrid/frame.h"

namespace shadowdag {

/// A frame measured. Times are of the stages that routing decides about: kShadowMapStages and
/// shading.
struct CalibrationFrame {
    /// costs: isolated, then scaled so that those of all maps by one method add up to the whole
    /// frame by that method: what a method shares among maps (a cluster's samples made ready,
    /// threads woken) is paid once a frame, and by every map that is measured alone.
    ObservedFrame observed;
    double raysSumMs = 0, mapsSumMs = 0;  ///< isolated, over all maps
    double raysMs = 0, mapsMs = 0;        ///< whole frame by one method
    double oracleSumMs = 0, oracleMs = 0; ///< of the cheaper method by isolated cost
    double scaledSumMs = 0, scaledMs = 0; ///< of the cheaper method by scaled cost
};

/// Measures a frame. Every time is a median of `repeats`; rounds of whole frames take turns.
/// @param renderer of a world with a DAG; forgets the past before every run
CalibrationFrame measureCalibrationFrame(FrameRenderer& renderer, const Camera& camera,
                                         const FrameOptions& options, int repeats);

} // namespace shadowdag
