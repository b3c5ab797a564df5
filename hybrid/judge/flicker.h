// SPDX-License-Identifier: Apache-2.0
// Flicker: answers that change from a frame to the next where Embree's do not.
//
// Points are seeded samples of a frame, followed as points of their triangle into the next frame.
// Those that both frames see are answered by each frame for itself: in the first by what it showed,
// in the second at the point's own place by whatever serves the light in the nearest sample beside
// it (3 x 3 pixels). An answer is a point and a light that are a pair in both frames. It flickers
// when dark becomes lit or lit dark and Embree's answer stays: then exactly one of the two is
// wrong, and it is explained, acne or contact where that wrong answer is (explain.h). Counted
// apart: answers by maps of one resolution or by one method in both frames, those whose map's
// resolution was switched, those whose method was.
#pragma once

#include "hybrid/judge/error.h"
#include "scenes/camera.h"

#include <array>
#include <cstdint>
#include <vector>

namespace shadowdag {

/// What happened between two frames to what serves an answer.
enum class FlickerChange : uint8_t { kHeld, kResolutionSwitch, kMethodSwitch };
constexpr int kFlickerChangeCount = 3;

struct FlickerCounts {
    struct Class {
        uint64_t answerCount = 0;    ///< asked in both frames, Embree's answer the same
        uint64_t flickerCount = 0;   ///< of these, changed
        uint64_t explainedCount = 0; ///< of these, explained by the resolution of the wrong answer
        uint64_t contactCount = 0;
        uint64_t acneCount = 0;

        void add(const Class& other);
    };
    uint64_t pointCount = 0;       ///< points that both frames see
    uint64_t truthChangeCount = 0; ///< answers that Embree changes itself: not judged
    uint64_t unansweredCount = 0;  ///< no sample beside the point has the light
    uint64_t missingTapCount = 0;  ///< answers whose taps want pages that the frame has not: a
                                   ///< filter wider than what the samples beside it marked
    std::array<Class, kFlickerChangeCount> byChange; ///< index: FlickerChange

    const Class& of(FlickerChange change) const { return byChange[size_t(change)]; }
    Class total() const;
    void add(const FlickerCounts& other);
};

/// A rendered frame: its answers as the error analysis takes them, and its camera.
struct FlickerFrame {
    const ErrorInputs& inputs;
    Camera camera;
};

/// Follows points from frame to frame.
class FlickerMeter {
public:
    /// @param truth holds, whenever add is called, the triangles of that frame
    /// @param pointCount how many points are followed; fewer where a frame does not hold as many
    FlickerMeter(const Truth& truth, uint64_t seed, uint32_t pointCount)
        : truth_(truth), seed_(seed), pointCount_(pointCount) {}

    /// Returns what changed since the frame given last (nothing for the first), and draws the
    /// points that the next will be held against. Deterministic. Throws Error kUsage when the
    /// inputs do not have one answer per pair.
    FlickerCounts add(const FlickerFrame& frame);

    /// Forgets the frame given last.
    void forget();
    /// Passes over a frame that was answered elsewhere: as forget, but the frames that follow draw
    /// the points that they would draw after it.
    void skip();

private:
    struct Answer {
        uint32_t light;
        uint32_t servedBy; ///< servedBy() of flicker.cpp
        bool isDark, isTruthDark;
        PairVerdict verdict; ///< kRight unless the answer is wrong
    };
    struct Point {
        glm::vec3 positionWorld, normalWorld;
        uint32_t triangle;
        std::array<glm::vec3, 3> corners; ///< world, in the frame that it was drawn in
        glm::dvec3 barycentric;           ///< of the position among them
        uint32_t firstAnswer, answerCount;
    };

    void draw(const FlickerFrame& frame);
    FlickerCounts follow(const FlickerFrame& frame) const;

    const Truth& truth_;
    uint64_t seed_;
    uint32_t pointCount_;
    uint64_t frameCount_ = 0; ///< given so far: every frame draws other points
    std::vector<Point> points_;
    std::vector<Answer> answers_;
};

} // namespace shadowdag
