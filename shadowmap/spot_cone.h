// SPDX-License-Identifier: Apache-2.0
// The part of a cube map that a spot light needs: the part of each face that its cone covers. A
// mask over the cube; everything else is as for other lights (Olsson et al. 2015 have omni lights
// only).
#pragma once

#include "shadowmap/cube_face.h"

#include <cmath>

namespace shadowdag {

/// The cone outside of which a spot light is dark; no cone by default.
struct SpotCone {
    glm::vec3 directionWorld{0.0f, 0.0f, -1.0f}; ///< unit
    float cosOuter = -1.0f;                      ///< of the half angle; <= 0: not narrowed

    bool operator==(const SpotCone&) const = default;
};

/// Returns whether the directions (u, 1) in the half plane z > 0 along one axis of a face that a
/// cone reaches are bounded by [lo, hi] (infinite where they are not); false: there are none.
///
/// Derivation. The planes through the light that hold the face's other axis are numbered by u = x /
/// z; the plane of u has the normal (1, -u) / sqrt(1 + u^2), and the cone (axis a, half angle with
/// sine s) meets it where |ax - u az| <= s sqrt(1 + u^2), that is
///     az > s: the cone lies in z > 0, and the interval is between the roots. az <= -s: it lies
///     behind. Otherwise it crosses z = 0: the interval is beyond the root on the side where ax
///     points, or unbounded when the cone contains the other axis (no root).
SDAG_HD inline bool coneSpan(double ax, double az, double s, double& lo, double& hi) {
    lo = -INFINITY;
    hi = INFINITY;
    if (az <= -s)
        return false;
    const double root2 = ax * ax + az * az - s * s, lead = az * az - s * s;
    if (root2 <= 0.0 || fabs(lead) < 1e-9)
        return true;
    const double root = s * sqrt(root2);
    const double a = (ax * az - root) / lead, b = (ax * az + root) / lead;
    if (lead > 0.0) {
        lo = a < b ? a : b;
        hi = a < b ? b : a;
    } else if (ax > 0.0) {
        lo = a < b ? b : a;
    } else {
        hi = a < b ? a : b;
    }
    return true;
}

/// Narrows the rectangle of receivers on a face, grown by `margin` (see filterMargin), to those
/// within the cone, grown by the same; returns false when none are. Conservative: uses the cone's
/// bounding rectangle. Cones of 90 degrees and more from their axis narrow nothing.
SDAG_HD inline bool narrowToCone(const SpotCone& cone, uint32_t face, float margin,
                                 FaceRect& rect) {
    if (!(cone.cosOuter > 0.0f))
        return true;
    const glm::dvec3 axis = faceFromLight(face, glm::dvec3(cone.directionWorld));
    const double length = glm::length(axis);
    // lightReaches compares floats: a little wider than they round.
    const double cosine = double(cone.cosOuter) - 1e-5;
    const double s = sqrt(1.0 - cosine * cosine);
    const double grow = double(margin) + 1e-4;
    double lo, hi;
    for (int i = 0; i < 2; ++i) {
        if (!coneSpan(axis[i] / length, axis.z / length, s, lo, hi))
            return false;
        float& least = i ? rect.vMin : rect.uMin;
        float& most = i ? rect.vMax : rect.uMax;
        least = float(glm::max(double(least), lo - grow));
        most = float(glm::min(double(most), hi + grow));
        if (least > most)
            return false;
    }
    return true;
}

} // namespace shadowdag
