// SPDX-License-Identifier: Apache-2.0
#include "scenes/geometry_gl.h"

#include "scenes/geometry_bindings_leaf.h"

namespace shadowdag {

// The structures that geometry.glsl reads.
static_assert(sizeof(CutTriangle) == 7 * sizeof(uint32_t));
static_assert(sizeof(MaskInfo) == 5 * sizeof(uint32_t));
static_assert(sizeof(glm::vec3) == 3 * sizeof(float) && sizeof(glm::uvec3) == 12);

void GlGeometry::set(const TriangleView& geometry, View<const uint32_t> batchTriangles) {
    setPositions(geometry.positions);
    triangles_.upload(geometry.triangles);
    batchTriangles_.upload(batchTriangles);
    hasMasks_ = !geometry.masks.triangleCut.empty();
    triangleCut_.upload(geometry.masks.triangleCut);
    cuts_.upload(geometry.masks.cuts);
    masks_.upload(geometry.masks.masks);
    maskWords_.upload(geometry.masks.words);
}

void GlGeometry::bindCorners(uint32_t positionsBinding, uint32_t trianglesBinding) {
    positions_.bindStorage(positionsBinding);
    triangles_.bindStorage(trianglesBinding);
}

void GlGeometry::bind(const GlProgram& program) {
    bindCorners(kPositionsAt, kTrianglesAt);
    batchTriangles_.bindStorage(kBatchTrianglesAt);
    triangleCut_.bindStorage(kTriangleCutAt);
    cuts_.bindStorage(kCutsAt);
    masks_.bindStorage(kMasksAt);
    maskWords_.bindStorage(kMaskWordsAt);
    program.set("hasMasks", uint32_t(hasMasks_));
}

} // namespace shadowdag
