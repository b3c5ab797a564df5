// SPDX-License-Identifier: Apache-2.0
// Exact rays against moving triangles (mover_rays.h, truth_ray.h). Part of shade.comp.
#include "hybrid/rays/truth_leaf.h"
#include "scenes/alpha_mask.glsl"
#include "scenes/segment_box_leaf.h"

layout(std430, binding = SDAG_POSITIONS_BINDING) readonly buffer Positions { float positions[]; };
layout(std430, binding = SDAG_TRIANGLES_BINDING) readonly buffer Triangles { uint triangles[]; };
layout(std430, binding = SDAG_MOVERS_BINDING) readonly buffer MoverWords { uint moverWords[]; };
uniform uint hasMovers;
uniform dvec3 truthOrigin;
uniform double truthDiagonal;

// The head of moverWords: where its parts start (movers_gl.h).
const uint kLevelCount = SDAG_HEAD_LEVEL_COUNT, kBoxes = SDAG_HEAD_BOXES, kItems = SDAG_HEAD_ITEMS,
           kNearLight = SDAG_HEAD_NEAR_LIGHT, kMaskWords = SDAG_HEAD_MASK_WORDS,
           kLevelStart = SDAG_HEAD_LEVEL_START;
const uint kBvhWidth = SDAG_BVH_WIDTH, kMaxLevels = SDAG_BVH_LEVELS;

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

float nextTowards(float x, bool isUp) {
    if (x == 0.0)
        return uintBitsToFloat(isUp ? 1u : 1u | 1u << 31);
    uint bits = floatBitsToUint(x);
    return uintBitsToFloat((x > 0.0) == isUp ? bits + 1u : bits - 1u);
}

TruthRay truthPairRay(vec3 point, vec3 normalWorld, uint triangle, vec3 lightWorld) {
    precise dvec3 sampleLocal = dvec3(point) - truthOrigin;
    ReceiverEdges edges;
    double largest = 0.0LF;
    for (int a = 0; a < 3; ++a)
        largest = max(largest, abs(sampleLocal[a] + truthOrigin[a]));
    for (uint i = 0u; i < 3u; ++i) {
        edges.corner[i] = vertexLocal(triangle, i);
        for (int a = 0; a < 3; ++a)
            largest = max(largest, abs(edges.corner[i][a] + truthOrigin[a]));
    }
    double c = clearanceOf(largest, truthDiagonal);
    dvec3 normal = unitOf(dvec3(normalWorld));
    double offset = dotInOrder(normal, sampleLocal);
    precise dvec3 ab = edges.corner[1] - edges.corner[0], ac = edges.corner[2] - edges.corner[0];
    dvec3 across = crossInOrder(ab, ac);
    double area = lengthOf(across);
    precise dvec3 p = sampleLocal;
    if (area > 0.0LF) {
        precise dvec3 unit = across / area;
        normal = dotInOrder(unit, normal) < 0.0LF ? -unit : unit;
        offset = dotInOrder(normal, edges.corner[0]);
        setInward(edges, across);
        p = moveInside(edges, c, sampleLocal);
    }
    // Move off the plane: along the normal, then along one axis by single float steps until the height is
    // reached.
    p += normal * max(c - (dotInOrder(normal, p) - offset), 0.0LF);
    vec3 start = vec3(p);
    int axis = largestAxis(normal);
    bool isUp = normal[axis] > 0.0LF;
    for (int s = 0; s < 8 && dotInOrder(normal, dvec3(start)) - offset < c; ++s)
        start = vec3(axis == 0 ? nextTowards(start.x, isUp) : start.x,
                     axis == 1 ? nextTowards(start.y, isUp) : start.y,
                     axis == 2 ? nextTowards(start.z, isUp) : start.z);

    precise dvec3 light = dvec3(lightWorld) - truthOrigin;
    precise double missing = c - (dotInOrder(normal, light) - offset);
    light += normal * (missing < 0.0LF ? 0.0LF : missing);
    precise dvec3 way = light - dvec3(start);
    TruthRay ray;
    ray.start = start;
    ray.way = vec3(way);
    ray.tFar = rayEndOf(lengthOf(dvec3(ray.way)), c);
    ray.receiver = triangle;
    return ray;
}

// @param cutAt index of the triangle's mask data in moverWords, or kNotCut
bool blocksTruthRay(TruthRay ray, uint triangle, uint cutAt) {
    dvec3 start = dvec3(ray.start), way = dvec3(ray.way);
    dvec3 v0 = vertexLocal(triangle, 0u), v1 = vertexLocal(triangle, 1u), v2 = vertexLocal(triangle, 2u);
    precise dvec3 a = v0 - start, b = v1 - start, c = v2 - start;
    dvec3 weights;
    if (!passesThrough(way, a, b, c, weights) || triangle == ray.receiver)
        return false;
    double t = crossingOf(start, way, v0, v1, v2);
    if (!(t > 0.0LF && t < double(ray.tFar)))
        return false;
    if (cutAt == kNotCut)
        return true;
    CutTriangle cut = CutTriangle(0u, moverFloat(cutAt + 5u), moverFloat(cutAt + 6u), moverFloat(cutAt + 7u),
                                  moverFloat(cutAt + 8u), moverFloat(cutAt + 9u), moverFloat(cutAt + 10u));
    MaskInfo info = MaskInfo(moverWords[cutAt], moverWords[cutAt + 1u], moverWords[cutAt + 2u],
                             moverWords[cutAt + 3u], moverWords[cutAt + 4u]);
    return isOpaqueAt(cut, info, weights);
}

bool isDarkByMovers(TruthRay ray) {
    if (!(ray.tFar > 0.0))
        return false;
    precise dvec3 from = dvec3(ray.start) + truthOrigin;
    precise dvec3 to = from + dvec3(ray.way);
    BoxSlabs slabs = makeBoxSlabs(from, to);
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
        if (!touchesBox(slabs, least, most, dvec3(0.0LF)))
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
