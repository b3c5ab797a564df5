// SPDX-License-Identifier: Apache-2.0
// Rays against what moves: mover_rays.h and, for the ray itself and the triangle's test, truth_ray.h,
// all in double. Part of shade.comp.
#include "scenes/alpha_mask.glsl"

layout(std430, binding = SDAG_POSITIONS_BINDING) readonly buffer Positions { float positions[]; };
layout(std430, binding = SDAG_TRIANGLES_BINDING) readonly buffer Triangles { uint triangles[]; };
layout(std430, binding = SDAG_MOVERS_BINDING) readonly buffer MoverWords { uint moverWords[]; };
uniform uint hasMovers;
uniform dvec3 truthOrigin;
uniform double truthDiagonal;

// Heads of moverWords (movers_gl.h): where what starts.
const uint kLevelCount = SDAG_HEAD_LEVEL_COUNT, kBoxes = SDAG_HEAD_BOXES, kItems = SDAG_HEAD_ITEMS,
           kNearLight = SDAG_HEAD_NEAR_LIGHT, kMaskWords = SDAG_HEAD_MASK_WORDS,
           kLevelStart = SDAG_HEAD_LEVEL_START;
const uint kBvhWidth = SDAG_BVH_WIDTH, kMaxLevels = SDAG_BVH_LEVELS, kNone = SDAG_NOT_CUT;
const double kUnit = 5.9604644775390625e-8LF;

struct TruthRay {
    vec3 start; // local
    vec3 way;
    float tFar;
    uint receiver;
};

uint maskWord(uint index) { return moverWords[moverWords[kMaskWords] + index]; }

float moverFloat(uint at) { return uintBitsToFloat(moverWords[at]); }

bool mayShadow(uint light) { return hasMovers != 0u && moverWords[moverWords[kNearLight] + light] != 0u; }

dvec3 vertexLocal(uint triangle, uint corner) {
    uint at = 3u * triangles[3u * triangle + corner];
    precise dvec3 p = dvec3(positions[at], positions[at + 1u], positions[at + 2u]) - truthOrigin;
    return p;
}

double lengthOf(dvec3 v) { return sqrt(dotInOrder(v, v)); }

dvec3 unit(dvec3 v) {
    precise dvec3 u = v * (1.0LF / sqrt(dotInOrder(v, v)));
    return u;
}

float nextTowards(float x, bool isUp) {
    if (x == 0.0)
        return uintBitsToFloat(isUp ? 1u : 0x80000001u);
    uint bits = floatBitsToUint(x);
    return uintBitsToFloat((x > 0.0) == isUp ? bits + 1u : bits - 1u);
}

// The point moved within the receiver's plane until it is c inside all edges.
dvec3 moveInside(dvec3 corner[3], dvec3 inward[3], double inwardOffset[3], double c, dvec3 sampleLocal) {
    precise dvec3 p = sampleLocal;
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < 3; ++i)
            p += inward[i] * max(c - (dotInOrder(inward[i], p) - inwardOffset[i]), 0.0LF);
    precise double slack = 0.001LF * c;
    bool isInside = true;
    for (int i = 0; i < 3; ++i)
        isInside = isInside && dotInOrder(inward[i], p) - inwardOffset[i] >= c - slack;
    if (isInside)
        return p;
    dvec3 side;
    for (int i = 0; i < 3; ++i)
        side[i] = lengthOf(corner[(i + 2) % 3] - corner[(i + 1) % 3]);
    precise dvec3 incentre =
        (side[0] * corner[0] + side[1] * corner[1] + side[2] * corner[2]) / (side[0] + side[1] + side[2]);
    int nearest = 0;
    for (int i = 1; i < 3; ++i)
        if (lengthOf(corner[i] - p) < lengthOf(corner[nearest] - p))
            nearest = i;
    precise double inradius = dotInOrder(inward[0], incentre) - inwardOffset[0];
    precise dvec3 moved = corner[nearest] + (incentre - corner[nearest]) * (inradius > c ? c / inradius : 1.0LF);
    return moved;
}

TruthRay truthPairRay(vec3 point, vec3 normalWorld, uint triangle, vec3 lightWorld) {
    precise dvec3 sampleLocal = dvec3(point) - truthOrigin;
    dvec3 corner[3];
    double largest = 0.0LF;
    for (int a = 0; a < 3; ++a)
        largest = max(largest, abs(sampleLocal[a] + truthOrigin[a]));
    for (uint i = 0u; i < 3u; ++i) {
        corner[i] = vertexLocal(triangle, i);
        for (int a = 0; a < 3; ++a)
            largest = max(largest, abs(corner[i][a] + truthOrigin[a]));
    }
    precise double c = 4.0LF * kUnit * largest + 16.0LF * kUnit * truthDiagonal;
    dvec3 normal = unit(dvec3(normalWorld));
    double offset = dotInOrder(normal, sampleLocal);
    precise dvec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0];
    dvec3 across = crossInOrder(ab, ac);
    double area = lengthOf(across);
    precise dvec3 p = sampleLocal;
    if (area > 0.0LF) {
        normal = dotInOrder(across, normal) < 0.0LF ? across / -area : across / area;
        offset = dotInOrder(normal, corner[0]);
        dvec3 inward[3];
        double inwardOffset[3];
        for (int i = 0; i < 3; ++i) {
            precise dvec3 edge = corner[(i + 1) % 3] - corner[i];
            inward[i] = unit(crossInOrder(across, edge));
            inwardOffset[i] = dotInOrder(inward[i], corner[i]);
        }
        p = moveInside(corner, inward, inwardOffset, c, sampleLocal);
    }
    // Off the plane: along the normal, then one axis in steps of a float until the height is kept.
    p += normal * max(c - (dotInOrder(normal, p) - offset), 0.0LF);
    vec3 start = vec3(p);
    dvec3 size = abs(normal);
    int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    bool isUp = normal[axis] > 0.0LF;
    for (int s = 0; s < 8 && dotInOrder(normal, dvec3(start)) - offset < c; ++s)
        start[axis] = nextTowards(start[axis], isUp);

    precise dvec3 light = dvec3(lightWorld) - truthOrigin;
    precise double missing = c - (dotInOrder(normal, light) - offset);
    light += normal * (missing < 0.0LF ? 0.0LF : missing);
    precise dvec3 way = light - dvec3(start);
    TruthRay ray;
    ray.start = start;
    ray.way = vec3(way);
    ray.tFar = lengthOf(dvec3(ray.way)) > c ? float(1.0LF - 16.0LF * kUnit) : 0.0;
    ray.receiver = triangle;
    return ray;
}

// @param cutAt where the triangle's cut stands in moverWords, kNone: a mask cuts nothing out of it
bool blocksTruthRay(TruthRay ray, uint triangle, uint cutAt) {
    dvec3 start = dvec3(ray.start), way = dvec3(ray.way);
    dvec3 v0 = vertexLocal(triangle, 0u), v1 = vertexLocal(triangle, 1u), v2 = vertexLocal(triangle, 2u);
    precise dvec3 a = v0 - start, b = v1 - start, c = v2 - start;
    double ab = dotInOrder(way, crossInOrder(a, b)), bc = dotInOrder(way, crossInOrder(b, c));
    if ((ab < 0.0LF && bc > 0.0LF) || (ab > 0.0LF && bc < 0.0LF))
        return false;
    double ca = dotInOrder(way, crossInOrder(c, a));
    if ((ca < 0.0LF && (ab > 0.0LF || bc > 0.0LF)) || (ca > 0.0LF && (ab < 0.0LF || bc < 0.0LF)))
        return false;
    if (triangle == ray.receiver)
        return false;
    precise dvec3 side1 = v1 - v0, side2 = v2 - v0, fromStart = v0 - start;
    dvec3 normal = crossInOrder(side1, side2);
    double along = dotInOrder(normal, way);
    if (along == 0.0LF)
        return false;
    precise double t = dotInOrder(normal, fromStart) / along;
    if (!(t > 0.0LF && t < double(ray.tFar)))
        return false;
    if (cutAt == kNone)
        return true;
    CutTriangle cut = CutTriangle(0u, moverFloat(cutAt + 5u), moverFloat(cutAt + 6u), moverFloat(cutAt + 7u),
                                  moverFloat(cutAt + 8u), moverFloat(cutAt + 9u), moverFloat(cutAt + 10u));
    MaskInfo info = MaskInfo(moverWords[cutAt], moverWords[cutAt + 1u], moverWords[cutAt + 2u],
                             moverWords[cutAt + 3u], moverWords[cutAt + 4u]);
    return isOpaqueAt(cut, info, dvec3(bc, ca, ab));
}

bool isDarkByMovers(TruthRay ray) {
    if (!(ray.tFar > 0.0))
        return false;
    precise dvec3 from = dvec3(ray.start) + truthOrigin;
    precise dvec3 to = from + dvec3(ray.way);
    dvec3 inverse;
    double largest = 0.0LF;
    for (int a = 0; a < 3; ++a) {
        precise double way = to[a] - from[a];
        inverse[a] = abs(way) > 1e-250LF ? 1.0LF / way : 1e250LF;
        largest = max(largest, max(abs(from[a]), abs(to[a])));
    }
    double slack = largest * 5.684341886080802e-14LF;
    uint levelCount = moverWords[kLevelCount];
    if (levelCount == 0u)
        return false;
    uint next[kMaxLevels], end[kMaxLevels];
    uint level = levelCount - 1u;
    next[level] = moverWords[kLevelStart + level];
    end[level] = moverWords[kLevelStart + level + 1u];
    while (level < levelCount) {
        if (next[level] == end[level]) {
            ++level;
            continue;
        }
        uint i = next[level]++;
        uint box = moverWords[kBoxes] + 6u * i;
        vec3 least = vec3(moverFloat(box), moverFloat(box + 1u), moverFloat(box + 2u));
        vec3 most = vec3(moverFloat(box + 3u), moverFloat(box + 4u), moverFloat(box + 5u));
        precise dvec3 t0 = (dvec3(least) - slack - from) * inverse, t1 = (dvec3(most) + slack - from) * inverse;
        dvec3 nearer = min(t0, t1), farther = max(t0, t1);
        double enter = max(max(nearer.x, nearer.y), max(nearer.z, 0.0LF));
        double leave = min(min(farther.x, farther.y), min(farther.z, 1.0LF));
        if (!(enter <= leave) || least.x > most.x)
            continue;
        uint inLevel = i - moverWords[kLevelStart + level];
        if (level != 0u) {
            --level;
            next[level] = moverWords[kLevelStart + level] + inLevel * kBvhWidth;
            end[level] = min(next[level] + kBvhWidth, moverWords[kLevelStart + level + 1u]);
            continue;
        }
        uint item = moverWords[kItems] + 2u * inLevel; // first triangle, triangles; two words each
        uint first = moverWords[item], last = first + 2u * moverWords[item + 1u];
        for (uint t = first; t < last; t += 2u)
            if (blocksTruthRay(ray, moverWords[t], moverWords[t + 1u]))
                return true;
    }
    return false;
}
