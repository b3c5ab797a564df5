// SPDX-License-Identifier: Apache-2.0
// The six faces of a cube map, their frames and their texels. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

SDAG_CONST uint kFaceCount = 6u;
/// An entry of a page table without a page.
SDAG_CONST uint kNoPage = 0xffffffffu;
/// The one face of a directional light's map: its frame is (u axis, v axis, depth) itself.
SDAG_CONST uint kDirectionalFace = 4u;

/// faceFromLight returns a light-relative vector in the frame of a face: (u axis, v axis, depth).
/// Face 2 a looks along +axis a and face 2 a + 1 along -axis a; u runs along axis a + 1 and v along
/// axis a + 2, modulo 3, on both. Half of the faces are therefore mirrored. This has no effect,
/// because both sides of a triangle block. lightFromFace inverts it.
#define SDAG_FACE_FRAMES(Vec)                                                                      \
    SDAG_LEAF Vec faceFromLight(uint face, SDAG_IN(Vec) p) {                                       \
        Vec q = face < 2u ? Vec(p.y, p.z, p.x) : face < 4u ? Vec(p.z, p.x, p.y) : p;               \
        return (face & 1u) != 0u ? Vec(q.x, q.y, -q.z) : q;                                        \
    }                                                                                              \
    SDAG_LEAF Vec lightFromFace(uint face, SDAG_IN(Vec) q) {                                       \
        Vec p = (face & 1u) != 0u ? Vec(q.x, q.y, -q.z) : q;                                       \
        return face < 2u ? Vec(p.z, p.x, p.y) : face < 4u ? Vec(p.y, p.z, p.x) : p;                \
    }
SDAG_FACE_FRAMES(vec3)
SDAG_FACE_FRAMES(dvec3)
#undef SDAG_FACE_FRAMES

/// Returns the face that a direction points through: the axis of largest magnitude, x before y
/// before z when equal, so every direction belongs to one face.
SDAG_LEAF uint faceOf(SDAG_IN(vec3) d) {
    vec3 a = magnitude(d);
    if (a.x >= a.y && a.x >= a.z)
        return d.x < 0.0f ? 1u : 0u;
    if (a.y >= a.z)
        return d.y < 0.0f ? 3u : 2u;
    return d.z < 0.0f ? 5u : 4u;
}

/// Returns the texel (or page, or cell) that contains face coordinate u in [-1, 1] when `count` of
/// them divide the face; clamped. Half open: a border belongs to the upper one. Monotone in u, on
/// which the conservative masks rely.
SDAG_LEAF uint faceCell(float u, uint count) {
    SDAG_EXACT float s = (u + 1.0f) * (0.5f * float(count));
    if (!(s > 0.0f)) // NaN as well
        return 0u;
    uint cell = s < float(count) ? uint(s) : count - 1u;
    return cell < count ? cell : count - 1u;
}

/// Returns the face coordinate of a texel's centre.
SDAG_LEAF float faceCellCentre(int cell, uint count) {
    return quotient(float(2 * cell + 1 - int(count)), float(count));
}

/// A texel of a map.
struct CubeTexel {
    uint face, x, y;
};

SDAG_LEAF CubeTexel cubeTexel(uint face, uint x, uint y) {
    CubeTexel texel;
    texel.face = face;
    texel.x = x;
    texel.y = y;
    return texel;
}

/// Returns the texel of column x and row y of a face, both possibly outside of the face by less
/// than its side. Such a direction belongs to a neighbour face; the texel of that face is returned.
SDAG_LEAF CubeTexel wrapTexel(uint face, int x, int y, uint faceTexels) {
    int n = int(faceTexels);
    if (x >= 0 && x < n && y >= 0 && y < n)
        return cubeTexel(face, uint(x), uint(y));
    vec3 d = lightFromFace(
        face, vec3(faceCellCentre(x, faceTexels), faceCellCentre(y, faceTexels), 1.0f));
    uint neighbour = faceOf(d);
    vec3 q = faceFromLight(neighbour, d);
    return cubeTexel(neighbour, faceCell(quotient(q.x, q.z), faceTexels),
                     faceCell(quotient(q.y, q.z), faceTexels));
}

/// Returns the page-table index of page (x, y) of a face: faces one after the other, rows of v, u
/// fastest. @param start the map's first entry @param facePages side of a face in pages
SDAG_LEAF uint pageTableIndexOf(uint start, uint facePages, uint face, uint x, uint y) {
    return start + (face * facePages + y) * facePages + x;
}

/// Returns the index of texel (x, y) of a face in its page: rows of v, u fastest.
SDAG_LEAF uint texelInPage(uint x, uint y, uint pageTexelsLog2) {
    uint inPage = (1u << pageTexelsLog2) - 1u;
    return ((y & inPage) << pageTexelsLog2) + (x & inPage);
}

/// Returns a world point in a directional light's window: component i is dot(row i, point) - offset
/// i.
SDAG_LEAF dvec3 windowPoint(SDAG_IN(dvec3) u, SDAG_IN(dvec3) v, SDAG_IN(dvec3) w,
                            SDAG_IN(dvec3) offsets, SDAG_IN(dvec3) p) {
    SDAG_EXACT dvec3 q = dvec3(dotInOrder(u, p) - offsets.x, dotInOrder(v, p) - offsets.y,
                               dotInOrder(w, p) - offsets.z);
    return q;
}

/// Returns the point whose projection in a window's map is that of a light-relative point in a cube
/// map's face.
/// @param q in the window
SDAG_LEAF dvec3 lightFromWindow(SDAG_IN(dvec3) q) {
    SDAG_EXACT double z = 1.0f / q.z;
    SDAG_EXACT dvec3 p = dvec3(q.x * z, q.y * z, z);
    return p;
}

/// 2^-20: surfaces nearer to the light than this part of its range do not block.
SDAG_CONST double kNearPerRange = 1.0f / 1048576.0f;

/// Returns the depth along a face's axis below which surfaces do not block.
SDAG_LEAF double nearDepthOf(bool isDirectional, float rangeWorld) {
    SDAG_EXACT double depth = double(rangeWorld) * kNearPerRange;
    return isDirectional ? kNearPerRange : depth;
}

SDAG_LEAF_END
