// SPDX-License-Identifier: Apache-2.0
// Lookups of a cluster's samples in one map, in lanes with the widest vector instructions of
// the processor: the bits of lookupVisibility (shadowmap/shadow_map_lookup.h).
#pragma once

#include "hybrid/frame/lookup_lanes_work.h"
#include "hybrid/frame/sample_lanes_work.h"
#include "shadowmap/shadow_map_lookup.h"
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

private:
    void lookUpInLanes(const ShadowMapView& maps, const ShadowMapInfo& map,
                       const ShadowMapBias& bias, stream::LookupWork& work);

    StreamIsa isa_;
    std::vector<uint32_t> left_; ///< samples that are looked up one by one
};

} // namespace shadowdag
