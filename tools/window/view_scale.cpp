// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_scale.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

void RenderScale::note(float scale, double timeMs) {
    if (!(timeMs > 0.0) || !(scale > 0.0f))
        return;
    if (last_.scale > 0.0f && last_.scale != scale)
        other_ = last_;
    last_ = {scale, timeMs};
    const auto pixels = [](float s) { return double(s) * double(s); };
    double fixedMs = 0;
    if (other_.scale > 0.0f) {
        const double slope =
            (last_.timeMs - other_.timeMs) / (pixels(last_.scale) - pixels(other_.scale));
        fixedMs = std::clamp(timeMs - slope * pixels(scale), 0.0, 0.98 * timeMs);
    }
    const double perPixels = (timeMs - fixedMs) / pixels(scale);
    const auto costs = [&](float s) { return fixedMs + perPixels * pixels(s); };
    const double allowed = std::max(targetMs_, 1.5 * fixedMs);
    constexpr float kStep = 0.125f;
    float wanted = kLeast;
    while (wanted + kStep <= 1.0f && costs(wanted + kStep) <= allowed)
        wanted += kStep;
    // Up by one step at a time, and only with a quarter of the time to spare, so that the size does
    // not alternate.
    if (wanted > scale)
        wanted = 1.25 * costs(std::min(scale + kStep, 1.0f)) < allowed
                     ? std::min(scale + kStep, 1.0f)
                     : scale;
    scale_ = wanted;
}

} // namespace shadowdag
