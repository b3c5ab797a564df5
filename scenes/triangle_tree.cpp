// SPDX-License-Identifier: Apache-2.0
#include "scenes/triangle_tree.h"

#include "cuda/cancel.h"
#include "cuda/scan_sort.h"
#include "scenes/morton.h"
#include "scenes/warning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace shadowdag {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997. Two-sided; returns
// the distance or infinity.
float intersect(const glm::vec3& origin, const glm::vec3& direction, const glm::vec3& a,
                const glm::vec3& b, const glm::vec3& c, bool& isFrontFace) {
    const glm::vec3 e1 = b - a, e2 = c - a;
    const glm::vec3 p = glm::cross(direction, e2);
    const float determinant = glm::dot(e1, p);
    if (determinant == 0.0f || !std::isfinite(determinant))
        return kInfinity;
    const float inverse = 1.0f / determinant;
    const glm::vec3 s = origin - a;
    const float u = glm::dot(s, p) * inverse;
    const glm::vec3 q = glm::cross(s, e1);
    const float v = glm::dot(direction, q) * inverse;
    const float t = glm::dot(e2, q) * inverse;
    if (!(u >= 0.0f && v >= 0.0f && u + v <= 1.0f && t > 0.0f))
        return kInfinity;
    isFrontFace = determinant > 0.0f;
    return t;
}

constexpr uint32_t kLeafSize = 4;
// Halving 2^32 triangles down to a leaf leaves at most one sibling a level on the stack.
constexpr int kMaxDepth = 34;
// The distances of boxes and of triangles are rounded separately: a box is left out only if it is
// farther than what was found by more than that.
constexpr float kSlack = 1.0f - 1e-5f;

// Returns where a ray enters a box; infinity if it misses it.
float enterBox(const Box& box, const glm::vec3& origin, const glm::vec3& direction) {
    float enter = 0.0f, leave = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0.0f) {
            if (origin[axis] < box.min[axis] || origin[axis] > box.max[axis])
                return kInfinity;
            continue;
        }
        float t0 = (box.min[axis] - origin[axis]) / direction[axis];
        float t1 = (box.max[axis] - origin[axis]) / direction[axis];
        if (t0 > t1)
            std::swap(t0, t1);
        enter = std::max(enter, t0);
        leave = std::min(leave, t1);
    }
    return enter * kSlack <= leave ? enter : kInfinity;
}

} // namespace

glm::vec3 closestPoint(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b,
                       const glm::vec3& c) {
    const glm::vec3 ab = b - a, ac = c - a, ap = p - a;
    const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0f && d2 <= 0.0f)
        return a;
    const glm::vec3 bp = p - b;
    const float d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0f && d4 <= d3)
        return b;
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f && d1 > d3)
        return a + ab * (d1 / (d1 - d3));
    const glm::vec3 cp = p - c;
    const float d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0f && d5 <= d6)
        return c;
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f && d2 > d6)
        return a + ac * (d2 / (d2 - d6));
    const float va = d3 * d6 - d5 * d4;
    const float towardsC = d4 - d3, towardsB = d5 - d6;
    if (va <= 0.0f && towardsC >= 0.0f && towardsB >= 0.0f && towardsC + towardsB > 0.0f)
        return b + (c - b) * (towardsC / (towardsC + towardsB));
    const float sum = va + vb + vc;
    if (!(sum > 0.0f))
        return a; // a degenerate triangle
    return a + ab * (vb / sum) + ac * (vc / sum);
}

float distanceSquared(const TriangleView& triangles, uint32_t t, const glm::vec3& p) {
    const glm::vec3 d =
        p - closestPoint(p, triangles.vertex(t, 0), triangles.vertex(t, 1), triangles.vertex(t, 2));
    return glm::dot(d, d);
}

void warnOfCutQueries(const QueryCost& cost, const std::string& what) {
    if (cost.cutCount > 0)
        warn(std::to_string(cost.cutCount) + " of " + std::to_string(cost.queryCount) +
             " rays that place " + what + " were cut short among triangles that overlap, so some " +
             what + " may be in worse places than usual; remove copies that lie on each other, " +
             "or give the file " + what + " of its own");
}

TriangleTree::TriangleTree(TriangleView triangles, const Box& bounds)
    : triangles_(triangles), items_(triangles.count()) {
    std::vector<uint64_t> codes(items_.size());
    for (uint32_t t = 0; t < codes.size(); ++t) {
        if (t % 65536 == 0)
            pollCpu();
        items_[t] = t;
        codes[t] = mortonCode(boxOf(t).center(), bounds);
    }
    sortPairs(Backend::kCpu, viewOf(codes), viewOf(items_));
    dropCoincident(codes);
    nodes_.reserve(items_.size());
    if (!items_.empty())
        build(0, uint32_t(items_.size()));
}

Box TriangleTree::boxOf(uint32_t triangle) const {
    Box box;
    for (int corner = 0; corner < 3; ++corner)
        box.add(triangles_.vertex(triangle, corner));
    return box;
}

// Keeps of triangles with the same corners in the same order the first. They have one code, so only
// runs of equal codes are sorted.
void TriangleTree::dropCoincident(const std::vector<uint64_t>& codes) {
    const auto corners = [&](uint32_t t) {
        std::array<float, 9> values;
        for (int i = 0; i < 9; ++i)
            values[size_t(i)] = triangles_.vertex(t, i / 3)[i % 3];
        return values;
    };
    size_t kept = 0;
    for (size_t first = 0, end; first < codes.size(); first = end) {
        for (end = first + 1; end < codes.size() && codes[end] == codes[first];)
            ++end;
        const auto begin = items_.begin() + std::ptrdiff_t(first),
                   last = items_.begin() + std::ptrdiff_t(end);
        if (end - first > 1) {
            pollCpu();
            std::sort(begin, last, [&](uint32_t a, uint32_t b) {
                const auto x = corners(a), y = corners(b);
                return x != y ? x < y : a < b;
            });
        }
        for (auto item = begin; item != last; ++item)
            if (item == begin || corners(*item) != corners(*(item - 1)))
                items_[kept++] = *item;
    }
    items_.resize(kept);
}

// Adds the subtree of items [begin, end); returns its node.
uint32_t TriangleTree::build(uint32_t begin, uint32_t end) {
    const auto node = uint32_t(nodes_.size());
    nodes_.push_back({{}, begin, end - begin});
    if (end - begin <= kLeafSize) {
        std::sort(items_.begin() + begin, items_.begin() + end);
        for (uint32_t i = begin; i < end; ++i)
            nodes_[node].box.add(boxOf(items_[i]));
        return node;
    }
    if (end - begin >= 65536)
        pollCpu();
    const uint32_t middle = begin + (end - begin) / 2;
    Box box = nodes_[build(begin, middle)].box;
    const uint32_t second = build(middle, end);
    box.add(nodes_[second].box);
    nodes_[node] = {box, second, 0};
    return node;
}

// Tests the triangles of leaves, of two siblings the nearer first, until `test(triangle)` returns
// false. `bound(box)` is the least that a triangle in a box can have; `isBeyond(bound)` says
// whether a box can be left out by now. Returns false if the query was cut.
template <class Bound, class Beyond, class Test>
bool TriangleTree::visit(const Bound& bound, const Beyond& isBeyond, const Test& test) const {
    struct Entry {
        uint32_t node;
        float least;
    };
    std::array<Entry, kMaxDepth> stack;
    int depth = 0;
    const auto push = [&](uint32_t node, float least) {
        if (!isBeyond(least))
            stack[size_t(depth++)] = {node, least};
    };
    if (!nodes_.empty())
        push(0, bound(nodes_[0].box));
    const uint32_t maxSteps = cost_.cutCount < kMaxLongCuts ? kMaxQuerySteps : kFewQuerySteps;
    uint32_t steps = 0;
    bool isOn = true;
    while (isOn && depth > 0 && steps < maxSteps) {
        const Entry entry = stack[size_t(--depth)];
        if (isBeyond(entry.least))
            continue;
        ++steps;
        const Node& node = nodes_[entry.node];
        if (node.count == 0) {
            const uint32_t first = entry.node + 1, second = node.first;
            const float toFirst = bound(nodes_[first].box), toSecond = bound(nodes_[second].box);
            const bool isFirstNearer = toFirst <= toSecond;
            push(isFirstNearer ? second : first, isFirstNearer ? toSecond : toFirst);
            push(isFirstNearer ? first : second, isFirstNearer ? toFirst : toSecond);
            continue;
        }
        steps += node.count;
        for (uint32_t k = node.first; isOn && k < node.first + node.count; ++k)
            isOn = test(items_[k]);
    }
    const bool isCut = isOn && depth > 0;
    cost_ += {1, steps, isCut ? 1u : 0u};
    return !isCut;
}

TriangleTree::Hit TriangleTree::trace(const glm::vec3& origin, const glm::vec3& direction,
                                      float reach) const {
    Hit best{reach, false};
    bool isHit = false;
    visit([&](const Box& box) { return enterBox(box, origin, direction); },
          [&](float enter) { return !(enter < kInfinity && enter * kSlack <= best.distance); },
          [&](uint32_t t) {
              bool isFrontFace = false;
              const float distance =
                  intersect(origin, direction, triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                            triangles_.vertex(t, 2), isFrontFace);
              if (distance < best.distance ||
                  (isHit && distance == best.distance && t < best.triangle)) {
                  best = {distance, isFrontFace, t};
                  isHit = true;
              }
              return true;
          });
    return isHit ? best : Hit{kInfinity, false};
}

bool TriangleTree::isBlocked(const glm::vec3& origin, const glm::vec3& direction,
                             float reach) const {
    bool isHit = false;
    const bool isWhole =
        visit([&](const Box& box) { return enterBox(box, origin, direction); },
              [&](float enter) { return !(enter < kInfinity && enter * kSlack <= reach); },
              [&](uint32_t t) {
                  bool isFrontFace = false;
                  isHit =
                      intersect(origin, direction, triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                                triangles_.vertex(t, 2), isFrontFace) < reach;
                  return !isHit;
              });
    return isHit || !isWhole;
}

float TriangleTree::distance(const glm::vec3& point, float limit) const {
    float best = limit * limit;
    visit([&](const Box& box) { return distanceSquared(box, point); },
          [&](float squared) { return !(squared * kSlack < best); },
          [&](uint32_t t) {
              best = std::min(best, distanceSquared(triangles_, t, point));
              return true;
          });
    return std::sqrt(best);
}

} // namespace shadowdag
