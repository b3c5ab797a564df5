// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/triangle_bvh.h"

#include "cuda/error.h"
#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "hybrid/rays/build_poll.h"
#include "hybrid/rays/embree_device.h"
#include "hybrid/rays/embree_version.h"
#include "hybrid/rays/float_mode.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <string>

namespace shadowdag {
namespace {

/// A node or leaf as the builder makes it, in Embree's memory.
struct Built {
    Box bounds[kTriangleBvhWidth];
    Built* child[kTriangleBvhWidth];
    uint32_t triangle[kTrianglesPerLeaf];
    uint32_t count; ///< children, or triangles
    bool isLeaf;
};

void* createNode(RTCThreadLocalAllocator allocator, unsigned childCount, void*) {
    Built* node = new (rtcThreadLocalAlloc(allocator, sizeof(Built), alignof(Built))) Built;
    node->count = childCount;
    node->isLeaf = false;
    return node;
}

void setNodeChildren(void* node, void** children, unsigned childCount, void*) {
    for (unsigned i = 0; i < childCount; ++i)
        static_cast<Built*>(node)->child[i] = static_cast<Built*>(children[i]);
}

void setNodeBounds(void* node, const RTCBounds** bounds, unsigned childCount, void*) {
    for (unsigned i = 0; i < childCount; ++i) {
        const RTCBounds& b = *bounds[i];
        static_cast<Built*>(node)->bounds[i] = {{b.lower_x, b.lower_y, b.lower_z},
                                                {b.upper_x, b.upper_y, b.upper_z}};
    }
}

void* createLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives,
                 size_t count, void*) {
    Built* leaf = new (rtcThreadLocalAlloc(allocator, sizeof(Built), alignof(Built))) Built;
    leaf->count = uint32_t(count);
    leaf->isLeaf = true;
    for (size_t i = 0; i < count; ++i)
        leaf->triangle[i] = primitives[i].primID;
    return leaf;
}

class Flattener {
public:
    Flattener(const TruthGeometry& geometry, TriangleBvh& bvh) : geometry_(geometry), bvh_(bvh) {}

    uint32_t add(const Built& built, uint32_t depth) {
        if (depth > kTriangleBvhDepth)
            throw Error(ErrorKind::kResource, "the hierarchy of triangles is deeper than " +
                                                  std::to_string(kTriangleBvhDepth) + " nodes");
        if (built.isLeaf)
            return addLeaf(built);
        const uint32_t index = uint32_t(bvh_.nodes.size());
        bvh_.nodes.emplace_back();
        for (uint32_t i = 0; i < kTriangleBvhWidth; ++i) {
            const bool isUsed = i < built.count;
            const uint32_t child = isUsed ? add(*built.child[i], depth + 1) : kNoTriangleChild;
            TriangleBvhNode& node = bvh_.nodes[index];
            node.child[i] = child;
            for (int a = 0; a < 3; ++a) {
                node.low[a][i] = isUsed ? built.bounds[i].min[a] : INFINITY;
                node.high[a][i] = isUsed ? built.bounds[i].max[a] : -INFINITY;
            }
        }
        return index;
    }

private:
    uint32_t addLeaf(const Built& built) {
        TriangleBvhLeaf leaf;
        std::memset(&leaf, 0, sizeof leaf);
        for (uint32_t i = 0; i < built.count; ++i) {
            const uint32_t t = built.triangle[i];
            glm::vec3 corner[3];
            for (int k = 0; k < 3; ++k)
                corner[k] = glm::vec3(geometry_.vertex(t, k));
            int first = 0;
            for (int k = 1; k < 3; ++k)
                if (glm::distance(corner[(k + 1) % 3], corner[(k + 2) % 3]) >
                    glm::distance(corner[(first + 1) % 3], corner[(first + 2) % 3]))
                    first = k;
            const glm::vec3 a = corner[first], b = corner[(first + 1) % 3],
                            c = corner[(first + 2) % 3];
            const glm::vec3 edge1 = b - a, edge2 = c - a;
            for (int axis = 0; axis < 3; ++axis) {
                leaf.corner[axis][i] = a[axis];
                leaf.edge1[axis][i] = edge1[axis];
                leaf.edge2[axis][i] = edge2[axis];
            }
            leaf.longest[i] =
                1.0001f * std::max({glm::length(edge1), glm::length(edge2), glm::length(c - b)});
            leaf.sides[i] = 1.0001f * glm::length(edge1) * glm::length(edge2);
            leaf.triangle[i] = t | (geometry_.masks().isCut(t) ? kCutTriangleTag : 0u);
            leaf.triangle[i] = mutated(Mutant::kExactMasksIgnored, leaf.triangle[i], t);
        }
        if (bvh_.leaves.empty() && isMutant(Mutant::kExactLeafSkipped))
            leaf = {};
        bvh_.leaves.push_back(leaf);
        return uint32_t(bvh_.leaves.size() - 1) | kTriangleLeafTag;
    }

    const TruthGeometry& geometry_;
    TriangleBvh& bvh_;
};

} // namespace

TriangleBvh buildTriangleBvh(const TruthGeometry& geometry, View<const uint32_t> which) {
    TriangleBvh bvh;
    if (which.empty())
        return bvh;
    std::vector<RTCBuildPrimitive> primitives(which.count);
    for (size_t i = 0; i < which.count; ++i) {
        Box box;
        for (int k = 0; k < 3; ++k)
            box.add(glm::vec3(geometry.vertex(which[i], k)));
        primitives[i] = {box.min.x, box.min.y, box.min.z, 0,
                         box.max.x, box.max.y, box.max.z, which[i]};
    }
    const EmbreeFloatMode mode;
    const RTCDevice device = newEmbreeDevice();
    const RTCBVH embreeBvh = rtcNewBVH(device);
    struct Release {
        RTCDevice device;
        RTCBVH bvh;
        ~Release() {
            rtcReleaseBVH(bvh);
            rtcReleaseDevice(device);
        }
    } const release{device, embreeBvh};
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    // RTC_BUILD_QUALITY_HIGH, which splits triangles, with room for 0.5 and 1.5 times as many took
    // 97 to 100 % of the time of frames, and 10 to 15 % more memory.
    arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
    arguments.maxBranchingFactor = kTriangleBvhWidth;
    arguments.maxDepth = kTriangleBvhDepth;
    arguments.sahBlockSize = kTrianglesPerLeaf;
    arguments.minLeafSize = kTrianglesPerLeaf;
    arguments.maxLeafSize = kTrianglesPerLeaf;
    arguments.traversalCost = 1.0f;
    arguments.intersectionCost = 1.0f;
    arguments.bvh = embreeBvh;
    arguments.primitives = primitives.data();
    arguments.primitiveCount = arguments.primitiveArrayCapacity = primitives.size();
    arguments.createNode = createNode;
    arguments.setNodeChildren = setNodeChildren;
    arguments.setNodeBounds = setNodeBounds;
    arguments.createLeaf = createLeaf;
    BuildPoll poll;
    arguments.buildProgress = BuildPoll::goesOn;
    arguments.userPtr = &poll; // of the other functions too, which do not read it
    const Built* root = static_cast<const Built*>(rtcBuildBVH(&arguments));
    const RTCError error = rtcGetDeviceError(device);
    if (root)
        bvh.root = Flattener(geometry, bvh).add(*root, 0);
    poll.rethrow();
    if (!root)
        throw Error(ErrorKind::kResource, "Embree cannot build over " +
                                              std::to_string(which.count) + " triangles (code " +
                                              std::to_string(int(error)) +
                                              "); free memory or use a smaller scene");
    return bvh;
}

void moveToSpace(TriangleBvh& bvh, const glm::dvec3& from, const glm::dvec3& to) {
    const auto moveAll = [&](auto& values, int axis) { // infinity stays
        for (float& value : values)
            value = float(double(value) + from[axis] - to[axis]);
    };
    parallelFor<CpuTag>(
        bvh.nodes.size(),
        [&](size_t i) {
            for (int axis = 0; axis < 3; ++axis) {
                moveAll(bvh.nodes[i].low[axis], axis);
                moveAll(bvh.nodes[i].high[axis], axis);
            }
        },
        256);
    parallelFor<CpuTag>(
        bvh.leaves.size(),
        [&](size_t i) {
            for (int axis = 0; axis < 3; ++axis)
                moveAll(bvh.leaves[i].corner[axis], axis);
        },
        256);
}

} // namespace shadowdag
