// SPDX-License-Identifier: Apache-2.0
// The times of a sequence, over all of its frames and rounds.
#pragma once

#include "tools/settings/json.h"

namespace shadowdag {

/// The share of frames that the stated worst frame is not slower than: the slowest frame of all is
/// one value, and larger the more frames are measured.
constexpr double kWorstFrameQuantile = 0.99;

/// Returns one object per scene and configuration: scene, label, frame_count, value_count (frames
/// times rounds), the mean over the frames' medians time_ms_mean, the median time_ms over all
/// values and the 99th percentile time_ms_p99, both with _low, _high and _confidence of their
/// intervals by order statistics. A percentile of few values has no upper bound: its interval then
/// ends at the slowest frame, and the confidence says what that holds. Where the rows hold a run of
/// method `embree`, also time_over_embree, with its interval: the median over frames and rounds of
/// the time over Embree's of the same frame and round. Rows without round_times_ms, of older
/// results, count as one value of their median.
/// @param rows sequence_runs of results.json
Json sequenceTimes(const Json& rows);

} // namespace shadowdag
