// SPDX-License-Identifier: Apache-2.0
// Pictures of the internals of a frame: clusters, resolutions, pages, voxels, steps, errors.
#pragma once

#include "hybrid/frame.h"
#include "tools/window/view_request.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// A frame, and the truth's results so far.
struct OverlayInputs {
    const FrameRenderer& renderer; ///< whose last frame it is
    const World& world;
    const FrameResult& frame;
    const FrameOptions& options; ///< as it was rendered
    const ViewRequest& request;
    const Camera& camera;
    /// The lit scene as displayed, width * height.
    const std::vector<glm::vec3>& display;
    /// Per pair of the frame, or empty: the truth, and the frame's own result where that is not
    /// known yet.
    const std::vector<uint8_t>& truth;
};

/// A display picture and what its colours mean.
struct OverlayPicture {
    std::vector<glm::vec3> display;
    ViewLegend legend;
};

/// Returns the picture that request.overlay selects; kNone: the lit scene. If the frame lacks what
/// the overlay needs (voxels, a drawn map, pairs), the scene is grey and the legend says what is
/// missing.
OverlayPicture drawOverlay(const OverlayInputs& inputs);

/// One map, its six faces unfolded (+x and -x beside +z, -z; +y above, -y below) or the one window
/// of a directional light; rgba empty: the light has no drawn map.
struct UnfoldedMap {
    std::vector<uint8_t> rgba;
    uint32_t width = 0, height = 0;
    std::string title;
};

/// Returns the map of request.light, chosen as for overlays: nearer is brighter; pages without
/// memory are dark blue, with a grid at their borders; cells of the projection map without a
/// receiver are darkened.
UnfoldedMap drawUnfoldedMap(const OverlayInputs& inputs);

/// Returns a colour for a number in [0, 1]: from dark blue through grey to yellow, of increasing
/// lightness, safe for colour-blind readers.
glm::vec3 rampColor(float t);
/// Returns one of many clearly distinct colours for a number.
glm::vec3 hashColor(uint32_t number);

} // namespace shadowdag
