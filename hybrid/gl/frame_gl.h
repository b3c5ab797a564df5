// SPDX-License-Identifier: Apache-2.0
// What frames of Backend::kGl have beside what those of the CPU have: G-buffer, shadow maps and
// shading in OpenGL; clusters, assignment of lights, resolutions, page masks, allocation and
// culling remain the CPU's passes, one text for both. Not for other folders.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/gl/gbuffer_gl.h"
#include "hybrid/gl/shade_gl.h"

#include <memory>

namespace shadowdag {

/// The world in OpenGL's memory and the programs; shared by renderers of one scene, as FrameScene
/// is. Makes its context current by itself.
class GlScene {
public:
    /// Pages are where setGlPages says. Throws Error kDevice where there is no OpenGL 4.5. The
    /// views are those of the host.
    GlScene(const TriangleView& triangles, View<const uint32_t> batchTriangles, const DagView& dag);
    /// Its context is current on no other thread; else what OpenGL holds is left to the driver,
    /// which frees it with the context.
    ~GlScene();

    void setPositions(View<const glm::vec3> positionsWorld);

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

/// What one renderer keeps there.
class GlFrame {
public:
    /// Compiles what frames run, by running it.
    explicit GlFrame(GlScene& scene);
    /// As ~GlScene.
    ~GlFrame();

    /// Makes OpenGL ready on this thread until what is returned goes.
    std::unique_ptr<GlContext::Current> makeCurrent() const;

    /// Returns the options that frames follow: in layers of textures a page has their side.
    FrameOptions followed(const FrameOptions& options) const;

    GlScene& scene() { return scene_; }
    GlMapDrawer& maps() { return *maps_; }

private:
    GlScene& scene_;
    std::unique_ptr<GlMapDrawer> maps_;
};

/// Throws Error kUsage naming an option that frames in OpenGL do not follow, and what does, or a
/// picture that the device does not draw.
void checkGlOptions(const FrameOptions& options, const GlInfo& info);

} // namespace shadowdag
