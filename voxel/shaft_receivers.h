// SPDX-License-Identifier: Apache-2.0
// The samples of one cluster and all that one light can do to them: shafts from the whole down to
// parts of it, then rays from where the shafts end.
#pragma once

#include "voxel/shaft.h"

#include <vector>

namespace shadowdag {

/// What shafts did.
/// askedCount: (cluster, light) pairs asked; litCount, darkCount: those proven whole; pairCount:
/// (sample, light) pairs asked, litPairCount, darkPairCount: proven, in whole or in part;
/// shaftCount: shafts made; cutCount, cutCellCount: times that rays were traced from a cut, and its
/// cells.
struct ShaftCounts {
    uint64_t askedCount = 0, litCount = 0, darkCount = 0;
    uint64_t pairCount = 0, litPairCount = 0, darkPairCount = 0;
    uint64_t shaftCount = 0, cutCount = 0, cutCellCount = 0;

    void add(const ShaftCounts& o) {
        askedCount += o.askedCount;
        litCount += o.litCount;
        darkCount += o.darkCount;
        pairCount += o.pairCount;
        litPairCount += o.litPairCount;
        darkPairCount += o.darkPairCount;
        shaftCount += o.shaftCount;
        cutCount += o.cutCount;
        cutCellCount += o.cutCellCount;
    }
};

/// The samples of a cluster, sorted by normal (facets) and then by place in the tile: quarters and
/// sixteenths of it. Reused from cluster to cluster; one a thread.
class ShaftReceivers {
public:
    /// Pixels a side of the tile that a cluster's samples lie in.
    static constexpr uint32_t kTileSide = 32;

    /// Starts anew, without samples. @param offset as shadowSegment's
    void reset(const VoxelGrid& grid, float offset);

    /// Adds a sample. @param normalWorld unit, on the side of the lights that are asked for
    /// @param x,y its pixel within the tile, below kTileSide
    void add(const glm::vec3& positionWorld, const glm::vec3& normalWorld, uint32_t x, uint32_t y);

    /// Ends adding.
    void build();

    size_t count() const { return starts_.count(); }

    /// Sets blocked[i] to occluded(dag, shadowSegment(sample i, light), 0) for the samples i with
    /// isAsked[i] != 0, leaves the others alone, and adds to `counts`. After build(). Any DAG will
    /// do; shafts are made only where it has its wide form.
    /// @param isAsked,blocked count()
    /// @param onlyProofs set kUnproven instead of tracing rays
    void answer(const DagView& dag, const glm::vec3& lightWorld, View<const uint8_t> isAsked,
                View<uint8_t> blocked, ShaftCounts& counts, bool onlyProofs = false);

    static constexpr uint8_t kUnproven = 2;

    /// Returns the samples, which were numbered as they were added, in the order in which they are
    /// asked: neighbours are alike.
    const std::vector<uint32_t>& order() const { return sorted_; }
    const ShadowStarts& starts() const { return starts_; }

private:
    static constexpr uint32_t kFacets = 4, kParts = 16; ///< parts: of a tile

    /// Samples with like normals, in a frame of their own.
    struct Facet {
        glm::dvec3 axis[3]; ///< along pixel rows, along columns, normal
        glm::dvec3 side[3]; ///< coordinates are side . p; p = sum of axis * coordinate
        glm::dvec3 normalSum{0.0};
        double spread = 0;
        double sums[8] = {}; ///< of x, y, xx, xy, yy, 1
        glm::dvec3 pointSums[3] = {glm::dvec3(0.0), glm::dvec3(0.0), glm::dvec3(0.0)};
    };
    struct Bounds {
        glm::dvec3 low{1e300}, high{-1e300};
    };

    void makeFrame(Facet& facet) const;
    ShaftBase baseOf(uint32_t facet, uint32_t firstPart, uint32_t partCount) const;
    void ask(const DagView& dag, uint32_t facet, uint32_t firstPart, uint32_t partCount,
             const std::vector<WideCell>& from, int depth);
    void trace(const DagView& dag, uint32_t begin, uint32_t end, const std::vector<WideCell>* from);

    ShadowStarts starts_;
    std::vector<glm::vec3> normals_;
    std::vector<uint16_t> pixel_; ///< x | y << 8
    std::vector<uint8_t> facetOf_;
    uint32_t facetCount_ = 0;
    Facet facets_[kFacets];
    Bounds bounds_[kFacets * kParts];
    uint32_t partStart_[kFacets * kParts + 1];
    std::vector<uint32_t> sorted_; ///< samples, by facet and part

    // Of the light that is asked for.
    glm::vec3 lightWorld_;
    uint32_t askedStart_[kFacets * kParts + 1];
    std::vector<uint32_t> asked_; ///< as sorted_, those asked
    std::vector<uint8_t> answers_;
    std::vector<DagSegment> segments_;
    Shaft shaft_;
    ShaftCells cells_[3];
    std::vector<WideCell> root_;
    ShaftCounts* counts_ = nullptr;
    bool onlyProofs_ = false;
};

} // namespace shadowdag
