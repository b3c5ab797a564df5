// SPDX-License-Identifier: Apache-2.0
// The windows of directional lights' maps.
#pragma once

#include "hybrid/frame/frame_clusters.h"

namespace shadowdag {

/// Gives the records of directional lights their windows, over the clusters that request them.
/// @param lights the world's
void fitDirectionalWindows(const FrameClusters& clusters, const std::vector<Light>& lights,
                           const FrameOptions& options, std::vector<MapRecord>& records);

} // namespace shadowdag
