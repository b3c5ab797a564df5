// SPDX-License-Identifier: Apache-2.0
// Shadow rays by Embree as a renderer would use it: packets of one light, as wide as the
// processor's vectors, coherent, a hierarchy of high quality, not robust. The peer of our rays in a
// frame (TriangleRays::kEmbree); not the truth, which takes precautions against every rounding
// (hybrid/judge/truth.h).
#pragma once

#include "scenes/light.h"
#include "scenes/world.h"

#include <memory>

namespace shadowdag {

/// How Embree builds and traces a scene; the defaults are its fastest.
struct EmbreeSceneOptions {
    bool isRobust = false;      ///< RTC_SCENE_FLAG_ROBUST
    bool useHighQuality = true; ///< RTC_BUILD_QUALITY_HIGH (spatial splits)
};

/// Embree over a set of triangles, with the best instruction set of the machine. Triangles are
/// copied.
class EmbreeScene {
public:
    /// @param which indices of triangles
    /// Throws Error kInput when a coordinate is beyond 1e18, kResource when Embree cannot build.
    EmbreeScene(const TriangleView& triangles, View<const uint32_t> which,
                const EmbreeSceneOptions& options = {});
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// Returns how many rays a packet has: 16 where the processor has vectors of 16 floats that
    /// Embree uses (AVX-512), 8 elsewhere, where packets of 16 are slower.
    uint32_t packetWidth() const;

    /// Sets blocked[i] to whether rtcOccluded16 or rtcOccluded8, by packetWidth(), finds a triangle
    /// between sample which[i], lifted off its surface (liftedSample), and the light: 1 or 0. Rays
    /// go from a point light to the samples, and from samples to a directional light. Thread-safe.
    /// Answers at edges depend on which rays share a packet.
    /// @param positionsWorld,normalsWorld of the samples; normals unit, on the light's side
    /// @param blocked which.count
    void trace(const Light& light, View<const glm::vec3> positionsWorld,
               View<const glm::vec3> normalsWorld, View<const uint32_t> which,
               View<uint8_t> blocked) const;

    /// Returns the bytes of Embree's structures and of the copied triangles.
    uint64_t bytes() const;

    /// For files that call Embree: embree_scene_state.h.
    struct State;
    const State& state() const { return *state_; }

private:
    std::unique_ptr<State> state_;
};

/// Returns a sample moved along its normal by 2^-18 of the largest coordinate of the sample and of
/// the way that a ray comes from its light, so that the ray does not hit the sample's own surface.
/// The 256 units in the last place on each axis of Waechter and Binder, "A Fast and Robust Method
/// for Avoiding Self-Intersection", Ray Tracing Gems, 2019, are for rays that start at the sample;
/// for those that end there they are too little where an axis is near 0 and the light is far.
/// @param wayWorld 0 for rays that start at the sample
glm::vec3 liftedSample(const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                       const glm::vec3& wayWorld);

} // namespace shadowdag
