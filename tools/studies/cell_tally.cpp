// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/cell_tally.h"

#include "tools/workspace/frame_json.h"

namespace shadowdag {

ErrorReport CellTally::add(Judge& judge, int frame, const PairResults& answers,
                           const Camera& camera, bool measuresFlicker) {
    ErrorReport report = judge.judge(frame, answers);
    errors_.add(report.total);
    nullFlipCount_ += report.nullRate * double(report.nullSampleCount);
    nullSampleCount_ += report.nullSampleCount;
    outlineFlipCount_ += report.outlineNullRate * double(report.outlineNullSampleCount);
    outlineSampleCount_ += report.outlineNullSampleCount;
    missingTapCount_ += answers.missingTapCount;
    const FrameCounts& counts = answers.frame.counts;
    tracedMapCount_ += counts.tracedMapCount;
    drawnMapCount_ += counts.drawnMapCount;
    texelCount_ += counts.maps.texelCount;
    if (measuresFlicker) {
        workspace_.truth(); // as it is now: the meter uses it as well
        flickers_.add(meter_.add({errorInputs(workspace_.world(), answers), camera}));
    }
    return report;
}

CellCounts CellTally::counts() const {
    return cellCounts(errors_, missingTapCount_, flickers_.total().flickerCount);
}

Json CellTally::json() const {
    Json json = toJson(errors_);
    json["null_rate"] = nullSampleCount_ > 0 ? nullFlipCount_ / double(nullSampleCount_) : 0.0;
    json["null_sample_count"] = nullSampleCount_;
    json["outline_null_rate"] =
        outlineSampleCount_ > 0 ? outlineFlipCount_ / double(outlineSampleCount_) : 0.0;
    json["outline_null_sample_count"] = outlineSampleCount_;
    const CellCounts all = counts();
    for (size_t m = 0; m < all.size(); ++m)
        json[kCellMeasureNames[m]] = all[m];
    json["flicker_answer_count"] = flickers_.total().answerCount;
    json["flicker_held_count"] = flickers_.of(FlickerChange::kHeld).flickerCount;
    json["flicker_resolution_switch_count"] =
        flickers_.of(FlickerChange::kResolutionSwitch).flickerCount;
    json["flicker_method_switch_count"] = flickers_.of(FlickerChange::kMethodSwitch).flickerCount;
    json["traced_map_count"] = tracedMapCount_;
    json["drawn_map_count"] = drawnMapCount_;
    json["texel_count"] = texelCount_;
    return json;
}

} // namespace shadowdag
