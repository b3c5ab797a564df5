// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/exact_sign.h"

#include <cmath>

namespace shadowdag {

namespace {

constexpr double kUnitRoundoff = 0x1p-53;

int signOf(double value) {
    return value > 0.0 ? 1 : value < 0.0 ? -1 : 0;
}

/// Returns the sign of the determinant without a filter.
int exactOrientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                     const glm::dvec3& d) {
    Expansion rows[3][3];
    const glm::dvec3* const points[] = {&a, &b, &c};
    for (int i = 0; i < 3; ++i)
        for (int axis = 0; axis < 3; ++axis)
            rows[i][axis] = Expansion((*points[i])[axis], d[axis]);
    Expansion determinant;
    for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3, last = (axis + 2) % 3;
        Expansion minor = rows[1][next] * rows[2][last];
        minor.add(rows[1][last] * rows[2][next], -1.0);
        determinant.add(rows[0][axis] * minor);
    }
    return determinant.sign();
}

} // namespace

void Expansion::add(double value) {
    std::vector<double> grown;
    grown.reserve(components_.size() + 1);
    double sum = value;
    for (const double component : components_) {
        const double next = sum + component; // TWO-SUM
        const double virtualComponent = next - sum;
        const double error = (sum - (next - virtualComponent)) + (component - virtualComponent);
        if (error != 0.0)
            grown.push_back(error);
        sum = next;
    }
    if (sum != 0.0)
        grown.push_back(sum);
    components_.swap(grown);
}

void Expansion::add(const Expansion& other, double sign) {
    for (const double component : other.components_)
        add(sign * component);
}

Expansion Expansion::operator*(const Expansion& other) const {
    Expansion product;
    for (const double x : components_)
        for (const double y : other.components_) {
            const double high = x * y; // TWO-PRODUCT
            product.add(std::fma(x, y, -high));
            product.add(high);
        }
    return product;
}

BoundedDeterminant boundedOrientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                      const glm::dvec3& d) {
    const glm::dvec3 u = a - d, v = b - d, w = c - d;
    double value = 0.0, permanent = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3, last = (axis + 2) % 3;
        const double first = v[next] * w[last], second = v[last] * w[next];
        value += u[axis] * (first - second);
        permanent += std::fabs(u[axis]) * (std::fabs(first) + std::fabs(second));
    }
    // Shewchuk's o3derrboundA is (7 + 56 e) e; 16 e also covers the other order of our sum.
    return {value, 16.0 * kUnitRoundoff * permanent};
}

int orientation(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                const glm::dvec3& d) {
    const BoundedDeterminant det = boundedOrientation(a, b, c, d);
    return std::fabs(det.value) > det.error ? signOf(det.value) : exactOrientation(a, b, c, d);
}

int orderAlong(const glm::dvec3& axis, const glm::dvec3& p, const glm::dvec3& q) {
    const glm::dvec3 way = p - q;
    double value = 0.0, magnitude = 0.0;
    for (int a = 0; a < 3; ++a) {
        value += axis[a] * way[a];
        magnitude += std::fabs(axis[a] * way[a]);
    }
    if (std::fabs(value) > 8.0 * kUnitRoundoff * magnitude)
        return signOf(value);
    Expansion sum;
    for (int a = 0; a < 3; ++a) {
        Expansion component;
        component.add(axis[a]);
        sum.add(component * Expansion(p[a], q[a]));
    }
    return sum.sign();
}

bool crossesTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3 (&triangle)[3]) {
    const glm::dvec3 &v0 = triangle[0], &v1 = triangle[1], &v2 = triangle[2];
    if (orientation(v0, v1, v2, a) * orientation(v0, v1, v2, b) >= 0)
        return false;
    const int sides[] = {orientation(a, b, v0, v1), orientation(a, b, v1, v2),
                         orientation(a, b, v2, v0)};
    bool isLeft = false, isRight = false;
    for (const int side : sides) {
        isLeft |= side > 0;
        isRight |= side < 0;
    }
    return !(isLeft && isRight);
}

bool isWithoutArea(const glm::dvec3 (&triangle)[3]) {
    const glm::dvec3 u = triangle[1] - triangle[0], v = triangle[2] - triangle[0];
    for (int axis = 0; axis < 3; ++axis) { // the components of the normal
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        const double first = u[b] * v[c], second = u[c] * v[b];
        if (std::fabs(first - second) >
            8.0 * kUnitRoundoff * (std::fabs(first) + std::fabs(second)))
            return false;
        Expansion exact =
            Expansion(triangle[1][b], triangle[0][b]) * Expansion(triangle[2][c], triangle[0][c]);
        exact.add(Expansion(triangle[1][c], triangle[0][c]) *
                      Expansion(triangle[2][b], triangle[0][b]),
                  -1.0);
        if (exact.sign() != 0)
            return false;
    }
    return true;
}

} // namespace shadowdag
