// SPDX-License-Identifier: Apache-2.0
// The view samples of a frame: one per pixel.
#pragma once

#include "cuda/buffer.h"
#include "scenes/world.h"

namespace shadowdag {

constexpr uint32_t kBackground = 0xffffffffu;

/// Samples in scanline order, index = y * width + x.
/// positionWorld: count * vec3; normalWorld: count * unit geometric normal, flipped to the camera;
/// depthView: count, distance along the camera's forward axis, metres; triangle: count, world
/// triangle index, kBackground where nothing is seen (then the other three are zero). baseColor:
/// count, linear, zero where nothing is seen; empty in scenes without base colour textures.
struct GBufferView {
    View<const glm::vec3> positionWorld;
    View<const glm::vec3> normalWorld;
    View<const float> depthView;
    View<const uint32_t> triangle;
    uint32_t width = 0, height = 0;
    View<const glm::vec3> baseColor = {};

    SDAG_HD size_t count() const { return size_t(width) * height; }
    /// Returns the base colour of a sample. @param factor that of its material
    SDAG_HD glm::vec3 baseColorOr(size_t sample, const glm::vec3& factor) const {
        return baseColor.empty() ? factor : baseColor[sample];
    }
};

} // namespace shadowdag
