// SPDX-License-Identifier: Apache-2.0
// The device that draws and shades the frames of a backend: the passes of the CPU and CUDA, or a
// backend with its own hardware path, which implements these interfaces in its own folder.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/frame/shade.h"
#include "hybrid/gbuffer/gbuffer_pass.h"

#include <memory>

namespace shadowdag {

class MapDrawer;

/// The state of one renderer on the device.
class FrameDevice {
public:
    virtual ~FrameDevice() = default;

    /// Makes the device current on this thread for the lifetime of the result; null: it always is.
    virtual std::shared_ptr<void> makeCurrent() const { return nullptr; }
    /// Throws Error kUsage naming an option that the device does not support.
    virtual void checkOptions(const FrameOptions&) const {}
    /// Returns the options as the device applies them.
    virtual FrameOptions followed(const FrameOptions& options) const { return options; }
    /// Returns what has been copied to the device and back so far.
    virtual HostCopyCounts copyCounts() const { return hostCopyCounts(); }

    /// Fills the G-buffer with the view's visible samples (drawGBuffer). Views are on the backend.
    virtual void drawGBuffer(const TriangleView& triangles, const BatchView& batches,
                             const ViewRays& view, GBuffer& gbuffer) = 0;
    /// Returns the drawer that draws shadow maps and holds their pages, as ShadowMaps takes it;
    /// null: the passes.
    virtual MapDrawer* mapDrawer() { return nullptr; }
    /// Returns the depths of all pages on the host if the device holds them, else `depths`. @param
    /// copy memory for them
    virtual View<const uint32_t> hostDepths(View<const uint32_t> depths,
                                            std::vector<uint32_t>& copy) = 0;
    /// Shades every sample by all its lights.
    /// @param pairLights with a recorder: PairSet::light
    virtual void shade(const ShadeSamples& work, View<const uint32_t> pairLights) = 0;
};

/// The scene in the device's memory, shared by renderers of one scene as FrameScene is.
class SceneDevice {
public:
    virtual ~SceneDevice() = default;

    /// Follows World::setTime.
    virtual void setPositions(View<const glm::vec3>) {}
    /// Returns the state of another renderer. The scene outlives it.
    virtual std::unique_ptr<FrameDevice> makeFrame() = 0;
};

/// Returns the device of `backend`. Throws Error kDevice if there is none. @param
/// triangles,batchTriangles,dag on the host; outlive it
std::unique_ptr<SceneDevice> makeSceneDevice(Backend backend, const TriangleView& triangles,
                                             View<const uint32_t> batchTriangles,
                                             const DagView& dag);

/// The same for Backend::kGl; defined in hybrid/gl.
std::unique_ptr<SceneDevice> makeGlSceneDevice(const TriangleView& triangles,
                                               View<const uint32_t> batchTriangles,
                                               const DagView& dag);

} // namespace shadowdag
