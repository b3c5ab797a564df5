// SPDX-License-Identifier: Apache-2.0
// The world's triangles in OpenGL's memory, as scenes/geometry.glsl reads them.
#pragma once

#include "gl/buffer.h"
#include "gl/program.h"
#include "scenes/batches.h"

namespace shadowdag {

/// The GLSL sources of this folder: scenes/geometry.glsl.
GlslTexts scenesGlsl();

/// Positions, triangles, their order in batches, and masks. The context must be current in every
/// call.
class GlGeometry {
public:
    /// Copies everything. @param geometry,batchTriangles on the host
    void set(const TriangleView& geometry, View<const uint32_t> batchTriangles);
    /// Copies positions alone: the same triangles, moved.
    void setPositions(View<const glm::vec3> positionsWorld) { positions_.upload(positionsWorld); }
    bool hasTriangles() const { return batchTriangles_.bytes() > 0; }
    /// Binds positions and triangles alone.
    void bindCorners(uint32_t positionsBinding, uint32_t trianglesBinding);
    /// Binds the buffers that scenes/geometry.glsl names.
    void bind(const GlProgram& program);

private:
    GlBuffer positions_{"gl positions"}, triangles_{"gl triangles"},
        batchTriangles_{"gl batch triangles"}, triangleCut_{"gl triangle cuts"},
        cuts_{"gl cut triangles"}, masks_{"gl alpha masks"}, maskWords_{"gl alpha mask words"};
    bool hasMasks_ = false;
};

} // namespace shadowdag
