// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/triangle_boxes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace shadowdag {

namespace {

/// The undisturbed segment, thickened on each axis so that it contains all segments of a family.
class ThickSegment {
public:
    explicit ThickSegment(const SegmentFamily& family)
        : from_(family.start.center), way_(family.end.center - family.start.center),
          across_(glm::abs(way_)) {
        for (int a = 0; a < 3; ++a) {
            double most = 0;
            for (const PointBox* box : {&family.start, &family.end})
                most =
                    std::max({most, box->high[a] - box->center[a], box->center[a] - box->low[a]});
            // What this file computes itself is off by far less than 2^-40 of its size.
            half_[a] = most * (1.0 + 0x1p-40) + 0x1p-40 * (std::fabs(from_[a]) + across_[a]);
        }
    }

    /// Returns whether the box may touch it: separating axes, the three of the box and their cross
    /// products with the segment.
    bool mayTouch(const glm::vec3& low, const glm::vec3& high) const {
        const glm::dvec3 center = 0.5 * (glm::dvec3(low) + glm::dvec3(high));
        const glm::dvec3 half =
            0.5 * (glm::dvec3(high) - glm::dvec3(low)) + half_ + 0x1p-40 * glm::abs(center);
        const glm::dvec3 middle = from_ + 0.5 * way_ - center;
        for (int a = 0; a < 3; ++a)
            if (std::fabs(middle[a]) > half[a] + 0.5 * across_[a])
                return false;
        for (int a = 0; a < 3; ++a) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            const double distance = std::fabs(way_[b] * middle[c] - way_[c] * middle[b]);
            const double reach = across_[b] * half[c] + across_[c] * half[b];
            const double error =
                0x1p-48 * (across_[b] * std::fabs(middle[c]) + across_[c] * std::fabs(middle[b]));
            if (distance > reach + error)
                return false;
        }
        return true;
    }

private:
    glm::dvec3 from_, way_, across_, half_;
};

} // namespace

TriangleBoxes::TriangleBoxes(const TriangleView& triangles) {
    std::vector<glm::vec3> low(triangles.count()), high(triangles.count());
    for (size_t i = 0; i < low.size(); ++i) {
        const glm::vec3 a = triangles.vertex(i, 0), b = triangles.vertex(i, 1),
                        c = triangles.vertex(i, 2);
        low[i] = glm::min(glm::min(a, b), c);
        high[i] = glm::max(glm::max(a, b), c);
    }
    order_.resize(low.size());
    std::iota(order_.begin(), order_.end(), 0u);
    if (!order_.empty())
        build(0, uint32_t(order_.size()), low, high);
}

void TriangleBoxes::build(uint32_t first, uint32_t count, const std::vector<glm::vec3>& low,
                          const std::vector<glm::vec3>& high) {
    const size_t index = nodes_.size();
    Node node{low[order_[first]], high[order_[first]], first, count};
    for (uint32_t i = first; i < first + count; ++i) {
        node.low = glm::min(node.low, low[order_[i]]);
        node.high = glm::max(node.high, high[order_[i]]);
    }
    nodes_.push_back(node);
    if (count <= kLeafSize)
        return;
    const glm::dvec3 size = glm::dvec3(node.high) - glm::dvec3(node.low);
    const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    const auto middleOf = [&](uint32_t t) { return double(low[t][axis]) + double(high[t][axis]); };
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count, [&](uint32_t a, uint32_t b) {
        const double x = middleOf(a), y = middleOf(b);
        return x < y || (x == y && a < b);
    });
    build(first, count / 2, low, high);
    nodes_[index].first = uint32_t(nodes_.size());
    nodes_[index].count = 0;
    build(first + count / 2, count - count / 2, low, high);
}

void TriangleBoxes::append(const SegmentFamily& family, std::vector<uint32_t>& triangles) const {
    if (nodes_.empty())
        return;
    const ThickSegment segment(family);
    std::vector<uint32_t> stack{0};
    while (!stack.empty()) {
        const uint32_t index = stack.back();
        stack.pop_back();
        const Node& node = nodes_[index];
        if (!segment.mayTouch(node.low, node.high))
            continue;
        if (node.count > 0) {
            triangles.insert(triangles.end(), order_.begin() + node.first,
                             order_.begin() + node.first + node.count);
        } else {
            stack.push_back(node.first);
            stack.push_back(index + 1);
        }
    }
}

} // namespace shadowdag
