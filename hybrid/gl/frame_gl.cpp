// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gl/frame_gl.h"

#include "hybrid/gl/gl_options.h"

namespace shadowdag {

GlScene::GlScene(const TriangleView& triangles, View<const uint32_t> batchTriangles,
                 const DagView& dag)
    : pages_(chooseGlPages(requestedGlPages(), context_.info())) {
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

namespace {

/// Destroys objects with their context current. If it cannot be made current, they remain for the
/// lifetime of the process, and OpenGL frees their memory with the context.
template <class... Objects>
void endCurrent(const GlContext& context, std::unique_ptr<Objects>&... objects) noexcept {
    try {
        const GlContext::Current current(context);
        (objects.reset(), ...);
    } catch (const std::exception&) {
        static std::vector<std::shared_ptr<void>>* const left =
            new std::vector<std::shared_ptr<void>>;
        (left->emplace_back(std::shared_ptr<Objects>(std::move(objects))), ...);
    }
}

} // namespace

GlScene::~GlScene() {
    endCurrent(context_, shading_, gbuffer_, geometry_);
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

std::unique_ptr<FrameDevice> GlScene::makeFrame() {
    return std::make_unique<GlFrame>(*this);
}

std::unique_ptr<SceneDevice> makeGlSceneDevice(const TriangleView& triangles,
                                               View<const uint32_t> batchTriangles,
                                               const DagView& dag) {
    return std::make_unique<GlScene>(triangles, batchTriangles, dag);
}

GlFrame::GlFrame(GlScene& scene) : scene_(scene) {
    const auto current = makeCurrent();
    maps_ = GlMapDrawer::make(scene_.pages(), scene_.context(), scene_.geometry());
    try {
        scene_.gbuffer().warmUp();
        maps_->warmUp();
        scene_.shading().warmUp(*maps_);
    } catch (...) {
        maps_.reset(); // while the context is current
        throw;
    }
}

GlFrame::~GlFrame() {
    endCurrent(scene_.context(), maps_);
}

std::shared_ptr<void> GlFrame::makeCurrent() const {
    return std::make_shared<GlContext::Current>(scene_.context());
}

FrameOptions GlFrame::followed(const FrameOptions& options) const {
    FrameOptions own = options;
    if (const uint32_t side = glPageTexels(scene_.pages(), scene_.context().info()))
        own.maps.pageTexels = side;
    return own;
}

std::string unfollowedByGl(const FrameOptions& options) {
    if (!options.rays.believesAll())
        return "believes all voxels: its rays ask no triangles (--believe all)";
    if (options.rays.lod != LodRule::kFixed || options.rays.level != 0)
        return "traces voxels of level 0 only, without a level of detail (--lod)";
    if (options.pruning == PairPruning::kLit)
        return "prunes pairs by facing alone, without proofs of light (LP of --variants)";
    if (options.maps.retainsPages)
        return "frees pages at once and keeps none that no map requests (SOR of --variants)";
    if (options.maps.lodTexels > 0.0f)
        return "draws full detail only, without polygon levels of detail (--polygon-lod, PLOD of "
               "--variants)";
    return "";
}

void GlFrame::checkOptions(const FrameOptions& options) const {
    const GlInfo& info = scene_.context().info();
    if (const std::string what = unfollowedByGl(options); !what.empty())
        throw Error(ErrorKind::kUsage,
                    "the OpenGL backend " + what + "; use --backend cpu or cuda");
    if (const uint32_t most = uint32_t(info.maxViewport);
        options.width > most || options.height > most)
        throw Error(ErrorKind::kUsage, "a picture of " + std::to_string(options.width) + " x " +
                                           std::to_string(options.height) + " pixels, but " +
                                           info.renderer + " draws " + std::to_string(most) +
                                           " per side; choose a smaller one, or use --backend cpu");
}

void GlFrame::drawGBuffer(const TriangleView& triangles, const BatchView& batches,
                          const ViewRays& view, GBuffer& gbuffer) {
    scene_.gbuffer().draw(triangles, batches, view, gbuffer);
}

View<const uint32_t> GlFrame::hostDepths(View<const uint32_t>, std::vector<uint32_t>& copy) {
    copy = maps_->downloadDepths();
    return viewOf(std::as_const(copy));
}

void GlFrame::shade(const ShadeSamples& work, View<const uint32_t> pairLights) {
    scene_.shading().shade(work, *maps_, pairLights);
}

} // namespace shadowdag
