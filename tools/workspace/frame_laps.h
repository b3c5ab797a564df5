// SPDX-License-Identifier: Apache-2.0
// Times of frames in sequence, and nothing besides: `render --laps`.
#pragma once

#include "tools/workspace/single_frame.h"

namespace shadowdag {

/// Renders the frames of an experiment `laps` times in a row as one sequence and returns the last
/// lap's rows, a frame each: "frame", "time_s", "camera_numbers", "wall_ms" (the frame proper by
/// the wall clock), "time_ms" (the sum of its stages), "stages_ms", the counts of a frame without
/// recording, "host_copy_count", "host_readback_count". The laps before warm up caches, memory and
/// the maps that are kept. No picture, pair or quantity is recorded.
/// @param laps 1 or more
/// Throws the errors of SingleFrames::renderNext.
Json timeLaps(SingleFrames& frames, const Experiment& experiment, int laps,
              const Progress& progress);

/// Returns {"wall_ms", "wall_ms_max", "time_ms", "stages_ms"} of timeLaps's rows: medians, and the
/// slowest frame.
Json summarizeLap(const Json& rows);

} // namespace shadowdag
