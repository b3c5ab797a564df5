// SPDX-License-Identifier: Apache-2.0
// What a cell of a study amounts to over its frames: errors, flicker, and what was drawn and
// traced.
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

    /// Judges a frame and adds it. @param followsAnswers false: nothing can flicker
    ErrorReport add(Judge& judge, int frame, const Answers& answers, const Camera& camera,
                    bool followsAnswers = true);

    CellCounts counts() const;
    const ErrorCounts& errors() const { return errors_; }
    /// Returns errors (toJson), all measures, flicker by what changed, maps and texels.
    Json json() const;

private:
    Workspace& workspace_;
    FlickerMeter meter_;
    ErrorCounts errors_;
    FlickerCounts flickers_;
    uint64_t missingTapCount_ = 0, tracedMapCount_ = 0, drawnMapCount_ = 0, texelCount_ = 0;
};

} // namespace shadowdag
