// SPDX-License-Identifier: Apache-2.0
// The G-buffer with OpenGL's rasterizer: a visibility buffer of triangle indices, whose samples the
// CPU computes by ResolveSamples. A pixel with the same triangle as on the CPU
// therefore has the same bits; at outlines, where corners snap to 1/256 pixel, it may have another
// triangle.
#pragma once

#include "gl/context.h"
#include "gl/draw.h"
#include "hybrid/gbuffer/gbuffer_pass.h"
#include "scenes/geometry_gl.h"

namespace shadowdag {

/// The GLSL sources of this folder.
GlslTexts hybridGlsl();

/// Draws G-buffers. The context is current in every call.
class GlGBuffer {
public:
    /// @param geometry all triangles; outlives it
    GlGBuffer(const GlContext& context, GlGeometry& geometry);

    /// Runs the program once without work, so that no frame includes the time to compile it.
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
