// SPDX-License-Identifier: Apache-2.0
#include "tools/view_scale.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

void RenderScale::note(float scale, double timeMs) {
    if (!(timeMs > 0.0))
        return;
    constexpr float kStep = 0.125f;
    const double fits = double(scale) * std::sqrt(targetMs_ / timeMs);
    const float steps = float(std::floor(fits / kStep));
    float wanted = std::clamp(steps * kStep, kLeast, 1.0f);
    // Up by one step at a time, and only where a quarter is to spare: no see-saw between two sizes.
    if (wanted > scale)
        wanted = timeMs * 1.25 * double((scale + kStep) * (scale + kStep)) / double(scale * scale) <
                         targetMs_
                     ? std::min(scale + kStep, 1.0f)
                     : scale;
    scale_ = wanted;
}

} // namespace shadowdag
