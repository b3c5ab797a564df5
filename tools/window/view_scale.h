// SPDX-License-Identifier: Apache-2.0
// How large the picture is rendered while it moves, so that it keeps up.
#pragma once

namespace shadowdag {

/// Chooses the scale of the next picture from how long those before took. What a picture costs is
/// taken for a part that does not depend on its size and a part that goes with its pixels, told
/// apart by the last two scales. Where the first alone is over the target, pixels may cost half as
/// much again: making the picture smaller still would gain little.
class RenderScale {
public:
    static constexpr float kLeast = 0.125f;

    /// @param targetMs what a moving picture may take
    explicit RenderScale(double targetMs) : targetMs_(targetMs) {}

    /// Notes what a picture of a scale took.
    void note(float scale, double timeMs);
    /// Returns the scale of the next moving picture, from kLeast to 1, in steps of an eighth.
    float next() const { return scale_; }
    /// Forgets: what is rendered now is something else.
    void reset() { *this = RenderScale(targetMs_); }

private:
    struct Sample {
        float scale = 0; ///< 0: none
        double timeMs = 0;
    };
    double targetMs_;
    float scale_ = 0.25f;
    Sample last_, other_; ///< the newest, and the newest of another scale
};

} // namespace shadowdag
