// SPDX-License-Identifier: Apache-2.0
// The size at which a moving picture is rendered, so that it keeps up with the camera.
#pragma once

namespace shadowdag {

/// Chooses the scale of the next picture from the times of the previous ones. The cost of a picture
/// is modelled as a constant plus a term proportional to its pixels, fitted to the last two scales.
/// If the constant alone exceeds the target, the pixels may cost half of it in addition, because a
/// smaller picture would gain little.
class RenderScale {
public:
    static constexpr float kLeast = 0.125f;

    /// @param targetMs what a moving picture may take
    explicit RenderScale(double targetMs) : targetMs_(targetMs) {}

    /// Records the time of a picture at a scale.
    void note(float scale, double timeMs);
    /// Returns the scale of the next moving picture, from kLeast to 1, in steps of an eighth.
    float next() const { return scale_; }
    /// Forgets the recorded times, when something else is rendered.
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
