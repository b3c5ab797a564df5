// SPDX-License-Identifier: Apache-2.0
// The picture in the window, with the data to refine, redraw and save it. Internal to view_*.
#pragma once

#include "tools/window/view_overlay.h"
#include "tools/window/view_renderer.h"
#include "tools/window/view_truth.h"

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

inline bool isTruth(const ViewSide& side) {
    return methodOf(side.method).isTruth();
}

struct ViewShown {
    ViewRequest request;
    float scale = 1;
    bool isWhole = false; ///< it was rendered independently, at its full size
    Camera camera, look;  ///< of the frame, of the picture
    std::array<FrameOptions, 2> options;
    std::array<FrameResult, 2> frames; ///< of the sides by a method
    std::array<double, 2> truthMs{};
    std::vector<std::string> notes; ///< of rendering it
    PairList truthPairs;            ///< where no side recorded them
    const PairList* pairs = nullptr;
    GBufferView gbuffer;
    TruthRefinement refinement;
    bool asksTruth = false;
    std::array<ViewErrors, 2> errors;
    /// The parts that do not change while the truth is refined.
    struct Drawn {
        std::vector<uint8_t> rgba;
        ViewLegend legend;
    };
    std::array<Drawn, 2> drawn;
    UnfoldedMap map;
    std::optional<PixelReport> pixel;
    std::chrono::steady_clock::time_point start;

    bool shows(size_t side) const { return side == 0 || request.isSplit; }
    bool hasFrame(size_t side) const { return shows(side) && !isTruth(request.sides[side]); }
    /// Returns whether the frames recorded their pairs.
    bool hasPairs() const {
        for (size_t side = 0; side < 2; ++side)
            if (hasFrame(side) && frames[side].pairs.sampleStart.empty())
                return false;
        return true;
    }
    /// Returns whether a side's picture is the same until the next request.
    bool staysAsItIs(size_t side) const {
        return request.overlay == ViewOverlay::kVoxels ||
               (!isTruth(request.sides[side]) && !needsTruth(request.overlay));
    }
    bool hasErrors(size_t side) const {
        return asksTruth && hasFrame(side) && pairs != nullptr &&
               frames[side].visibility.size() == pairs->count();
    }
};

} // namespace shadowdag
