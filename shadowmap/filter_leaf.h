// SPDX-License-Identifier: Apache-2.0
// The comparison of a receiver with the texels of its map: the planes of a receiver of a cube map
// and of a directional light's window, the taps and their weights. shadow_map_lookup.h and
// directional_filter.h explain them. A leaf text (gl/leaf.h).
#pragma once

#include "shadowmap/cube_face_leaf.h"

SDAG_LEAF_BEGIN

/// A tap whose ray meets the receiver's plane more than this many texels before the receiver tests
/// another place and is omitted (see lookupVisibility). Measured in FILTERS.md.
SDAG_CONST float kLowTapTexels = 6.0f;
/// Limit with which no tap of a directional light's window is omitted: more than any depth.
SDAG_CONST float kNoLowTap = 1e30f;

/// The result of a tap.
SDAG_CONST uint kTapLit = 0u, kTapDark = 1u, kTapMissing = 2u;

/// For a surface at grazing light the lift by a level of detail would be unbounded: the sine of the
/// light's height is taken as at least this (3.6 degrees).
SDAG_CONST float kLeastFacingOfLevels = 1.0f / 16.0f;
/// The same for the lift by rounding.
SDAG_CONST double kLeastFacing = 1.0f / 1024.0f;
/// 2^-22 of a position: its rounding error.
SDAG_CONST float kPlaceRounding = 1.0f / 4194304.0f;
/// 2^-20 of a vector from the light: the rounding error of the comparison.
SDAG_CONST float kWayRounding = 1.0f / 1048576.0f;
/// 2^-22: two halves of an ulp of a window's depth, and again.
SDAG_CONST float kDepthRounding = 1.0f / 4194304.0f;

/// Returns the filter's side in texels.
SDAG_LEAF uint filterSide(uint taps) {
    return taps >= 9u ? 3u : taps >= 4u ? 2u : 1u;
}

/// Returns the sum of a filter's weights. @param side of the filter
SDAG_LEAF float filterTotal(int side) {
    return side == 3 ? 4.0f : 1.0f;
}

/// Returns the weight of tap i of `side` along one axis, from the position within the texel.
SDAG_LEAF float tapWeight(int side, int i, float f) {
    return side == 1 || i + i + 1 == side ? 1.0f : i == 0 ? 1.0f - f : f;
}

/// Changes the texel that holds the receiver into the filter's first one, and the position in it
/// into that in the texel (3 x 3) or between the centres around it (2 x 2).
SDAG_LEAF void moveToFirstTap(int side, SDAG_INOUT(int) texel, SDAG_INOUT(float) f) {
    if (side == 3) {
        --texel;
    } else if (side == 2) {
        int before = f < 0.5f ? 1 : 0;
        texel -= before;
        f += float(before) - 0.5f;
    }
}

/// Returns whether the taps that were not omitted give a result, 255 lit .. 0 dark. If all were
/// omitted (taps snapped to the texels of a neighbour face), they are tested again with none
/// omitted.
SDAG_LEAF bool endsFilter(float lit, float leftOut, float total, SDAG_OUT(uint) visibility) {
    visibility = 0u;
    SDAG_EXACT float most = 0.99f * total, counted = total - leftOut;
    if (leftOut != 0.0f && !(leftOut < most))
        return false;
    SDAG_EXACT float value = lit * quotient(255.0f, counted) + 0.5f;
    visibility = uint(value);
    return true;
}

/// A receiver of a cube map. Planes are linear forms of (u, v, 1) in a face's frame, and their
/// values 1/z.
struct CubeReceiver {
    uint face;        ///< that holds it
    int side, x0, y0; ///< of the filter, and its first texel
    float fx, fy;     ///< position in it
    bool isInFace;    ///< every tap lies in the face
    vec3 own, across; ///< the receiver's plane, and that perpendicular to the ray; world axes
    float rTexels;    ///< 1 / texels of a face
    float low;        ///< limit beyond which a tap meets the plane too early; 0: none does
};

/// Returns a receiver. @param d the receiver less the light, not 0 @param dd d.d @param lodTexels
/// ShadowMapInfo's; the rest as lookupVisibility has them
SDAG_LEAF CubeReceiver makeCubeReceiver(SDAG_IN(vec3) d, float dd, SDAG_IN(vec3) positionWorld,
                                        SDAG_IN(vec3) normalWorld, uint faceTexels, float lodTexels,
                                        float constantTexels, uint taps) {
    CubeReceiver r;
    int end = int(faceTexels);
    float n = float(faceTexels);
    r.rTexels = quotient(1.0f, n);
    r.face = faceOf(d);
    vec3 q = faceFromLight(r.face, d);
    float rDepth = quotient(1.0f, q.z);
    SDAG_EXACT float sx = lesser(greater((q.x * rDepth + 1.0f) * (0.5f * n), 0.0f), n);
    SDAG_EXACT float sy = lesser(greater((q.y * rDepth + 1.0f) * (0.5f * n), 0.0f), n);

    vec3 place = magnitude(positionWorld), way = magnitude(d);
    SDAG_EXACT float rounding = kPlaceRounding * greater(place.x, greater(place.y, place.z)) +
                                kWayRounding * greater(way.x, greater(way.y, way.z));
    SDAG_EXACT float height = -dotInOrder(normalWorld, d);
    bool faces = height > 0.0f;
    SDAG_EXACT float near = 1.0f - lesser(quotient(2.0f * constantTexels, n), 0.5f);
    float forgiven = quotient(1.0f, near);
    SDAG_EXACT float exact = greater(height - rounding, 0.5f * height);
    SDAG_EXACT float lifted = exact;
    if (lodTexels > 0.0f && faces)
        lifted = greater(exact - 2.0f * lodTexels * q.z * r.rTexels, 0.5f * exact);
    float rHeight = faces ? quotient(forgiven, lifted) : 0.0f;
    SDAG_EXACT float apart = dd * (1.0f - lesser(rounding * rDepth + kWayRounding, 0.5f));
    float rAcross = quotient(forgiven, apart);
    SDAG_EXACT vec3 own = faces ? normalWorld * -rHeight : vec3(0.0f);
    SDAG_EXACT vec3 across = d * rAcross;
    r.own = own;
    r.across = across;

    r.side = int(filterSide(taps));
    r.x0 = int(sx) < end ? int(sx) : end - 1;
    r.y0 = int(sy) < end ? int(sy) : end - 1;
    r.fx = sx - float(r.x0);
    r.fy = sy - float(r.y0);
    moveToFirstTap(r.side, r.x0, r.fx);
    moveToFirstTap(r.side, r.y0, r.fy);
    r.isInFace = r.x0 >= 0 && r.y0 >= 0 && r.x0 + r.side <= end && r.y0 + r.side <= end;
    SDAG_EXACT float low =
        r.side > 1 ? greater(1.0f - 2.0f * kLowTapTexels * r.rTexels, 0.0f) : 0.0f;
    if (lifted < exact)
        low *= quotient(lifted, exact); // ends are those on the receiver's own plane
    r.low = low;
    return r;
}

/// Returns the centre of texel column or row `texel` in coordinates of the face.
SDAG_LEAF float tapCentre(SDAG_IN(CubeReceiver) r, uint texel, uint faceTexels) {
    SDAG_EXACT float u = float(2 * int(texel) + 1 - int(faceTexels)) * r.rTexels;
    return u;
}

/// Returns the 1/z above which a surface blocks the tap at (u, v). @param own,across the receiver's
/// planes in the frame of the tap's face @param isLow whether the tap tests another place
SDAG_LEAF float cubeTapLimit(SDAG_IN(vec3) own, SDAG_IN(vec3) across, float u, float v, float low,
                             SDAG_OUT(bool) isLow) {
    SDAG_EXACT float ownHere = own.x * u + own.y * v + own.z;
    SDAG_EXACT float acrossHere = across.x * u + across.y * v + across.z;
    SDAG_EXACT float lowest = ownHere * low;
    isLow = low > 0.0f && lowest > acrossHere;
    return greater(ownHere, acrossHere);
}

/// A receiver in a directional light's window, prepared for the filter's taps: positions in texels,
/// depths as w relative to the receiver's. Derived in directional_filter.h.
struct DirectionalReceiver {
    double x, y; ///< position in texels
    float w;     ///< depth
    float slopeX,
        slopeY;        ///< of the receiver's plane: w per texel; 0 when it does not face the light
    float own, across; ///< lift of the plane and of the depth
    float forgiven;    ///< bias: only blockers farther than this count
    float texelDepth;  ///< w per texel
    bool isValid;      ///< the position is a number
};

/// Returns the receiver. @param q its position in the window @param u,v,w the window's rows; the
/// rest as makeCubeReceiver has them
SDAG_LEAF DirectionalReceiver makeWindowReceiver(SDAG_IN(dvec3) q, SDAG_IN(dvec3) u,
                                                 SDAG_IN(dvec3) v, SDAG_IN(dvec3) w,
                                                 SDAG_IN(vec3) lightPositionWorld, float rangeWorld,
                                                 uint faceTexels, float lodTexels,
                                                 SDAG_IN(vec3) positionWorld,
                                                 SDAG_IN(vec3) normalWorld, float constantTexels) {
    DirectionalReceiver r;
    SDAG_EXACT double halfSide = 0.5f * double(faceTexels);
    double perWorld = squareRoot(dotInOrder(w, w)); // |W|
    double perWindow = squareRoot(dotInOrder(u, u));
    SDAG_EXACT double texel = 1.0f / (perWindow * halfSide);
    r.isValid = q.x == q.x && q.y == q.y && q.z == q.z;
    SDAG_EXACT double x = (q.x + 1.0f) * halfSide, y = (q.y + 1.0f) * halfSide;
    r.x = x;
    r.y = y;
    r.w = float(q.z);
    SDAG_EXACT double texelDepth = texel * perWorld;
    r.texelDepth = float(texelDepth);
    SDAG_EXACT float forgiven = constantTexels * r.texelDepth;
    r.forgiven = forgiven;
    SDAG_EXACT vec3 largest = magnitude(positionWorld) + magnitude(lightPositionWorld);
    SDAG_EXACT double rounding =
        double(kWayRounding) *
        (double(greater(largest.x, greater(largest.y, largest.z))) + double(rangeWorld)) * perWorld;
    SDAG_EXACT float across = float(rounding) + kDepthRounding;
    r.across = across;
    dvec3 n = dvec3(normalWorld);
    SDAG_EXACT double facing = dotInOrder(n, w) / perWorld;
    bool faces = facing > 0.0f;
    SDAG_EXACT double steep = faces ? -texel * perWorld / (facing * perWindow) : double(0.0f);
    SDAG_EXACT double slopeX = steep * dotInOrder(n, u), slopeY = steep * dotInOrder(n, v);
    r.slopeX = float(slopeX);
    r.slopeY = float(slopeY);
    SDAG_EXACT double lift = rounding / greater(facing, kLeastFacing);
    SDAG_EXACT float own = faces ? float(lift) + kDepthRounding : across;
    if (faces && lodTexels > 0.0f)
        own += quotient(lodTexels * r.texelDepth, greater(float(facing), kLeastFacingOfLevels));
    r.own = own;
    return r;
}

/// Returns the texel of a window that contains position x, and the position in it. The double keeps
/// its fraction at large coordinates, too.
SDAG_LEAF int windowTexel(double x, int end, SDAG_OUT(float) f) {
    double inside = lesser(greater(x, double(0.0f)), double(end));
    int texel = int(inside) < end ? int(inside) : end - 1;
    SDAG_EXACT double rest = inside - double(texel);
    f = float(rest);
    return texel;
}

/// Returns the depth above which a surface blocks tap (x, y) of the window.
/// @param isLow whether the tap tests another place
SDAG_LEAF float windowTapLimit(SDAG_IN(DirectionalReceiver) r, int x, int y, float low,
                               SDAG_OUT(bool) isLow) {
    SDAG_EXACT double toX = double(x) + 0.5f - r.x, toY = double(y) + 0.5f - r.y;
    SDAG_EXACT float own = r.slopeX * float(toX) + r.slopeY * float(toY);
    isLow = own > low;
    SDAG_EXACT float limit = greater(own + r.own, r.across) + r.forgiven;
    SDAG_EXACT float compared = r.w + limit;
    return compared;
}

SDAG_LEAF_END
