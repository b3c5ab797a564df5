// SPDX-License-Identifier: Apache-2.0
// Proves that all samples of a cluster see a light, by shafts from the whole cluster down to parts
// of it. Frames trace rays instead (LAYOUT.md, "Shafts tried before streams"): a proof costs as
// much as its rays and pays only if its result is used in more than one frame.
#pragma once

#include "voxel/receiver_groups.h"
#include "voxel/shaft.h"

#include <vector>

namespace shadowdag {

/// Proves clusters lit, one after the other; one object per thread.
class LitProof {
public:
    /// Prepares the cluster's shafts. @param receivers after build(); outlives the proofs
    void reset(const ReceiverGroups& receivers);

    /// Returns whether the segments of all samples i with isAsked[i] != 0 are proven unblocked: by
    /// shafts, or by their rays where they are few. False does not mean that one is blocked. Gives
    /// up at the first part that is not lit.
    /// @param dag without its wide form nothing is proven @param isAsked one a sample
    bool provesLit(const DagView& dag, const glm::vec3& lightWorld, View<const uint8_t> isAsked);

private:
    static constexpr uint32_t kFacets = ReceiverGroups::kFacets, kParts = ReceiverGroups::kParts;

    /// Samples with like normals, in a frame of their own.
    struct Facet {
        glm::dvec3 axis[3]; ///< along pixel rows, along columns, normal
        glm::dvec3 side[3]; ///< coordinates are side . p; p = sum of axis * coordinate
        glm::dvec3 normalSum{0.0};
        AbovePlane above;
        double spread = 0;
        double sums[6] = {}; ///< of x, y, xx, xy, yy, 1
        glm::dvec3 pointSums[3] = {glm::dvec3(0.0), glm::dvec3(0.0), glm::dvec3(0.0)};
    };
    struct Bounds {
        glm::dvec3 low{1e300}, high{-1e300};
    };

    void makeFrame(Facet& facet) const;
    ShaftBase baseOf(uint32_t facet, uint32_t firstPart, uint32_t partCount) const;
    bool provesLit(const DagView& dag, uint32_t facet, uint32_t firstPart, uint32_t partCount);
    /// Returns whether the rays of these samples are all unblocked.
    bool areLit(const DagView& dag, View<const uint32_t> samples);

    const ReceiverGroups* receivers_ = nullptr;
    Facet facets_[kFacets];
    Bounds bounds_[kFacets * kParts];

    // Of the current light.
    glm::vec3 lightWorld_;
    uint32_t askedStart_[kFacets * kParts + 1];
    std::vector<uint32_t> asked_; ///< samples, by bin
    std::vector<uint8_t> blocked_;
    std::vector<DagSegment> segments_;
    Shaft shaft_;
};

} // namespace shadowdag
