// SPDX-License-Identifier: Apache-2.0
// The parts of frames that Backend::kGl replaces: G-buffer, shadow maps and shading in OpenGL.
// Clusters, assignment of lights, resolutions, page masks, allocation and culling remain the CPU's
// passes, the same code for both. Frames use it as a FrameDevice.
#pragma once

#include "hybrid/frame/frame_device.h"
#include "hybrid/gl/gbuffer_gl.h"
#include "hybrid/gl/shade_gl.h"

#include <memory>

namespace shadowdag {

/// The world in OpenGL's memory and the programs; shared by renderers of one scene, as FrameScene
/// is. Makes its context current by itself.
class GlScene final : public SceneDevice {
public:
    /// Pages are in the memory that setGlPages chose. Throws Error kDevice if there is no OpenGL
    /// 4.5. The views are those of the host.
    GlScene(const TriangleView& triangles, View<const uint32_t> batchTriangles, const DagView& dag);
    /// Its context is current on no other thread; otherwise the driver frees OpenGL's memory with
    /// the context.
    ~GlScene() override;

    void setPositions(View<const glm::vec3> positionsWorld) override;
    std::unique_ptr<FrameDevice> makeFrame() override;

    const GlContext& context() const { return context_; }
    GlPages pages() const { return pages_; }
    GlGeometry& geometry() { return *geometry_; }
    GlGBuffer& gbuffer() { return *gbuffer_; }
    GlShading& shading() { return *shading_; }

private:
    void release();

    GlContext context_;
    GlPages pages_;
    std::unique_ptr<GlGeometry> geometry_;
    std::unique_ptr<GlGBuffer> gbuffer_;
    std::unique_ptr<GlShading> shading_;
};

/// The state of one renderer in OpenGL.
class GlFrame final : public FrameDevice {
public:
    /// Compiles the programs that frames use, by running them.
    explicit GlFrame(GlScene& scene);
    /// As ~GlScene.
    ~GlFrame() override;

    std::shared_ptr<void> makeCurrent() const override;
    /// Also refuses a picture size that the device does not draw.
    void checkOptions(const FrameOptions& options) const override;
    /// In layers of textures a page has their side.
    FrameOptions followed(const FrameOptions& options) const override;
    HostCopyCounts copyCounts() const override { return glCopyCounts(); }
    void drawGBuffer(const TriangleView& triangles, const BatchView& batches, const ViewRays& view,
                     GBuffer& gbuffer) override;
    MapDrawer* mapDrawer() override { return maps_.get(); }
    View<const uint32_t> hostDepths(View<const uint32_t> depths,
                                    std::vector<uint32_t>& copy) override;
    void shade(const ShadeSamples& work, View<const uint32_t> pairLights) override;

private:
    GlScene& scene_;
    std::unique_ptr<GlMapDrawer> maps_;
};

} // namespace shadowdag
