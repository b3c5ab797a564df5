// SPDX-License-Identifier: Apache-2.0
// Draws the world from the camera into a G-buffer.
#pragma once

#include "cuda/buffer.h"
#include "cuda/pass.h"
#include "cuda/split_work.h"
#include "hybrid/gbuffer/rasterize_cpu.h"

namespace shadowdag {

/// Arrays of a G-buffer on one backend, width * height elements each, and the visibility buffer
/// behind them.
struct GBuffer {
    explicit GBuffer(Backend backend)
        : visibility(backend, "g-buffer visibility"), positionWorld(backend, "g-buffer position"),
          normalWorld(backend, "g-buffer normal"), depthView(backend, "g-buffer depth"),
          triangle(backend, "g-buffer triangle"), baseColor(backend, "g-buffer base colour"),
          large(backend, "g-buffer large triangles", kLargeTriangles),
          largeSetups(backend, "g-buffer setups of large triangles") {}

    /// Initial capacity for large triangles; one that does not fit is drawn by its own thread.
    static constexpr size_t kLargeTriangles = size_t(1) << 16;

    Buffer<uint64_t> visibility;
    Buffer<glm::vec3> positionWorld;
    Buffer<glm::vec3> normalWorld;
    Buffer<float> depthView;
    Buffer<uint32_t> triangle;
    Buffer<glm::vec3> baseColor;      ///< empty in scenes without base colour textures
    SplitWork large;                  ///< of drawing by slots
    Buffer<SeenTriangle> largeSetups; ///< by item of `large`
    uint32_t width = 0, height = 0;

    void resize(uint32_t newWidth, uint32_t newHeight) {
        width = newWidth;
        height = newHeight;
        const size_t count = size_t(width) * height;
        visibility.resize(count);
        positionWorld.resize(count);
        normalWorld.resize(count);
        depthView.resize(count);
        triangle.resize(count);
    }
    /// Returns the pass that fills the arrays from the visibility buffer.
    ResolveSamples resolvePass(const TriangleView& triangles, const ViewRays& viewRays) {
        return {triangles,          viewRays,         visibility.view(), positionWorld.view(),
                normalWorld.view(), depthView.view(), triangle.view()};
    }
    GBufferView view() const {
        return {positionWorld.view(),
                normalWorld.view(),
                depthView.view(),
                triangle.view(),
                width,
                height,
                baseColor.view()};
    }
};

/// How the CPU draws: batch by batch, or triangle by triangle with large ones in parts, as a GPU
/// does by warps (same bits).
enum class GBufferDraw : uint8_t { kByBatch, kBySlot };

/// Fills the G-buffer with the view's visible samples: two-sided triangles, by the fill rule of
/// gbuffer_raster.h. Deterministic. `batches` contains every triangle once and is on the G-buffer's
/// backend; its hierarchy is not used. On the CPU it has its vertices, and was updated since
/// `triangles` moved.
/// @param draw CPU only
inline void drawGBuffer(Backend backend, const TriangleView& triangles, const BatchView& batches,
                        const ViewRays& view, GBuffer& gbuffer,
                        GBufferDraw draw = GBufferDraw::kByBatch) {
    gbuffer.resize(view.width, view.height);
    gbuffer.visibility.fill(0xff); // kNothingSeen
    const BatchesInView seen{
        triangles, batches.batches,          batches.boxesWorld, batches.triangles,
        view,      gbuffer.visibility.view()};
    if (backend == Backend::kCpu && draw == GBufferDraw::kByBatch) {
        rasterizeFrontToBack(seen, batches.vertices);
    } else {
        const SplitWorkView large = gbuffer.large.begin();
        gbuffer.largeSetups.resize(gbuffer.large.capacity());
        const View<SeenTriangle> setups = gbuffer.largeSetups.view();
        runPass(backend, RasterizeSlots{seen, batches.maxTriangleCount, large, setups});
        runPass(backend, RasterizeLarge{seen, large, setups});
    }
    runPass(backend, gbuffer.resolvePass(triangles, view));
}

} // namespace shadowdag
