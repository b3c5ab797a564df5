// SPDX-License-Identifier: Apache-2.0
// A triangle's plane on a face, as 1/z over texels: rasterize.h. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

/// 32 times 2^-53: the relative error, in its factors, of an edge's or a plane's determinant.
SDAG_CONST double kDeterminantRounding = 32.0f / 9007199254740992.0f;
/// 1/z of a surface at the light; no depth is greater.
SDAG_CONST float kLargestInverseDepth = 3.0e38f;

/// Returns the largest magnitude of a coordinate.
SDAG_LEAF double largestOf(SDAG_IN(dvec3) p) {
    return greater(magnitude(p.x), greater(magnitude(p.y), magnitude(p.z)));
}

/// Returns whether a triangle has area as seen from the light, and its plane: n = (b - a) x (c -
/// a), 1/z = n.c / n.a, computed from differences, which keep precision for small distant
/// triangles.
/// @param a,b,c corners in the face's frame (faceFromLight)
/// @param plane 1/z = x X + y Y + z at the texel's X = 2 x + 1 - N, Y = 2 y + 1 - N; unset without
/// area
/// @param determinant n.a
SDAG_LEAF bool facePlane(SDAG_IN(dvec3) a, SDAG_IN(dvec3) b, SDAG_IN(dvec3) c, uint faceTexels,
                         SDAG_OUT(dvec3) plane, SDAG_OUT(double) determinant) {
    SDAG_EXACT dvec3 ab = b - a, ac = c - a;
    dvec3 normal = crossInOrder(ab, ac);
    double k = dotInOrder(normal, a);
    determinant = k;
    plane = dvec3(0.0f);
    SDAG_EXACT double rounding =
        kDeterminantRounding * largestOf(ab) * largestOf(ac) * largestOf(a);
    if (!(magnitude(k) > rounding))
        return false;
    SDAG_EXACT double scale = 1.0f / (k * double(faceTexels));
    SDAG_EXACT dvec3 w = dvec3(normal.x * scale, normal.y * scale, normal.z / k);
    plane = w;
    return true;
}

SDAG_LEAF_END
