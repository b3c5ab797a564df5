// SPDX-License-Identifier: Apache-2.0
// Embree's results for one frame of a scene, for the tests of the built-in scenes.
#pragma once

#include "hybrid/rays/embree_version.h"
#include "scenes/world.h"

namespace shadowdag {

/// The triangles of a world at its current time as Embree sees them.
class EmbreeWorld {
public:
    /// @param originWorld becomes the origin of all rays: floats are too coarse far from
    /// theirs.
    explicit EmbreeWorld(const World& world, const glm::dvec3& originWorld = glm::dvec3(0.0));
    ~EmbreeWorld();
    EmbreeWorld(const EmbreeWorld&) = delete;
    EmbreeWorld& operator=(const EmbreeWorld&) = delete;

    /// Returns the nearest hit from `origin` along `direction` (tfar is infinite without one).
    RTCRayHit trace(const glm::vec3& origin, const glm::vec3& direction, float tnear = 0.0f) const;
    /// Returns whether anything lies on the open segment.
    bool blocked(const glm::vec3& from, const glm::vec3& to) const;

private:
    std::vector<glm::vec3>
        positions_;       // one more than needed: Embree reads 16 bytes at the last vertex
    AlphaMaskView masks_; // of the world
    RTCDevice device_;
    RTCScene scene_;
};

/// What a frame holds. A pair is a sample and a light whose range holds it and that its normal,
/// flipped to the camera, faces.
struct FrameCounts {
    uint64_t sampleCount = 0, pairCount = 0, darkCount = 0;
    uint64_t fightCount =
        0; ///< samples with a second surface of another colour within 0.1 mm behind
};

/// Counts over one frame of the world's first camera.
FrameCounts countFrame(const World& world, int width, int height);

} // namespace shadowdag
