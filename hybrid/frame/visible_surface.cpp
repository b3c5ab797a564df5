// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/visible_surface.h"

#include "hybrid/frame/host_copy.h"

namespace shadowdag {

void VisibleSurface::draw(const ViewRays& view, StageTimes& stages) {
    const StageTimer timer(context_.backend, stages, "g-buffer");
    context_.device.drawGBuffer(context_.scene.triangles(), context_.scene.batches(), view,
                                gbuffer_);
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
            view.height};
}

} // namespace shadowdag
