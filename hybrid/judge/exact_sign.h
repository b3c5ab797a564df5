// SPDX-License-Identifier: Apache-2.0
// Signs of determinants of doubles, never wrong: floating-point filters, and expansions where a
// filter cannot decide. Source: Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast
// Robust Geometric Predicates, Discrete & Computational Geometry 18, 1997. Part of the adjudicator
// (adjudicator.h), which shares no arithmetic with the methods or the truth.
//
// Exact unless a product overflows or underflows: magnitudes of coordinates of 1e18 at most, and
// differences of 1e-80 at least or 0.
#pragma once

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// A sum of doubles without rounding: components that do not overlap, ascending in magnitude.
class Expansion {
public:
    Expansion() = default;
    /// The difference a - b, exactly.
    Expansion(double a, double b) {
        add(a);
        add(-b);
    }

    /// Adds a double (GROW-EXPANSION with elimination of zeros).
    void add(double value);
    void add(const Expansion& other, double sign = 1.0);
    /// Returns the product, exactly.
    Expansion operator*(const Expansion& other) const;
    /// Returns -1, 0 or 1.
    int sign() const { return components_.empty() ? 0 : components_.back() > 0.0 ? 1 : -1; }

private:
    std::vector<double> components_;
};

/// A determinant in double with a bound on its error.
struct BoundedDeterminant {
    double value, error;
};

/// Returns det(a - d, b - d, c - d): six times the signed volume of the tetrahedron.
BoundedDeterminant boundedOrientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                      const glm::dvec3& d);
/// Returns its sign, exactly: 1, -1, or 0 where the four points lie in a plane.
int orientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d);

/// Returns the sign of dot(axis, p - q), exactly.
int orderAlong(const glm::dvec3& axis, const glm::dvec3& p, const glm::dvec3& q);

/// Returns whether the segment from a to b crosses the triangle, exactly. Its ends lie strictly on
/// both sides of the triangle's plane, and its line passes through the closed triangle: edges and
/// corners belong to it. So a segment in the plane, one that ends on the triangle, and a triangle
/// without area are no crossings.
bool crossesTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3 (&triangle)[3]);

/// Returns whether the corners of a triangle lie on one line, exactly.
bool isWithoutArea(const glm::dvec3 (&triangle)[3]);

} // namespace shadowdag
