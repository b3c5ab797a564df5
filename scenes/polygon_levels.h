// SPDX-License-Identifier: Apache-2.0
// Chooses the level of polygon detail of an instance's part for a cube map. Levels are made by
// polygon_lod.h. Source: Olsson et al. 2015, sec. V, tried it with one low-polygon scene for all
// lights; the choice by map and part is ours.
#pragma once

#include "cuda/view.h"
#include "scenes/box.h"

#include <cstdint>

namespace shadowdag {

constexpr uint32_t kMaxPolygonLevels = 8; ///< of a part, the full one included

/// Levels of every part of every instance, 0 the full one. A batch belongs to part (Batch::instance
/// % partCount), at level (Batch::instance / partCount). partBoxes: partCount, world, closed.
/// errorsWorld: partCount * kMaxPolygonLevels, the distance of a level's surface from the full one;
/// ascending, 0 first, infinity for a missing level.
struct PolygonLevelsView {
    View<const Box> partBoxes;
    View<const float> errorsWorld;
    float allowedTexels = 0.0f; ///< 0: everything is drawn at level 0

    SDAG_HD bool empty() const { return partBoxes.empty(); }
    SDAG_HD uint32_t levelOf(uint32_t batchInstance) const {
        return batchInstance / uint32_t(partBoxes.count);
    }

    /// Returns the coarsest level of a batch's part whose error is less than so much.
    SDAG_HD uint32_t levelBelow(uint32_t batchInstance, float errorWorld) const {
        const uint32_t part = batchInstance % uint32_t(partBoxes.count);
        uint32_t level = 0;
        while (level + 1 < kMaxPolygonLevels &&
               errorsWorld[part * kMaxPolygonLevels + level + 1] < errorWorld)
            ++level;
        return level;
    }

    /// Returns the coarsest level of a batch's part whose error is less than allowedTexels texels
    /// of a cube map, where the part is nearest to the light.
    ///
    /// A texel of a face of N texels is 2 z / N wide at depth z along the face's axis, and the
    /// least depth of a box is its distance to the light in the largest component. An error e there
    /// shifts a silhouette by up to sqrt(2) e N / (2 z) texels on an axis: by e along it, and by u
    /// e, |u| <= 1, from depth. Level 0 where the light is in the box. All batches of a part agree,
    /// and parts meet in edges that no level changes, so a surface stays closed.
    SDAG_HD uint32_t levelFor(uint32_t batchInstance, const glm::vec3& lightPositionWorld,
                              uint32_t faceTexels) const {
        const Box& box = partBoxes[batchInstance % uint32_t(partBoxes.count)];
        const glm::vec3 d = glm::max(box.min - lightPositionWorld, lightPositionWorld - box.max);
        const float z = glm::max(d.x, glm::max(d.y, d.z));
        return levelBelow(batchInstance, allowedTexels * 2.0f * z / float(faceTexels));
    }
};

} // namespace shadowdag
