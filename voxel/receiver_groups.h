// SPDX-License-Identifier: Apache-2.0
// The samples of one cluster in an order in which neighbours are similar, for rays that are traced
// together and for proofs about groups of them.
#pragma once

#include "voxel/shadow_starts.h"

#include <vector>

namespace shadowdag {

/// The samples of a cluster, sorted by normal (facets) and then by position in the tile (quarters
/// and sixteenths of it). Reused from cluster to cluster; one per thread.
class ReceiverGroups {
public:
    /// Pixels a side of the tile that a cluster's samples lie in.
    static constexpr uint32_t kTileSide = 32;
    /// Maximum number of facets, and of parts of the tile. A bin is a part of a facet: facet *
    /// kParts + part.
    static constexpr uint32_t kFacets = 4, kParts = 16;

    /// Starts anew, without samples. @param offset as shadowSegment's
    void reset(const VoxelGrid& grid, float offset);
    /// The same, for rays that do not go through voxels: starts() stays empty.
    void reset();

    /// Adds a sample. @param normalWorld unit, on the side of the lights
    /// @param x,y its pixel within the tile, below kTileSide
    void add(const glm::vec3& positionWorld, const glm::vec3& normalWorld, uint32_t x, uint32_t y);

    /// Sorts the samples; ends adding.
    void build();

    size_t count() const { return normals_.size(); }
    uint32_t facetCount() const { return facetCount_; }
    uint32_t binCount() const { return facetCount_ * kParts; }
    uint32_t facetOf(size_t sample) const { return facetOf_[sample]; }
    uint32_t binOf(size_t sample) const;
    const glm::vec3& normalWorld(size_t sample) const { return normals_[sample]; }
    uint32_t pixelX(size_t sample) const { return pixel_[sample] & 0xff; }
    uint32_t pixelY(size_t sample) const { return pixel_[sample] >> 8; }

    /// Returns the samples, numbered as they were added, by bin.
    const std::vector<uint32_t>& order() const { return sorted_; }
    const ShadowStarts& starts() const { return starts_; }

    /// Lists the samples i with isAsked[i] != 0 by bin.
    /// @param isAsked count() @param binStart null, or binCount() + 1: where each bin starts
    void listAsked(View<const uint8_t> isAsked, std::vector<uint32_t>& asked,
                   uint32_t* binStart = nullptr) const;

private:
    ShadowStarts starts_;
    bool hasStarts_ = false;
    std::vector<glm::vec3> normals_;
    std::vector<uint16_t> pixel_; ///< x | y << 8
    std::vector<uint8_t> facetOf_;
    uint32_t facetCount_ = 0;
    uint32_t binStart_[kFacets * kParts + 1];
    std::vector<uint32_t> sorted_;
};

} // namespace shadowdag
