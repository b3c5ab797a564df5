// SPDX-License-Identifier: Apache-2.0
// What the truth holds: Embree's scene and the triangles in the local frame. Only for truth*.cpp.
#pragma once

#include "hybrid/truth.h"

#include <embree3/rtcore.h>

#include <string>
#include <vector>

namespace shadowdag {

/// The receiver as the ray set-up needs it; the same for all lights of a sample.
struct TruthReceiver {
    uint32_t triangle;
    glm::dvec3 sample; ///< local
    double clearance;  ///< c of the head of truth.h
    glm::dvec3 normal; ///< unit, towards the light's side
    double offset;     ///< normal . x over the plane
    bool hasTriangle;  ///< the rest is set
    glm::dvec3 corner[3];
    glm::dvec3 inward[3]; ///< per edge: unit, in the plane, towards the triangle
    double inwardOffset[3];

    double height(const glm::dvec3& p) const { return glm::dot(normal, p) - offset; }
    double inside(int edge, const glm::dvec3& p) const {
        return glm::dot(inward[edge], p) - inwardOffset[edge];
    }
};

struct Truth::State {
    State();
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void build(const TriangleView& source);
    glm::dvec3 vertex(uint32_t triangle, int corner) const {
        return glm::dvec3(glm::vec3(vertices[triangles[triangle][corner]]));
    }
    /// Returns c of the head of truth.h for a receiver: its corners and the sample decide M.
    double clearance(const glm::dvec3& sampleLocal, uint32_t triangle) const;
    TruthReceiver receiver(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                           uint32_t triangle) const;

    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::string lastError;
    glm::dvec3 origin{0.0};
    double diagonal = 0; ///< of the bounds
    std::vector<glm::vec4>
        vertices; ///< local; 16 bytes each because Embree reads a float past the third
    std::vector<glm::uvec3> triangles;
};

/// Returns where the receiver's own ray starts.
glm::vec3 truthStart(const TruthReceiver& receiver);
/// Returns the float point next to p at least c above the receiver's plane, moved along the normal
/// only.
glm::vec3 liftOffPlane(const TruthReceiver& receiver, glm::dvec3 p);
/// Returns the ray from `start` to a light, raised to c above the receiver's plane.
TruthRay truthRay(const TruthReceiver& receiver, const glm::vec3& start, glm::dvec3 lightLocal);

} // namespace shadowdag
