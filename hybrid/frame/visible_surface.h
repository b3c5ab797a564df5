// SPDX-License-Identifier: Apache-2.0
// The surface that the camera sees in a frame.
#pragma once

#include "hybrid/frame/frame_context.h"
#include "hybrid/gbuffer/gbuffer_pass.h"

namespace shadowdag {

/// The G-buffer of a frame.
class VisibleSurface {
public:
    explicit VisibleSurface(const FrameContext& context)
        : context_(context), gbuffer_(context.backend) {}

    /// Draws the view's visible samples; adds the stage's time.
    void draw(const ViewRays& view, StageTimes& stages);

    const GBuffer& buffers() const { return gbuffer_; }
    GBufferView view() const { return gbuffer_.view(); }
    /// Returns the G-buffer on the host; valid until the next frame.
    GBufferView hostView();

    /// Returns how many large triangles did not fit the list, and enlarges it for the next frame.
    /// CUDA only: 0 elsewhere.
    uint64_t unsplitTriangleCount() { return gbuffer_.large.grow(); }

private:
    FrameContext context_;
    GBuffer gbuffer_;

    struct HostCopies {
        std::vector<glm::vec3> positionWorld, normalWorld, baseColor;
        std::vector<float> depthView;
        std::vector<uint32_t> triangle;
    } host_;
};

} // namespace shadowdag
