// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/page_marker.h"

#include "hybrid/frame/lookup_pages_pass.h"

namespace shadowdag {

namespace {

/// Marks the pages that the lookups of samples read.
class SamplePageMarker final : public PageMarker {
public:
    SamplePageMarker(Backend backend, const GBufferView& gbuffer, const ClusterView& clusters,
                     View<const MapReceiver> receivers, View<const Light> lights)
        : backend_(backend), gbuffer_(gbuffer), clusters_(clusters), receivers_(receivers),
          lights_(lights) {}

    void mark(const PageDemand& demand) const override {
        runPass(backend_, MarkLookupPages{gbuffer_, clusters_, receivers_, lights_, demand});
    }

private:
    Backend backend_;
    GBufferView gbuffer_;
    ClusterView clusters_;
    View<const MapReceiver> receivers_;
    View<const Light> lights_;
};

} // namespace

std::unique_ptr<PageMarker> pageMarkerOf(const FrameContext& context, const VisibleSurface& surface,
                                         const FrameClusters& clusters,
                                         View<const MapReceiver> receivers, PageMarks marks) {
    if (marks == PageMarks::kBoxes)
        return std::make_unique<BoxPageMarker>(context.backend, clusters.view().boxesWorld,
                                               receivers);
    return std::make_unique<SamplePageMarker>(context.backend, surface.view(), clusters.view(),
                                              receivers, context.scene.lights());
}

} // namespace shadowdag
