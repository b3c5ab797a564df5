// SPDX-License-Identifier: Apache-2.0
// The device of the backends that run the passes alone.
#include "hybrid/frame/frame_device.h"

#include "hybrid/frame/host_copy.h"
#include "hybrid/frame/shade_pass.h"

namespace shadowdag {

namespace {

class PassFrame final : public FrameDevice {
public:
    explicit PassFrame(Backend backend) : backend_(backend) {}

    void drawGBuffer(const TriangleView& triangles, const BatchView& batches, const ViewRays& view,
                     GBuffer& gbuffer) override {
        shadowdag::drawGBuffer(backend_, triangles, batches, view, gbuffer);
    }
    View<const uint32_t> hostDepths(View<const uint32_t> depths,
                                    std::vector<uint32_t>& copy) override {
        return copyToHost(backend_, depths, copy);
    }
    /// In two passes: first the radiance without lights.
    void shade(const ShadeSamples& work, View<const uint32_t>) override {
        shadeUnlit(backend_, work);
        shadeLights(backend_, work);
    }

private:
    Backend backend_;
};

class PassScene final : public SceneDevice {
public:
    explicit PassScene(Backend backend) : backend_(backend) {}

    std::unique_ptr<FrameDevice> makeFrame() override {
        return std::make_unique<PassFrame>(backend_);
    }

private:
    Backend backend_;
};

} // namespace

std::unique_ptr<SceneDevice> makeSceneDevice(Backend backend, const TriangleView& triangles,
                                             View<const uint32_t> batchTriangles,
                                             const DagView& dag) {
    if (backend == Backend::kGl)
        return makeGlSceneDevice(triangles, batchTriangles, dag);
    return std::make_unique<PassScene>(backend);
}

} // namespace shadowdag
