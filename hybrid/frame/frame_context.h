// SPDX-License-Identifier: Apache-2.0
// What all pieces of a frame work with.
#pragma once

#include "hybrid/frame/frame_device.h"
#include "hybrid/frame/frame_scene.h"

namespace shadowdag {

/// Where passes run, what they read and what draws for them. All of it outlives the pieces.
struct FrameContext {
    Backend backend; ///< of passes and buffers: passBackend of the renderer's
    FrameScene& scene;
    FrameDevice& device;
};

} // namespace shadowdag
