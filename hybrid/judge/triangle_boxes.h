// SPDX-License-Identifier: Apache-2.0
// A tree of boxes over all triangles, which gives the adjudicator the few that a family of segments
// may touch. Its own: neither Embree's nor the hierarchy of exact rays. A triangle is lost only if
// a box that contains it surely misses all segments.
#pragma once

#include "hybrid/judge/segment_family.h"

#include <vector>

namespace shadowdag {

/// Median splits along the longest side, up to kLeafSize triangles a leaf.
class TriangleBoxes {
public:
    static constexpr uint32_t kLeafSize = 4;

    /// @param triangles world space, finite; their positions are not kept
    explicit TriangleBoxes(const TriangleView& triangles);

    /// Appends every triangle whose box a segment of the family may touch, in a fixed order;
    /// others may be among them.
    void append(const SegmentFamily& family, std::vector<uint32_t>& triangles) const;

private:
    struct Node {
        glm::vec3 low, high;
        uint32_t first, count; ///< of order_; count 0: children are next node and `first`
    };
    void build(uint32_t first, uint32_t count, const std::vector<glm::vec3>& low,
               const std::vector<glm::vec3>& high);

    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;
};

} // namespace shadowdag
