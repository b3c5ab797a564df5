// SPDX-License-Identifier: Apache-2.0
// The method that computes the pairs of a map, or of a cluster and a light.
#pragma once

#include "cuda/macros.h"

#include <cstdint>

namespace shadowdag {

/// How the visibility of a pair is computed.
enum class ServedBy : uint32_t {
    kRays,  ///< rays through voxels and the other inputs of RayInputs
    kMap,   ///< a lookup in a drawn shadow map
    kProof, ///< none: the light was proven to see the whole cluster
};

/// The method, and which of ShadowMapView::maps it reads.
///     bits 0 to 1    ServedBy
///     bits 2 to 31   of kMap: index into ShadowMapView::maps; else 0
struct PairServer {
    static constexpr uint32_t kMethodBits = 2, kMostMaps = 1u << (32 - kMethodBits);

    SDAG_HD static PairServer rays() { return {uint32_t(ServedBy::kRays)}; }
    SDAG_HD static PairServer proof() { return {uint32_t(ServedBy::kProof)}; }
    SDAG_HD static PairServer drawnMap(uint32_t map) {
        return {uint32_t(ServedBy::kMap) | map << kMethodBits};
    }

    SDAG_HD ServedBy by() const { return ServedBy(word & ((1u << kMethodBits) - 1)); }
    SDAG_HD bool isMap() const { return by() == ServedBy::kMap; }
    /// Returns the index of the map, of kMap.
    SDAG_HD uint32_t map() const { return word >> kMethodBits; }

    SDAG_HD bool operator==(const PairServer& other) const { return word == other.word; }

    uint32_t word = 0;
};
static_assert(sizeof(PairServer) == 4);

} // namespace shadowdag
