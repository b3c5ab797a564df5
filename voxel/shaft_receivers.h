// SPDX-License-Identifier: Apache-2.0
// The samples of one cluster and all that one light can do to them: shafts from the whole down to
// parts of it, then rays from where the shafts end.
#pragma once

#include "voxel/shaft.h"
#include "voxel/shaft_counts.h"

#include <vector>

namespace shadowdag {

/// The samples of a cluster, sorted by normal (facets) and then by place in the tile: quarters and
/// sixteenths of it. Reused from cluster to cluster; one a thread.
class ShaftReceivers {
public:
    /// Pixels a side of the tile that a cluster's samples lie in.
    static constexpr uint32_t kTileSide = 32;

    enum Mode {
        kRays,          ///< no shafts; `counts` counts what is asked
        kOnlyProofs,    ///< no rays
        kProofsAndRays, ///< rays for what shafts do not prove
    };

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
    /// @param mode kOnlyProofs: kUnproven instead of tracing rays
    void answer(const DagView& dag, const glm::vec3& lightWorld, View<const uint8_t> isAsked,
                View<uint8_t> blocked, ShaftCounts& counts, Mode mode = kProofsAndRays);

    static constexpr uint8_t kUnproven = 2;

    /// Returns whether the segments of all samples i with isAsked[i] != 0 are proven unblocked: by
    /// shafts, or by their rays where they are few. False does not mean that one is blocked. After
    /// build(). Gives up at the first part that is not lit.
    /// @param dag with its wide form @param isAsked count()
    bool provesLit(const DagView& dag, const glm::vec3& lightWorld, View<const uint8_t> isAsked);

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
        AbovePlane above;
        double spread = 0;
        double sums[8] = {}; ///< of x, y, xx, xy, yy, 1
        glm::dvec3 pointSums[3] = {glm::dvec3(0.0), glm::dvec3(0.0), glm::dvec3(0.0)};
    };
    struct Bounds {
        glm::dvec3 low{1e300}, high{-1e300};
    };

    void makeFrame(Facet& facet) const;
    ShaftBase baseOf(uint32_t facet, uint32_t firstPart, uint32_t partCount) const;
    void ask(const DagView& dag, uint32_t facet, uint32_t firstPart, uint32_t partCount);
    bool provesLit(const DagView& dag, uint32_t facet, uint32_t firstPart, uint32_t partCount);
    /// Lists the samples asked of a light.
    void listAsked(const glm::vec3& lightWorld, View<const uint8_t> isAsked);
    /// Returns what a few rays of these samples say; kDark: stopper_ is what stops one of them.
    ShaftAnswer probe(const DagView& dag, uint32_t begin, uint32_t end);
    /// Leaves the answers of these to rays.
    void putOff(uint32_t begin, uint32_t end);
    void trace(const DagView& dag, View<const uint32_t> which, View<uint8_t> answers,
               const std::vector<WideCell>* from);
    /// Traces all that was put off, in full packets.
    void tracePending(const DagView& dag);

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
    std::vector<uint8_t> answers_, blocked_;
    std::vector<uint32_t> pending_, which_; ///< into asked_; their samples
    std::vector<DagSegment> segments_;
    Shaft shaft_;
    glm::uvec3 stopper_{0};
    std::vector<WideCell> root_, cut_;
    ShaftCounts* counts_ = nullptr;
    Mode mode_ = kProofsAndRays;
};

} // namespace shadowdag
