// SPDX-License-Identifier: Apache-2.0
// The reference: closed overlap and intersection in integers of any length, hence without rounding.
// Slow and simple.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <glm/glm.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace shadowdag::exact {

using Int = boost::multiprecision::cpp_int;
using Point = std::array<Int, 3>;

inline Point operator-(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Int dot(const Point& a, const Point& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline int sign(const Int& v) {
    return v > 0 ? 1 : v < 0 ? -1 : 0;
}

/// Returns value * 2^shift, which must be an integer.
inline Int scaled(double value, int shift) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    Int result = static_cast<long long>(std::ldexp(mantissa, 53));
    const int up = exponent - 53 + shift;
    if (up >= 0)
        return result << up;
    const Int down = Int(1) << -up;
    if (result % down != 0)
        throw std::runtime_error("exact::scaled: not an integer at this scale");
    return result / down;
}

/// Returns a float point times 2^149 (every finite float is then an integer).
inline Point point(const glm::vec3& p, int shift = 149) {
    return {scaled(p.x, shift), scaled(p.y, shift), scaled(p.z, shift)};
}

/// Returns whether two convex hulls of points have a common point, given axes that suffice to
/// separate them.
inline bool overlapOnAxes(const std::vector<Point>& a, const std::vector<Point>& b,
                          const std::vector<Point>& axes) {
    for (const Point& axis : axes) {
        Int aMin, aMax, bMin, bMax;
        for (size_t i = 0; i < a.size(); ++i) {
            const Int d = dot(a[i], axis);
            aMin = i == 0 ? d : std::min(aMin, d);
            aMax = i == 0 ? d : std::max(aMax, d);
        }
        for (size_t i = 0; i < b.size(); ++i) {
            const Int d = dot(b[i], axis);
            bMin = i == 0 ? d : std::min(bMin, d);
            bMax = i == 0 ? d : std::max(bMax, d);
        }
        if (aMax < bMin || bMax < aMin)
            return false;
    }
    return true;
}

/// Returns whether the closed convex hull of one, two or three points (a segment or triangle,
/// however degenerate) meets the closed box: separating axes, all of them.
inline bool hullTouchesBox(const std::vector<Point>& hull, const Point& lo, const Point& hi) {
    std::vector<Point> box;
    for (int c = 0; c < 8; ++c)
        box.push_back({(c & 1) ? hi[0] : lo[0], (c & 2) ? hi[1] : lo[1], (c & 4) ? hi[2] : lo[2]});
    std::vector<Point> axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (size_t i = 0; i < hull.size(); ++i) {
        const Point edge = hull[(i + 1) % hull.size()] - hull[i];
        for (int a = 0; a < 3; ++a)
            axes.push_back(cross(edge, axes[a]));
    }
    if (hull.size() == 3)
        axes.push_back(cross(hull[1] - hull[0], hull[2] - hull[0]));
    return overlapOnAxes(hull, box, axes);
}

/// Returns whether three points lie on one line.
inline bool isDegenerate(const std::vector<Point>& triangle) {
    return cross(triangle[1] - triangle[0], triangle[2] - triangle[0]) == Point{0, 0, 0};
}

/// Returns whether the closed segment meets the closed triangle: separating axes of two flat convex
/// bodies.
inline bool segmentMeetsTriangle(const Point& p, const Point& q,
                                 const std::vector<Point>& triangle) {
    const Point way = q - p;
    const Point normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    std::vector<Point> axes{normal, cross(way, normal)};
    for (int i = 0; i < 3; ++i) {
        const Point edge = triangle[(i + 1) % 3] - triangle[i];
        axes.push_back(cross(edge, way));
        axes.push_back(cross(edge, normal));
    }
    if (way == Point{0, 0, 0} || normal == Point{0, 0, 0})
        throw std::runtime_error("exact::segmentMeetsTriangle: degenerate input");
    return overlapOnAxes({p, q}, triangle, axes);
}

} // namespace shadowdag::exact
