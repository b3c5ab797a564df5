// SPDX-License-Identifier: Apache-2.0
// What a view of a scene is worth, judged by a few rays: how much and how varied what it sees is,
// whether it shows whole objects, and what the lights do there. placeCameras chooses by
// it.
#pragma once

#include "scenes/open_space.h"
#include "scenes/world.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// What one ray of a view sees.
struct ViewSample {
    bool isHit = false, isFront = false;
    float distance = 0.0f;
    glm::vec3 position{0.0f}, normal{0.0f}; ///< the normal towards the eye, unit or zero
};

/// What the lights do in a view.
struct ViewLight {
    size_t hitCount = 0;         ///< samples that hit something
    size_t pairCount = 0;        ///< samples times lights that reach and face them
    size_t tracedCount = 0;      ///< of the pairs, those for which a shadow ray was traced
    size_t darkCount = 0;        ///< of these
    size_t reachedCount = 0;     ///< samples that are in a pair
    size_t litCount = 0;         ///< samples that a traced light lights
    std::vector<uint8_t> isSeen; ///< a light: it lights some sample

    size_t seenCount() const;
    /// Adds what the lights do in another view.
    ViewLight& operator+=(const ViewLight& other);
};

/// Judges views. Deterministic; assumes no scale; uses no libm but the square root.
/// @param world, open must outlive this and not move.
/// @param unit length by which near is told from far, > 0 unless the scene is a point
class ViewScore {
public:
    ViewScore(const World& world, const OpenSpace& open, float unit);

    /// Returns the share of rays that escape from the quarter of the stations where fewest do.
    float typicalEscape() const { return typicalEscape_; }

    /// Returns what a ray sees.
    ViewSample look(const glm::vec3& eye, const glm::vec3& direction) const;

    /// Returns what the lights do in a view, by up to `raysASample` shadow rays a sample, to lights
    /// that are spread evenly over those that reach it.
    ViewLight light(const std::vector<ViewSample>& view, size_t raysASample) const;

    /// Returns the worth of what a view of rows of `width` samples sees, whatever its lights: how
    /// far it reaches, how varied it is, and how many of its rays hit what stands before the eye,
    /// escape, or see the back of surfaces.
    /// @param allowedEscape share of rays that may escape, at least what is usual here
    float shape(const std::vector<ViewSample>& view, int width, float allowedEscape = 0.1f) const;

    /// Returns a factor from 0.5 to 1: how much of the view are objects that lie in it as a whole,
    /// less what the frame cuts off in front. An object is what jumps of depth or normal part from
    /// the rest.
    float wholeObjects(const std::vector<ViewSample>& view, int width) const;

    /// Returns the worth of a view's lights, from 0.02 to about 1; 1 in a world without lights. It
    /// grows with the lights a sample (best up to 16), the lights that light something, the share
    /// of samples that are lit; best where 3/10 to 6/10 of the shadow rays are dark.
    float lightWorth(const ViewLight& light) const;

private:
    static bool isEdge(const ViewSample& a, const ViewSample& b);
    static int binOf(const ViewSample& s, float unit);

    const World& world_;
    const OpenSpace& open_;
    float unit_;
    float typicalEscape_ = 0.0f;
};

} // namespace shadowdag
