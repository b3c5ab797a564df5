// SPDX-License-Identifier: Apache-2.0
// Lookups of a cluster's samples in one map, and the marking of their pages, in lanes with the
// widest vector instructions of the processor: the bits of lookupVisibility
// (shadowmap/shadow_map_lookup.h) and of markLookup (shadowmap/lookup_pages.h).
#pragma once

#include "hybrid/frame/lookup_lanes_work.h"
#include "hybrid/frame/sample_lanes_work.h"
#include "shadowmap/lookup_pages.h"
#include "voxel/dag_stream.h"

#include <vector>

namespace shadowdag {

/// Looks up one light of one cluster after the other. Not thread-safe: one a thread.
class LookupLanes {
public:
    explicit LookupLanes(StreamIsa isa = bestStreamIsa());

    /// Sets `seen` to lookupVisibility of the asked samples and returns how many taps had no page
    /// with memory. Filters that leave a face of a cube and those that omit all taps are answered
    /// one by one.
    /// @param map index into maps.maps @param samples its positions and normals are read
    /// @param isAsked,seen by sample
    uint32_t lookUp(const ShadowMapView& maps, uint32_t map, const ShadowMapBias& bias,
                    const stream::SampleWork& samples, View<const uint8_t> isAsked,
                    View<uint8_t> seen);

    /// Marks the pages that lookUp of the asked samples reads: markLookup of each.
    /// @param map index into demand.maps; the rest as above
    void markPages(const PageDemand& demand, uint32_t map, const stream::SampleWork& samples,
                   View<const uint8_t> isAsked);

private:
    /// Returns the samples, and room for those that are left.
    stream::LookupWork workOf(const stream::SampleWork& samples, View<const uint8_t> isAsked);
    /// Sets what lanes read of a map, and runs a kernel; if lanes do not fit, all asked are left.
    void run(void (*kernel)(stream::LookupWork&), const ShadowMapInfo& map, bool doLanesFit,
             uint32_t pageTexelsLog2, const ShadowMapBias& bias, stream::LookupWork& work);

    StreamIsa isa_;
    std::vector<uint32_t> left_; ///< samples that are looked up one by one
};

} // namespace shadowdag
