// SPDX-License-Identifier: Apache-2.0
// The truth: Embree's result for every pair. Only this and embree_baseline use Embree.
//
// Definition. The triangles are exactly their floats in world space. A pair is dark when a triangle
// other than the receiver's crosses the truth ray strictly between its ends. The ray
//  - starts above the receiver's plane by at least c, on the light's side, and inside the
//    receiver's outline by c if the triangle is wide enough: the G-buffer's error is measured
//    against the triangle, not estimated;
//  - ends at the light, raised to c above that plane if it is lower, and is cut at 1 - 16 u of its
//    length;
//  - ignores the receiver's own triangle: it is flat, and the whole ray is above it.
// With u = 2^-24, M the largest coordinate of receiver and sample and L the diagonal of the bounds,
//     c = 4 u M + 16 u L.
// Derivation: tessellated or doubled flat surfaces are flat only to the rounding of their vertices.
// World::setTime adds rotated vertices (error about 4 u L) to a translation (u M, half an ulp); a
// plane through three of them is off by sqrt(3) of that, two planes by 2 sqrt(3) < 4 times. Below c
// surfaces count as one surface (`fail-coplanar`), above they shadow each other.
//
// Embree's distances along the ray are float, and arbitrarily wrong for slivers and grazing rays.
// Each hit that it reports is therefore confirmed in double, 0 < t < end, so a surface that touches
// only an end never blocks. Its edge tests are its own (robust, watertight). A triangle seen
// edge-on does not block, nor one whose alpha mask is open at the crossing (scenes/alpha_mask.h).
// Not guaranteed: that a blocker nearer than c to the sample is found, nor the result for a ray
// through an outer edge within rounding.
#pragma once

#include "hybrid/clusters/pairs.h"
#include "hybrid/rays/truth_ray.h"
#include "scenes/world.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// The blocker of a pair in the truth.
struct TruthBlocker {
    uint32_t triangle = kBackground; ///< world triangle, kBackground when lit
    float distanceWorld = 0;         ///< from the sample
};

/// Embree over the triangles of a world at its current time. Robust flag; both ends are moved by a
/// derived error bound so that a ray does not hit the receiver itself; rays end short of the light.
/// The processor's float mode is saved and restored around Embree's calls. Const functions are
/// thread safe. Embree is restricted to AVX2 (isa=avx2): the same results on every machine that
/// runs the program.
class Truth {
public:
    /// Builds over all triangles (static and moving), two-sided. Throws Error kInput when a
    /// position is beyond 1e18 (Embree would leave the triangle out), kResource when Embree cannot
    /// build.
    explicit Truth(const World& world);
    /// The same over bare triangles on the host; they are copied.
    explicit Truth(const TriangleView& triangles);
    ~Truth();

    /// Rebuilds after World::setTime.
    void update(const World& world);
    void update(const TriangleView& triangles);

    /// Returns per pair 255 (lit) or 0 (dark). Deterministic: the same for every thread count.
    std::vector<uint8_t> visibility(const GBufferView& gbuffer, const std::vector<Light>& lights,
                                    const PairList& pairs) const;

    /// Returns whether the segment between two world points is blocked; the ends are used as given
    /// (rounded to the local frame); a surface that only touches an end does not block.
    bool isBlocked(const glm::vec3& from, const glm::vec3& to) const;
    /// Returns the blocker nearest to the start of a pair's own truth ray.
    TruthBlocker blocker(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                         uint32_t receiverTriangle, const glm::vec3& lightWorld) const;

    /// Returns the truth ray of a pair. @param receiverTriangle kBackground: the plane through
    /// sample and normal is used
    TruthRay pairRay(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                     uint32_t receiverTriangle, const glm::vec3& lightWorld) const;
    /// Writes the pair's ray with both ends shifted by one vector, for each of `count` vectors, the
    /// start lifted back to c above the receiver's plane where it lies lower.
    void shiftedPairRays(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                         uint32_t receiverTriangle, const glm::vec3& lightWorld,
                         const glm::dvec3* shiftsWorld, size_t count, TruthRay* rays) const;
    /// Returns the segment between two world points in the form that isBlocked uses.
    TruthRay segmentRay(const glm::vec3& fromWorld, const glm::vec3& toWorld) const;

    /// Writes 1 (blocked) or 0 for each ray, on the calling thread, in packets of 8: neighbours
    /// should be coherent.
    void traceBlocked(const TruthRay* rays, size_t count, uint8_t* blocked) const;
    /// Returns the first triangle along the ray and, in `t`, where; kBackground when none.
    uint32_t traceFirst(const TruthRay& ray, float* t = nullptr) const;

    /// Calls visit(triangle) once for each triangle that may come within `radiusWorld` of a point;
    /// it may also call it for others nearby.
    void forTrianglesNear(const glm::dvec3& centerWorld, double radiusWorld,
                          const std::function<void(uint32_t)>& visit) const;
    /// Returns whether triangle `other` lies in the plane of `triangle` to within c; true for the
    /// triangle itself.
    bool isCoplanar(uint32_t triangle, uint32_t other) const;

    /// Returns c of this file's head for a sample on a triangle (kBackground: for the sample
    /// alone).
    double clearance(const glm::vec3& sampleWorld, uint32_t receiverTriangle) const;
    /// Returns the world point that is the local frame's origin (TruthSpace), which gives scenes
    /// far from the world's origin their full precision.
    const glm::dvec3& originWorld() const;

    struct State; ///< of truth_state.h, for the implementation

private:
    std::unique_ptr<State> state_;
};

/// Returns the version of Embree that the program was compiled with, as in "3.13.5".
std::string embreeVersion();

} // namespace shadowdag
