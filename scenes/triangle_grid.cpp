// SPDX-License-Identifier: Apache-2.0
#include "scenes/triangle_grid.h"

#include <algorithm>
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

// Returns whether the plane of a triangle crosses the box: spares long diagonal triangles most of
// their cells.
bool planePasses(const Box& box, const glm::vec3& a, const glm::vec3& normal) {
    const glm::vec3 half = box.extent() * 0.5f;
    const float reach = glm::dot(glm::abs(normal), half);
    return std::fabs(glm::dot(normal, box.center() - a)) <= reach * 1.001f;
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

TriangleGrid::TriangleGrid(TriangleView triangles, const Box& bounds)
    : triangles_(triangles), bounds_(bounds) {
    const glm::vec3 extent = bounds.extent();
    const float longest =
        std::max({extent.x, extent.y, extent.z, std::numeric_limits<float>::min()});
    // Eight cells a triangle if they filled the volume; surfaces fill it less.
    float cellsPerAxis = 2.0f;
    while (cellsPerAxis < 256.0f &&
           cellsPerAxis * cellsPerAxis * cellsPerAxis < 8.0f * float(triangles.count()))
        cellsPerAxis *= 2.0f;
    for (int axis = 0; axis < 3; ++axis) {
        size_[axis] = std::max(1, int(std::ceil(extent[axis] / longest * cellsPerAxis)));
        cellExtent_[axis] = extent[axis] > 0.0f ? extent[axis] / float(size_[axis]) : longest;
    }
    const size_t cellCount = size_t(size_.x) * size_t(size_.y) * size_t(size_.z);
    cellStart_.assign(cellCount + 1, 0);
    // Twice over the triangles: count, then fill.
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t t = 0; t < triangles.count(); ++t) {
            const glm::vec3 a = triangles.vertex(t, 0), b = triangles.vertex(t, 1),
                            c = triangles.vertex(t, 2);
            Box box;
            box.add(a);
            box.add(b);
            box.add(c);
            const glm::vec3 normal = glm::cross(b - a, c - a);
            const glm::ivec3 low = cellOf(box.min), high = cellOf(box.max);
            glm::ivec3 cell;
            for (cell.z = low.z; cell.z <= high.z; ++cell.z)
                for (cell.y = low.y; cell.y <= high.y; ++cell.y)
                    for (cell.x = low.x; cell.x <= high.x; ++cell.x) {
                        Box cellBox;
                        cellBox.min = bounds_.min + glm::vec3(cell) * cellExtent_;
                        cellBox.max = cellBox.min + cellExtent_;
                        if (!planePasses(cellBox, a, normal))
                            continue;
                        if (pass == 0)
                            ++cellStart_[index(cell) + 1];
                        else
                            items_[cellStart_[index(cell)]++] = uint32_t(t);
                    }
        }
        if (pass == 0) {
            for (size_t i = 0; i < cellCount; ++i)
                cellStart_[i + 1] += cellStart_[i];
            items_.resize(cellStart_[cellCount]);
        }
    }
    // Filling moved every start to its end, which is the next start.
    for (size_t i = cellCount; i > 0; --i)
        cellStart_[i] = cellStart_[i - 1];
    cellStart_[0] = 0;
}

glm::ivec3 TriangleGrid::cellOf(const glm::vec3& p) const {
    glm::ivec3 cell;
    for (int axis = 0; axis < 3; ++axis) {
        const float c = (p[axis] - bounds_.min[axis]) / cellExtent_[axis];
        cell[axis] = int(std::clamp(c, 0.0f, float(size_[axis] - 1)));
    }
    return cell;
}

TriangleGrid::Hit TriangleGrid::trace(const glm::vec3& origin, const glm::vec3& direction) const {
    // Where the ray enters the bounds.
    float enter = 0.0f, leave = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0.0f) {
            if (origin[axis] < bounds_.min[axis] || origin[axis] > bounds_.max[axis])
                return {kInfinity, false};
            continue;
        }
        float t0 = (bounds_.min[axis] - origin[axis]) / direction[axis];
        float t1 = (bounds_.max[axis] - origin[axis]) / direction[axis];
        if (t0 > t1)
            std::swap(t0, t1);
        enter = std::max(enter, t0);
        leave = std::min(leave, t1);
    }
    if (enter > leave)
        return {kInfinity, false};
    // Amanatides and Woo, A Fast Voxel Traversal Algorithm, 1987.
    glm::ivec3 cell = cellOf(origin + direction * enter);
    glm::ivec3 step;
    glm::vec3 next, delta;
    for (int axis = 0; axis < 3; ++axis) {
        step[axis] = direction[axis] > 0.0f ? 1 : -1;
        if (direction[axis] == 0.0f) {
            next[axis] = delta[axis] = kInfinity;
        } else {
            const float border = bounds_.min[axis] +
                                 float(cell[axis] + (step[axis] > 0 ? 1 : 0)) * cellExtent_[axis];
            next[axis] = (border - origin[axis]) / direction[axis];
            delta[axis] = cellExtent_[axis] / std::fabs(direction[axis]);
        }
    }
    Hit best{kInfinity, false};
    for (;;) {
        const int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
        const size_t i = index(cell);
        for (uint32_t k = cellStart_[i]; k < cellStart_[i + 1]; ++k) {
            const uint32_t t = items_[k];
            bool isFrontFace = false;
            const float distance =
                intersect(origin, direction, triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                          triangles_.vertex(t, 2), isFrontFace);
            if (distance < best.distance)
                best = {distance, isFrontFace, t};
        }
        if (best.distance <= next[axis])
            return best;
        cell[axis] += step[axis];
        if (cell[axis] < 0 || cell[axis] >= size_[axis])
            return best;
        next[axis] += delta[axis];
    }
}

float TriangleGrid::distance(const glm::vec3& point, float limit) const {
    const glm::ivec3 low = cellOf(point - glm::vec3(limit)),
                     high = cellOf(point + glm::vec3(limit));
    float best = limit * limit;
    glm::ivec3 cell;
    for (cell.z = low.z; cell.z <= high.z; ++cell.z)
        for (cell.y = low.y; cell.y <= high.y; ++cell.y)
            for (cell.x = low.x; cell.x <= high.x; ++cell.x) {
                const size_t i = index(cell);
                for (uint32_t k = cellStart_[i]; k < cellStart_[i + 1]; ++k) {
                    const uint32_t t = items_[k];
                    const glm::vec3 d =
                        point - closestPoint(point, triangles_.vertex(t, 0),
                                             triangles_.vertex(t, 1), triangles_.vertex(t, 2));
                    best = std::min(best, glm::dot(d, d));
                }
            }
    return std::sqrt(best);
}

} // namespace shadowdag
