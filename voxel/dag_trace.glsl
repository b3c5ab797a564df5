// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by the voxels of a DAG at level 0. dag_trace.h explains layout and predicate. The
// order of traversal differs from there, which does not change the result.
#include "voxel/shadow_segment_leaf.h"
#include "voxel/voxel_grid_leaf.h"

layout(std430, binding = SDAG_DAG_BINDING) readonly buffer DagWords { uint dagWords[]; };
uniform uint dagRootAddress, dagResolutionLog2;
uniform dvec3 gridOrigin;
uniform double voxelSize;

const uint kNoNode = SDAG_NO_NODE;
const uint kLeafLog2 = SDAG_LEAF_LOG2;

uint childHits(RaySlabs r, uvec3 cell, uint side) {
    return slabHits(r, vec3(cell), float(side), 0.0, 1.0);
}

uvec3 childCorner(uvec3 corner, uint child, uint side) {
    return corner + uvec3(child & 1u, child >> 1 & 1u, child >> 2) * side;
}

bool occludedInLeaf(RaySlabs r, uint address, uvec3 corner) {
    uvec2 voxels = uvec2(dagWords[address], dagWords[address + 1u]);
    uint octants = childHits(r, corner, 2u);
    while (octants != 0u) {
        uint o = lowestBit32(octants);
        octants &= octants - 1u;
        uint inOctant = (o < 4u ? voxels.x : voxels.y) >> (8u * (o & 3u)) & 0xffu;
        if (inOctant != 0u && (childHits(r, childCorner(corner, o, 2u), 1u) & inOctant) != 0u)
            return true;
    }
    return false;
}

// Whether the closed segment meets an occupied voxel.
bool occluded(DagSegment segment) {
    uint rootLevel = max(dagResolutionLog2, kLeafLog2);
    float scale = segmentScale(1u << dagResolutionLog2, segment);
    if (!(scale < kLargestScale))
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
            corner &= uvec3(~0u << cellLevel);
            mask = dagWords[address];
        }
        uint childLevel = cellLevel - 1u;
        uint c = firstChild(pending, order);
        uvec3 child = childCorner(corner, c, 1u << childLevel);
        pending &= ~(1u << c);
        uint below = dagWords[address + 1u + bitCount32(mask & ((1u << c) - 1u))];
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
    return voxelAt(world, gridOrigin, voxelSize);
}

// See shadowSegment of dag_trace.h.
DagSegment shadowSegment(vec3 sampleWorld, vec3 normalWorld, vec3 lightWorld, float offset) {
    dvec3 at = voxelFromWorld(dvec3(sampleWorld)), light = voxelFromWorld(dvec3(lightWorld));
    dvec3 n = dvec3(normalWorld);
    double lift = shadowLiftVoxels(1u << dagResolutionLog2, voxelSize, sampleWorld, n, at, light, offset, 1.0LF);
    precise dvec3 from = at + n * lift;
    return segmentFromLifted(from, n, light, double(offset), 1.0LF);
}
