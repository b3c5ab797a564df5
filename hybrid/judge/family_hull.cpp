// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/family_hull.h"

#include "hybrid/judge/exact_sign.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

bool FamilyHull::isSeparatedAlong(const glm::dvec3& axis,
                                  std::span<const glm::dvec3> points) const {
    // In double, relative to the first point: a term is off by three roundings.
    const glm::dvec3 size = glm::abs(axis);
    double least = 0, most = 0, magnitude = 0;
    for (const glm::dvec3& p : points) {
        const glm::dvec3 from = p - points[0];
        const double along = glm::dot(axis, from);
        least = std::min(least, along);
        most = std::max(most, along);
        magnitude = std::max(magnitude, glm::dot(size, glm::abs(from)));
    }
    double hullLeast = std::numeric_limits<double>::infinity(), hullMost = -hullLeast;
    for (const PointBox* box : {&start_, &end_}) {
        const glm::dvec3 low = box->low - points[0], high = box->high - points[0];
        double boxLeast = 0, boxMost = 0;
        for (int a = 0; a < 3; ++a) {
            boxLeast += axis[a] * (axis[a] > 0.0 ? low : high)[a];
            boxMost += axis[a] * (axis[a] > 0.0 ? high : low)[a];
        }
        hullLeast = std::min(hullLeast, boxLeast);
        hullMost = std::max(hullMost, boxMost);
        magnitude = std::max(magnitude, glm::dot(size, glm::max(glm::abs(low), glm::abs(high))));
    }
    const double gap = std::max(hullLeast - most, least - hullMost);
    const double error = 0x1p-49 * magnitude;
    if (gap > error)
        return true;
    if (!(gap > -error))
        return false;
    const auto isAllOnSide = [&](int side) {
        for (const glm::dvec3& p : points)
            for (const PointBox* box : {&start_, &end_})
                for (int corner = 0; corner < 8; ++corner)
                    if (orderAlong(axis, box->corner(corner), p) != side)
                        return false;
        return true;
    };
    return isAllOnSide(1) || isAllOnSide(-1);
}

bool FamilyHull::misses(std::span<const glm::dvec3> points) const {
    static const glm::dvec3 kAxes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const glm::dvec3& axis : kAxes)
        if (isSeparatedAlong(axis, points))
            return true;
    if (points.size() == 3) {
        const glm::dvec3 normal = glm::cross(points[1] - points[0], points[2] - points[0]);
        if (isSeparatedAlong(normal, points))
            return true;
    }
    const size_t edgeCount = points.size() == 3 ? 3 : points.size() - 1;
    for (size_t i = 0; i < edgeCount; ++i)
        if (isSeparatedAlong(glm::cross(points[(i + 1) % points.size()] - points[i], way_), points))
            return true;
    for (const glm::dvec3& axis : kAxes)
        if (isSeparatedAlong(glm::cross(way_, axis), points))
            return true;
    for (size_t i = 0; i < edgeCount; ++i)
        for (const glm::dvec3& axis : kAxes)
            if (isSeparatedAlong(glm::cross(points[(i + 1) % points.size()] - points[i], axis),
                                 points))
                return true;
    return false;
}

} // namespace shadowdag
