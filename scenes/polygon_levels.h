// SPDX-License-Identifier: Apache-2.0
// Which level of polygon detail of an instance a cube map draws. Levels are made by polygon_lod.h.
// Source: Olsson et al. 2015, sec. V, tried it with one low-polygon scene for all lights; the
// choice by map and instance is ours.
#pragma once

#include "cuda/view.h"
#include "scenes/box.h"

#include <cstdint>

namespace shadowdag {

constexpr uint32_t kMaxPolygonLevels = 8; ///< of an instance, the full one included

/// Levels of every instance, 0 the full one. A batch is of instance (Batch::instance %
/// instanceCount), at level (Batch::instance / instanceCount).
/// instanceBoxes: instanceCount, world, closed. errorsWorld: instanceCount * kMaxPolygonLevels, how
/// far a level's surface is from the full one; ascending, 0 first, infinity for a level that is
/// none.
struct PolygonLevelsView {
    View<const Box> instanceBoxes;
    View<const float> errorsWorld;
    float allowedTexels = 0.0f; ///< 0: everything is drawn at level 0

    SDAG_HD bool empty() const { return instanceBoxes.empty(); }
    SDAG_HD uint32_t levelOf(uint32_t batchInstance) const {
        return batchInstance / uint32_t(instanceBoxes.count);
    }

    /// Returns the coarsest level of an instance whose error is less than allowedTexels texels of a
    /// cube map, where the instance is nearest to the light.
    ///
    /// A texel of a face of N texels is 2 z / N wide at depth z along the face's axis, and the
    /// least depth of a box is its distance to the light in the largest component. An error e there
    /// shifts a silhouette by up to sqrt(2) e N / (2 z) texels on an axis: by e along it, and by u
    /// e, |u| <= 1, from depth. Level 0 where the light is in the box. All batches of an instance
    /// agree, so a surface stays closed.
    SDAG_HD uint32_t levelFor(uint32_t batchInstance, const glm::vec3& lightPositionWorld,
                              uint32_t faceTexels) const {
        const uint32_t instance = batchInstance % uint32_t(instanceBoxes.count);
        const Box& box = instanceBoxes[instance];
        const glm::vec3 d = glm::max(box.min - lightPositionWorld, lightPositionWorld - box.max);
        const float z = glm::max(d.x, glm::max(d.y, d.z));
        const float allowedWorld = allowedTexels * 2.0f * z / float(faceTexels);
        uint32_t level = 0;
        while (level + 1 < kMaxPolygonLevels &&
               errorsWorld[instance * kMaxPolygonLevels + level + 1] < allowedWorld)
            ++level;
        return level;
    }
};

} // namespace shadowdag
