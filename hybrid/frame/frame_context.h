// SPDX-License-Identifier: Apache-2.0
// The context that all parts of a frame share.
#pragma once

#include "hybrid/frame/frame_device.h"
#include "hybrid/frame/frame_scene.h"

namespace shadowdag {

/// The backend of the passes, their input and the device. All of it outlives the parts.
struct FrameContext {
    Backend backend; ///< of passes and buffers: passBackend of the renderer's
    FrameScene& scene;
    FrameDevice& device;
};

} // namespace shadowdag
