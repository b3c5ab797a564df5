// SPDX-License-Identifier: Apache-2.0
// The state of the truth: Embree's scene and the triangles in the local frame. Only for truth*.cpp.
#pragma once

#include "hybrid/judge/truth.h"
#include "hybrid/rays/embree_version.h"

#include <string>
#include <vector>

namespace shadowdag {

/// A Geometry of truth_ray.h.
struct Truth::State {
    State();
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void build(const TriangleView& source);
    glm::dvec3 vertex(uint32_t triangle, int corner) const {
        return glm::dvec3(glm::vec3(vertices[triangles[triangle][corner]]));
    }
    AlphaMaskView masks() const { return maskSet.view(); }
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::string lastError;
    glm::dvec3 origin{0.0}; ///< these two: TruthSpace
    double diagonal = 0;
    std::vector<glm::vec4>
        vertices; ///< local; 16 bytes each because Embree reads a float past the third
    std::vector<glm::uvec3> triangles;
    AlphaMaskSet maskSet;
};

} // namespace shadowdag
