// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by voxels for a GPU, whose lanes share each instruction (CPUs without AVX2
// use it as well, where its speed was not measured): every step of the traversal does the same,
// whether the node is an inner one, a leaf or an octant of a leaf, so lanes at different depths do
// not wait for each other. The predicate of dag_trace.h, in every bit: a traversal may visit in any
// order, and every plane's time is the same fused multiply-add of the same exact numbers. Sources:
// Laine, Karras, Efficient Sparse Voxel Octrees, I3D 2010 (the stack with a word of levels); Aila,
// Laine, Understanding the Efficiency of Ray Traversal on GPUs, HPG 2009 (why lanes wait).
#pragma once

#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

#include <bit>

namespace shadowdag::detail {

static_assert(kMaxResolutionLog2 <= 22); // floatOfSmall takes coordinates of cells and their ends

/// Returns x as a float without the conversion instruction, of which a GPU does an eighth as many.
/// @param x below 2^23
SDAG_HD inline float floatOfSmall(uint32_t x) {
    return std::bit_cast<float>(0x4b000000u | x) - 0x1p23f;
}

/// Returns the bytes of a word that are not zero as bits 0 to 3.
SDAG_HD inline uint32_t bytesInUse(uint32_t word) {
    uint32_t any = word | word >> 4;
    any |= any >> 2;
    any |= any >> 1;
    // Bit 8 i moves to 28 + i; no other product comes there, and none meet.
    return (any & 0x01010101u) * 0x10204080u >> 28;
}

/// The slabs of a segment, and the order in which children are visited: from the light.
struct FlatSlabs {
    glm::vec3 inv, cNear, cFar;
    glm::vec3 nearSide; ///< 1 along axes that the segment runs against, else 0
    uint32_t order;     ///< child i ^ order is visited before child j ^ order when i > j

    SDAG_HD explicit FlatSlabs(const RaySlabs& r)
        : inv(r.inv), cNear(r.cNear), cFar(r.cFar),
          nearSide(float(r.octant & 1), float(r.octant >> 1 & 1), float(r.octant >> 2)),
          order(r.octant) {}

    /// Returns which children of side `side` of the cell at the corner are met, as slabHits.
    SDAG_HD uint32_t childHits(const portable::Corner& corner, uint32_t side) const {
        const float h = floatOfSmall(side);
        float nearLower[3], nearUpper[3], farLower[3], farUpper[3];
        const uint32_t at[3] = {corner.x, corner.y, corner.z};
        for (int a = 0; a < 3; ++a) {
            const float p = floatOfSmall(at[a]);
            const float toNear = fmaf(h, nearSide[a], p), toFar = p + (h - h * nearSide[a]);
            nearLower[a] = fmaf(toNear, inv[a], cNear[a]);
            nearUpper[a] = fmaf(toNear + h, inv[a], cNear[a]);
            farLower[a] = fmaf(toFar, inv[a], cFar[a]);
            farUpper[a] = fmaf(toFar + h, inv[a], cFar[a]);
        }
        // Times are numbers. Clamping along one axis clamps every child's interval.
        const float enterZ[2] = {fmaxf(nearLower[2], 0.0f), fmaxf(nearUpper[2], 0.0f)};
        const float leaveZ[2] = {fminf(farLower[2], 1.0f), fminf(farUpper[2], 1.0f)};
        uint32_t hits = 0;
        for (uint32_t xy = 0; xy < 4; ++xy) {
            const float enter =
                fmaxf(xy & 1 ? nearUpper[0] : nearLower[0], xy & 2 ? nearUpper[1] : nearLower[1]);
            const float leave =
                fminf(xy & 1 ? farUpper[0] : farLower[0], xy & 2 ? farUpper[1] : farLower[1]);
            for (uint32_t z = 0; z < 2; ++z)
                hits |=
                    fmaxf(enter, enterZ[z]) <= fminf(leave, leaveZ[z]) ? 1u << (xy | z << 2) : 0u;
        }
        return hits;
    }

    /// Returns the first of these children (bits, not 0) to visit.
    SDAG_HD uint32_t first(uint32_t children) const {
        uint32_t bits = children;
        bits = (order & 1u) != 0u ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
        bits = (order & 2u) != 0u ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
        bits = (order & 4u) != 0u ? (bits & 0x0fu) << 4 | (bits >> 4 & 0x0fu) : bits;
        return highestBit32(bits) ^ order;
    }
};

/// Returns whether a segment meets a voxel, as meetsCell at level 0.
SDAG_HD inline bool meetsVoxel(const uint32_t* words, uint32_t rootAddress, uint32_t rootLevel,
                               const RaySlabs& slabs) {
    const FlatSlabs ray(slabs);
    // stack[l]: the node of level l on the path, its children in bits 0 to 7 of `children`, those
    // still to visit in bits 8 to 15; only where bit l of `levels` is set.
    struct alignas(8) Entry {
        uint32_t address, children;
    };
    Entry stack[kMaxResolutionLog2 + 1];
    uint32_t levels = 0, level = rootLevel, address = rootAddress;
    portable::Corner corner;
    uint32_t low = 0, high = 0;             // voxels of the leaf on the path
    uint32_t mask = words[address] & 0xffu; // above them may stand coverage (dag_lod.h)
    if (level == kLeafLog2) {
        low = words[address];
        high = words[address + 1];
        mask = bytesInUse(low) | bytesInUse(high) << 4;
    }
    uint32_t pending = mask & ray.childHits(corner, 1u << (level - 1));
    while (true) {
        if (pending == 0) {
            if (levels == 0)
                return false;
            level = lowestBit32(levels);
            levels &= levels - 1;
            address = stack[level].address;
            mask = stack[level].children & 0xffu;
            pending = stack[level].children >> 8;
            corner = corner.ancestor(level);
        }
        const uint32_t c = ray.first(pending);
        pending ^= 1u << c;
        const portable::Corner child = corner.child(c, 1u << (level - 1));
        uint32_t childMask, childAddress = 0;
        if (level == kLeafLog2) { // the child is an octant, and its children are voxels
            childMask = (c < 4 ? low : high) >> (8 * (c & 3)) & 0xffu;
        } else {
            childAddress = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
            childMask = words[childAddress] & 0xffu;
            if (level == kLeafLog2 + 1) {
                low = words[childAddress];
                high = words[childAddress + 1];
                childMask = bytesInUse(low) | bytesInUse(high) << 4;
            }
        }
        const uint32_t met = childMask & ray.childHits(child, 1u << (level - 2));
        if (level == kLeafLog2) {
            if (met != 0)
                return true;
            continue;
        }
        if (met == 0)
            continue;
        if (pending != 0) {
            stack[level] = {address, mask | pending << 8};
            levels |= 1u << level;
        }
        address = childAddress;
        mask = childMask;
        pending = met;
        corner = child;
        --level;
    }
}

} // namespace shadowdag::detail
