// SPDX-License-Identifier: Apache-2.0
// The G-buffer with OpenGL's rasterizer: a visibility buffer of triangle indices, whose samples the
// processor resolves by the one text of gbuffer_raster.h. So a pixel that sees the same triangle as
// on the CPU has the same bits; at outlines, where corners snap to 1/256 pixel, it may see another.
#pragma once

#include "gl/context.h"
#include "gl/draw.h"
#include "hybrid/gbuffer/gbuffer_pass.h"
#include "scenes/geometry_gl.h"

namespace shadowdag {

/// The texts of this room.
GlslTexts hybridGlsl();

/// Draws G-buffers. The context is current in every call.
class GlGBuffer {
public:
    /// @param geometry all that is seen; outlives it
    GlGBuffer(const GlContext& context, GlGeometry& geometry);

    /// Runs the program once, on nothing, so that no frame pays for compiling it.
    void warmUp();

    /// Fills a G-buffer of the CPU, as drawGBuffer does. @param triangles,batches on the host
    void draw(const TriangleView& triangles, const BatchView& batches, const ViewRays& view,
              GBuffer& gbuffer);

private:
    const GlContext& context_;
    GlGeometry& geometry_;
    GlProgram program_;
    GlCommands commands_{"gl g-buffer"};
    GlIndexTarget target_;
    std::vector<uint32_t> seen_;
};

} // namespace shadowdag
