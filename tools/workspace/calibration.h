// SPDX-License-Identifier: Apache-2.0
// The measurements of `calibrate` for a frame: every map by both methods, and whole frames compared
// with the sums of these.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/routing/cost_fit.h"

namespace shadowdag {

/// A frame measured. Times are of the stages that routing decides about (servingMs).
struct CalibrationFrame {
    ObservedFrame observed;              ///< costs: FrameRenderer::measureCosts
    double raysScale = 1, mapsScale = 1; ///< FrameCosts
    double raysMs = 0, mapsMs = 0;       ///< whole frame by one method
    double degradeDivisor = 1;           ///< FrameCosts
    double oracleSumMs = 0,
           oracleMs = 0; ///< of the cheaper method of every map: predicted, measured
};

/// Measures a frame. Every time is a median of `repeats`.
/// @param renderer of a world with a DAG; its state is released before every run
CalibrationFrame measureCalibrationFrame(FrameRenderer& renderer, const Camera& camera,
                                         const FrameOptions& options, int repeats);

} // namespace shadowdag
