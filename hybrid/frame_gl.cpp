// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame_gl.h"

namespace shadowdag {

GlScene::GlScene(const TriangleView& triangles, View<const uint32_t> batchTriangles,
                 const DagView& dag)
    : pages_(chooseGlPages(askedGlPages(), context_.info())) {
    const GlContext::Current current(context_);
    try {
        geometry_ = std::make_unique<GlGeometry>();
        geometry_->set(triangles, batchTriangles);
        gbuffer_ = std::make_unique<GlGBuffer>(context_, *geometry_);
        shading_ = std::make_unique<GlShading>(pages_, context_, *geometry_);
        shading_->setDag(dag);
        context_.finish("copying the scene");
    } catch (...) {
        release(); // while the context is current
        throw;
    }
}

GlScene::~GlScene() {
    const GlContext::Current current(context_);
    release();
}

void GlScene::release() {
    shading_.reset();
    gbuffer_.reset();
    geometry_.reset();
}

void GlScene::setPositions(View<const glm::vec3> positionsWorld) {
    const GlContext::Current current(context_);
    geometry_->setPositions(positionsWorld);
}

GlFrame::GlFrame(GlScene& scene) : scene_(scene) {
    const auto current = makeCurrent();
    maps_ = GlMapDrawer::make(scene_.pages(), scene_.context(), scene_.geometry());
}

GlFrame::~GlFrame() {
    const auto current = makeCurrent();
    maps_.reset();
}

std::unique_ptr<GlContext::Current> GlFrame::makeCurrent() const {
    return std::make_unique<GlContext::Current>(scene_.context());
}

FrameOptions GlFrame::followed(const FrameOptions& options) const {
    FrameOptions own = options;
    if (scene_.pages() == GlPages::kSparse)
        own.maps.pageTexels = scene_.context().info().sparsePageTexels;
    return own;
}

void checkGlOptions(const FrameOptions& options) {
    const auto refuse = [](const char* what) {
        throw Error(ErrorKind::kUsage,
                    std::string("the OpenGL backend ") + what + "; use --backend cpu or cuda");
    };
    if (options.rays.kind == RayKind::kExact)
        refuse("traces voxels, not triangles (dag-exact)");
    if (options.rays.lod != LodRule::kFixed || options.rays.level != 0)
        refuse("traces voxels of level 0 alone, without a level of detail");
    if (options.maps.retainsPages)
        refuse("frees pages at once and keeps none that no map asks for");
    if (options.maps.lodTexels > 0.0f)
        refuse("draws full detail alone, without polygon levels of detail");
}

} // namespace shadowdag
