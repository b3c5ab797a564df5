// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gl/gbuffer_gl.h"

#include "cuda/parallel_for.h"
#include "gl/slices.h"
#include "shadowmap/rasterize_gl.h"

namespace shadowdag {

namespace {

/// The hardware's outline may include a pixel whose ray passes beside a triangle at a grazing
/// angle, where the plane's depth is arbitrary. Such a pixel is background if its depth is outside
/// of the triangle's range by more than this share.
constexpr double kMostBeyond = 1.0 / 64.0;

/// Writes the visibility buffer of the CPU from the triangles of the pixels: depths by the plane,
/// as in rasterizeTriangle.
struct FillVisibility {
    TriangleView triangles;
    ViewRays view;
    View<const uint32_t> seen;
    View<uint64_t> visibility;

    void operator()(size_t i) const {
        visibility[i] = kNothingSeen;
        if (seen[i] == kBackground)
            return;
        const ViewTriangle t = loadViewTriangle(triangles, seen[i], view.origin);
        const double row = glm::dot(t.normal, view.first) +
                           double(i / view.width) * glm::dot(t.normal, view.stepY);
        const double along = row + double(i % view.width) * glm::dot(t.normal, view.stepX);
        const double depth = glm::dot(t.normal, t.corner[0]) / along;
        double nearest = 1e300, farthest = 0.0;
        for (const glm::dvec3& corner : t.corner) {
            nearest = glm::min(nearest, glm::dot(corner, view.forward));
            farthest = glm::max(farthest, glm::dot(corner, view.forward));
        }
        const double seenDepth = glm::max(depth, double(float(nearest))); // SeenTriangle::depthAt
        nearest = glm::max(view.znear, nearest * (1.0 - kMostBeyond));
        farthest = glm::min(view.zfar, farthest * (1.0 + kMostBeyond));
        if (!(depth >= nearest && depth <= farthest))
            return;
        visibility[i] = uint64_t(std::bit_cast<uint32_t>(float(seenDepth))) << 32 | seen[i];
    }
};

GlDefines gbufferDefines(const GlInfo& info) {
    GlDefines defines = numericDefines(info);
    defines.emplace_back("SDAG_PARALLEL_SIDES", glslConstant(kParallelSides));
    return defines;
}

} // namespace

GlGBuffer::GlGBuffer(const GlContext& context, GlGeometry& geometry)
    : context_(context), geometry_(geometry),
      program_("g-buffer",
               {{GlStage::kVertex, "hybrid/gl/gbuffer.vert"},
                {GlStage::kFragment, "hybrid/gl/gbuffer.frag"}},
               glGlsl() + scenesGlsl() + hybridGlsl(), gbufferDefines(context.info())) {}

void GlGBuffer::warmUp() {
    commands_.set({{3, 1, 0, 0}});
    target_.bind(1, 1, kBackground);
    geometry_.bind(program_);
    commands_.draw(program_, 0, geometry_.hasTriangles() ? 1 : 0);
    context_.finish("preparing the g-buffer");
}

void GlGBuffer::draw(const TriangleView& triangles, const BatchView& batches, const ViewRays& view,
                     GBuffer& gbuffer) {
    gbuffer.resize(view.width, view.height);
    std::vector<GlCommand> commands;
    for (size_t b = 0; b < batches.batches.count; ++b)
        if (mayBeSeen(batches.boxesWorld[b], view))
            commands.push_back({3 * batches.batches[b].count, 1, 3 * batches.batches[b].first, 0});
    commands_.set(commands);
    target_.bind(int(view.width), int(view.height), kBackground);
    geometry_.bind(program_);
    program_.set("viewOrigin", view.origin);
    program_.set("viewRight", view.right);
    program_.set("viewUp", view.up);
    program_.set("viewForward", view.forward);
    program_.set("viewFirst", view.first);
    program_.set("viewStepX", view.stepX);
    program_.set("viewStepY", view.stepY);
    program_.set("firstX", view.firstX);
    program_.set("firstY", view.firstY);
    program_.set("pixelSize", view.pixelSize);
    program_.set("znear", view.znear);
    program_.set("zfar", view.zfar);
    program_.set("viewWidth", double(view.width));
    program_.set("viewHeight", double(view.height));
    GlSlices slices(context_, commands_.count(), "the g-buffer");
    while (slices.next())
        commands_.draw(program_, uint32_t(slices.begin()), uint32_t(slices.end()));
    target_.read(seen_);
    context_.finish("the g-buffer");
    parallelFor<CpuTag>(seen_.size(),
                        FillVisibility{triangles, view, viewOf(seen_), gbuffer.visibility.view()},
                        4096);
    runPass(Backend::kCpu, gbuffer.resolvePass(triangles, view));
}

} // namespace shadowdag
