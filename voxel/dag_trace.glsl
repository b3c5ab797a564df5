// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by the voxels of a DAG, level 0: dag_trace.h and ray_slabs.h, where layout,
// predicate and margin are explained. Any traversal gives the same bits, so this one may differ.
#include "gl/numerics.glsl"

layout(std430, binding = SDAG_DAG_BINDING) readonly buffer DagWords { uint dagWords[]; };
uniform uint dagRootAddress, dagResolutionLog2;
uniform dvec3 gridOrigin;
uniform double voxelSize;

const uint kNoNode = SDAG_NO_NODE;
const uint kLeafLog2 = SDAG_LEAF_LOG2;

struct DagSegment {
    vec3 from, to; // voxel space
};

struct RaySlabs {
    vec3 inv, cNear, cFar;
    uint octant;
};

float segmentScale(DagSegment s) {
    float scale = float(1u << dagResolutionLog2);
    for (int a = 0; a < 3; ++a) {
        float f = abs(s.from[a]), t = abs(s.to[a]);
        scale = f <= scale ? scale : (scale == scale ? f : scale);
        scale = t <= scale ? scale : (scale == scale ? t : scale);
    }
    return scale;
}

RaySlabs makeRaySlabs(DagSegment s, float scale) {
    RaySlabs r;
    r.octant = 0u;
    precise float margin = scale * 9.5367431640625e-7;
    precise float least = scale * 5.9604644775390625e-8;
    for (int a = 0; a < 3; ++a) {
        float from = s.from[a];
        precise float d = s.to[a] - from;
        d = abs(d) < least ? (d < 0.0 ? -least : least) : d;
        float inv = quotient(1.0, d);
        precise float before = (-from - margin) * inv, after = (margin - from) * inv;
        bool isAgainst = d < 0.0;
        r.inv[a] = inv;
        r.octant |= uint(isAgainst) << a;
        r.cNear[a] = isAgainst ? after : before;
        r.cFar[a] = isAgainst ? before : after;
    }
    return r;
}

vec3 slabTimes(vec3 planes, vec3 inv, vec3 c) {
    return vec3(fusedMultiplyAdd(planes.x, inv.x, c.x), fusedMultiplyAdd(planes.y, inv.y, c.y),
                fusedMultiplyAdd(planes.z, inv.z, c.z));
}

// Which of the eight cells of side h at the corner are met, as bits x | y << 1 | z << 2.
uint childHits(RaySlabs r, uvec3 cell, uint side) {
    vec3 corner = vec3(cell);
    float h = float(side);
    vec3 against = vec3(uvec3(r.octant, r.octant >> 1, r.octant >> 2) & 1u);
    vec3 toNear = against * h, toFar = h - toNear;
    // Component a of lower and upper: of the lower and the upper child along axis a.
    vec3 nearLower = max(slabTimes(corner + toNear, r.inv, r.cNear), vec3(0.0));
    vec3 nearUpper = max(slabTimes(corner + h + toNear, r.inv, r.cNear), vec3(0.0));
    vec3 farLower = min(slabTimes(corner + toFar, r.inv, r.cFar), vec3(1.0));
    vec3 farUpper = min(slabTimes(corner + h + toFar, r.inv, r.cFar), vec3(1.0));
    // Enter and leave of the four columns (x, y).
    vec4 enter = max(vec4(nearLower.x, nearUpper.x, nearLower.x, nearUpper.x),
                     vec4(nearLower.y, nearLower.y, nearUpper.y, nearUpper.y));
    vec4 leave = min(vec4(farLower.x, farUpper.x, farLower.x, farUpper.x),
                     vec4(farLower.y, farLower.y, farUpper.y, farUpper.y));
    uvec4 low = uvec4(lessThanEqual(max(enter, vec4(nearLower.z)), min(leave, vec4(farLower.z))));
    uvec4 high = uvec4(lessThanEqual(max(enter, vec4(nearUpper.z)), min(leave, vec4(farUpper.z))));
    return low.x | low.y << 1 | low.z << 2 | low.w << 3 | high.x << 4 | high.y << 5 |
           high.z << 6 | high.w << 7;
}

uvec3 childCorner(uvec3 corner, uint child, uint side) {
    return corner + uvec3(child & 1u, child >> 1 & 1u, child >> 2) * side;
}

bool occludedInLeaf(RaySlabs r, uint address, uvec3 corner) {
    uvec2 voxels = uvec2(dagWords[address], dagWords[address + 1u]);
    uint octants = childHits(r, corner, 2u);
    while (octants != 0u) {
        uint o = uint(findLSB(octants));
        octants &= octants - 1u;
        uint inOctant = (o < 4u ? voxels.x : voxels.y) >> (8u * (o & 3u)) & 0xffu;
        if (inOctant != 0u && (childHits(r, childCorner(corner, o, 2u), 1u) & inOctant) != 0u)
            return true;
    }
    return false;
}

// The first of these children (not 0), visited from the segment's end: child i ^ order is the i-th.
uint firstChild(uint bits, uint order) {
    bits = (order & 1u) != 0u ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
    bits = (order & 2u) != 0u ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
    bits = (order & 4u) != 0u ? (bits & 0x0fu) << 4 | (bits >> 4 & 0x0fu) : bits;
    return uint(findLSB(bits)) ^ order;
}

// Whether the closed segment meets an occupied voxel.
bool occluded(DagSegment segment) {
    uint rootLevel = max(dagResolutionLog2, kLeafLog2);
    float scale = segmentScale(segment);
    if (!(scale < SDAG_LARGEST_SCALE))
        return true;
    if (dagRootAddress == kNoNode)
        return false;
    RaySlabs r = makeRaySlabs(segment, scale);
    uint order = r.octant ^ 7u;
    uvec3 corner = uvec3(0u);
    uint address = dagRootAddress, cellLevel = rootLevel;
    if (rootLevel == kLeafLog2)
        return occludedInLeaf(r, address, corner);
    uint stackAddress[SDAG_MAX_RESOLUTION_LOG2 + 1], stackPending[SDAG_MAX_RESOLUTION_LOG2 + 1];
    uint mask = dagWords[address];
    uint pending = mask & childHits(r, corner, 1u << (rootLevel - 1u));
    while (true) {
        while (pending == 0u) {
            if (++cellLevel > rootLevel)
                return false;
            pending = stackPending[cellLevel];
            address = stackAddress[cellLevel];
            corner &= uvec3(0xffffffffu << cellLevel);
            mask = dagWords[address];
        }
        uint childLevel = cellLevel - 1u;
        uint c = firstChild(pending, order);
        uvec3 child = childCorner(corner, c, 1u << childLevel);
        pending &= ~(1u << c);
        uint below = dagWords[address + 1u + uint(bitCount(mask & ((1u << c) - 1u)))];
        if (childLevel == kLeafLog2) {
            if (occludedInLeaf(r, below, child))
                return true;
            continue;
        }
        stackPending[cellLevel] = pending;
        stackAddress[cellLevel] = address;
        address = below;
        corner = child;
        cellLevel = childLevel;
        mask = dagWords[address];
        pending = mask & childHits(r, corner, 1u << (cellLevel - 1u));
    }
}

dvec3 voxelFromWorld(dvec3 world) {
    precise dvec3 voxel = (world - gridOrigin) / voxelSize;
    return voxel;
}

// The segment by which a sample asks for a point, ends kept out of the voxels of its own surface and
// of the light's fixture.
DagSegment shadowSegment(vec3 sampleWorld, vec3 normalWorld, vec3 lightWorld, float offset) {
    dvec3 position = voxelFromWorld(dvec3(sampleWorld)), light = voxelFromWorld(dvec3(lightWorld));
    dvec3 n = dvec3(normalWorld);
    double scale = double(1u << dagResolutionLog2), world = 0.0LF;
    for (int a = 0; a < 3; ++a) {
        scale = max(max(scale, abs(position[a])), abs(light[a]));
        world = max(world, abs(double(sampleWorld[a])));
    }
    precise double slack =
        scale * 1.9073486328125e-6LF + world / voxelSize * 4.76837158203125e-7LF;
    precise double lift = double(offset) * (abs(n.x) + abs(n.y) + abs(n.z)) * (1.0LF + slack);
    precise dvec3 from = position + n * lift;

    precise dvec3 way = light - from;
    precise double length2 = way.x * way.x + way.y * way.y + way.z * way.z;
    precise double length = sqrt(length2);
    precise double back = double(offset) * 1.7320508075688772LF;
    precise dvec3 to = from;
    if (length > back)
        to = from + way * ((length - back) / length);
    precise double height = (to.x - from.x) * n.x + (to.y - from.y) * n.y + (to.z - from.z) * n.z;
    if (height < 0.0LF) {
        to = to - n * height;
        return DagSegment(vec3(from), vec3(to));
    }
    precise double halfWay = 0.5LF * (length - back);
    precise double ahead = min(halfWay, double(offset));
    precise dvec3 start = from;
    if (ahead > 0.0LF)
        start = from + way * (ahead / length);
    return DagSegment(vec3(start), vec3(to));
}
