// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/visible_surface.h"

#include "hybrid/frame/host_copy.h"
#include "hybrid/gbuffer/resolve_base_color.h"

namespace shadowdag {

void VisibleSurface::draw(const ViewRays& view, StageTimes& stages) {
    const StageTimer timer(context_.backend, stages, "g-buffer");
    context_.device.drawGBuffer(context_.scene.triangles(), context_.scene.batches(), view,
                                gbuffer_);
    const BaseColorView colors = context_.scene.baseColors();
    if (colors.empty())
        return;
    gbuffer_.baseColor.resize(gbuffer_.view().count());
    runPass(context_.backend,
            ResolveBaseColor{context_.scene.triangles(), view, gbuffer_.view().triangle,
                             context_.scene.triangleMaterial(), context_.scene.triangleInstance(),
                             context_.scene.materials(), colors, gbuffer_.baseColor.view()});
}

GBufferView VisibleSurface::hostView() {
    const GBufferView view = gbuffer_.view();
    const auto onHost = [&](const auto& array, auto& copy) {
        return copyToHost(context_.backend, array, copy);
    };
    return {onHost(view.positionWorld, host_.positionWorld),
            onHost(view.normalWorld, host_.normalWorld),
            onHost(view.depthView, host_.depthView),
            onHost(view.triangle, host_.triangle),
            view.width,
            view.height,
            onHost(view.baseColor, host_.baseColor)};
}

} // namespace shadowdag
