// SPDX-License-Identifier: Apache-2.0
// Marks the pages of a frame's shadow maps, by its samples or by the boxes of its clusters.
#pragma once

#include "hybrid/frame/frame_clusters.h"
#include "shadowmap/page_mask.h"

#include <memory>

namespace shadowdag {

/// Returns what marks the pages for the lookups of a frame's clusters.
/// @param receivers of clusters, on the backend; all arguments outlive the result
std::unique_ptr<PageMarker> pageMarkerOf(const FrameContext& context, const VisibleSurface& surface,
                                         const FrameClusters& clusters,
                                         View<const MapReceiver> receivers, PageMarks marks);

} // namespace shadowdag
