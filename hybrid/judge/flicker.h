// SPDX-License-Identifier: Apache-2.0
// Flicker: results that change from one frame to the next while Embree's do not.
//
// Points are seeded samples of a frame, followed as points of their triangle into the next frame.
// Each frame gives results for those visible in both: the first those that it showed, the second
// those at the point's own position, by the method of the light in the nearest sample beside it (3
// x 3 pixels). A result is of a point and a light that are a pair in both frames. It flickers when
// dark becomes lit or lit dark and Embree's result stays: then exactly one of the two is wrong, and
// it is explained, acne or contact if that wrong result is (explain.h). Counted separately: results
// by maps of one resolution or by one method in both frames, those whose map's resolution changed,
// those whose method changed.
#pragma once

#include "hybrid/judge/error.h"
#include "scenes/camera.h"

#include <array>
#include <cstdint>
#include <vector>

namespace shadowdag {

/// The change between two frames of the source of a result.
enum class FlickerChange : uint8_t { kHeld, kResolutionSwitch, kMethodSwitch };
constexpr int kFlickerChangeCount = 3;

struct FlickerCounts {
    struct Class {
        uint64_t answerCount = 0;    ///< traced in both frames, with the same result by Embree
        uint64_t flickerCount = 0;   ///< of these, changed
        uint64_t explainedCount = 0; ///< of these, explained by the resolution of the wrong result
        uint64_t contactCount = 0;
        uint64_t acneCount = 0;
        uint64_t magnifiedCount = 0;

        void add(const Class& other);
    };
    uint64_t pointCount = 0;         ///< points visible in both frames
    uint64_t truthChangeCount = 0;   ///< results that change in Embree as well: not judged
    uint64_t missingResultCount = 0; ///< no sample beside the point has the light
    uint64_t missingTapCount = 0;    ///< results whose taps need pages that no sample beside the
                                     ///< point reads (PageMarks): not judged
    std::array<Class, kFlickerChangeCount> byChange; ///< index: FlickerChange

    const Class& of(FlickerChange change) const { return byChange[size_t(change)]; }
    Class total() const;
    void add(const FlickerCounts& other);
};

/// A rendered frame: its results in the form of the error analysis, and its camera.
struct FlickerFrame {
    const ErrorInputs& inputs;
    Camera camera;
};

/// Follows points from frame to frame.
class FlickerMeter {
public:
    /// @param truth holds, whenever add is called, the triangles of that frame
    /// @param pointCount number of points to follow; fewer if a frame has fewer
    FlickerMeter(const Truth& truth, uint64_t seed, uint32_t pointCount)
        : truth_(truth), seed_(seed), pointCount_(pointCount) {}

    /// Returns the changes since the last frame (none for the first), and draws the points that the
    /// next will be compared with. Deterministic. Throws Error kUsage if the inputs do not have one
    /// visibility per pair.
    FlickerCounts add(const FlickerFrame& frame);

    /// Forgets the last frame.
    void forget();
    /// Skips a frame that is evaluated elsewhere: as forget, but the following frames draw the same
    /// points as after it.
    void skip();

private:
    struct Answer {
        uint32_t light;
        uint32_t servedBy; ///< servedBy() of flicker.cpp
        bool isDark, isTruthDark;
        PairVerdict verdict; ///< kRight unless the result is wrong
    };
    struct Point {
        glm::vec3 positionWorld, normalWorld;
        uint32_t triangle;
        std::array<glm::vec3, 3> corners; ///< world, in the frame that it was drawn in
        glm::dvec3 barycentric;           ///< of the position among them
        uint32_t firstResult, answerCount;
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
