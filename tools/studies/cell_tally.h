// SPDX-License-Identifier: Apache-2.0
// The totals of a cell of a study over its frames: errors, flicker, and drawn and traced counts.
#pragma once

#include "hybrid/judge/flicker.h"
#include "tools/settings/json.h"
#include "tools/studies/cell_counts.h"
#include "tools/workspace/judge.h"

namespace shadowdag {

/// Frames of one method, one after the other.
class CellTally {
public:
    explicit CellTally(Workspace& workspace)
        : workspace_(workspace), meter_(workspace.truth(), 1, 6000) {}

    /// Judges a frame and adds it. @param measuresFlicker false: flicker is not measured
    ErrorReport add(Judge& judge, int frame, const PairResults& answers, const Camera& camera,
                    bool measuresFlicker = true);

    CellCounts counts() const;
    const ErrorCounts& errors() const { return errors_; }
    /// Returns errors (toJson), the null rate (0 where no pair was sampled), all measures, flicker
    /// by what changed, maps and texels.
    Json json() const;

private:
    Workspace& workspace_;
    FlickerMeter meter_;
    ErrorCounts errors_;
    double nullFlipCount_ = 0;
    uint64_t nullSampleCount_ = 0;
    double outlineFlipCount_ = 0; ///< of right pairs near an outline
    uint64_t outlineSampleCount_ = 0;
    FlickerCounts flickers_;
    uint64_t missingTapCount_ = 0, tracedMapCount_ = 0, drawnMapCount_ = 0, texelCount_ = 0;
};

} // namespace shadowdag
