// SPDX-License-Identifier: Apache-2.0
// The pairs of one frame as a set of rays for other tracers: samples, lights, triangles, and which
// of them are asked, with all that the judge needs. docs/rays.md describes the file.
#pragma once

#include "hybrid/clusters/pairs.h"
#include "scenes/world.h"
#include "tools/settings/json.h"
#include "tools/workspace/array_file.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace shadowdag {

inline constexpr std::string_view kRaySetKind = "SDAGRAYS";

/// A set; every index is valid.
struct RaySet {
    // By sample: visible points, with the triangle that each lies on.
    std::vector<glm::vec3> positionWorld, normalWorld; ///< normal: unit, towards the camera
    std::vector<uint32_t> receiver, pixel;
    /// By light: w = 1: a point; w = 0: a vector towards a directional light, beyond the scene. The
    /// end of a pair's segment is xyz + (1 - w) * position.
    std::vector<glm::vec4> lightPoint;
    // By pair, in an order in which neighbours are coherent.
    std::vector<uint32_t> pairSample, pairLight;
    // World triangles, and what masks cut out of them.
    std::vector<glm::vec3> vertex;
    std::vector<glm::uvec3> triangle;
    AlphaMaskSet masks;
    Json about; ///< scene, view and program; for people, and for the rows of results

    size_t pairCount() const { return pairSample.size(); }
    TriangleView triangles() const { return {viewOf(vertex), viewOf(triangle), masks.view()}; }
    /// Returns the end of a pair's segment, as pointAtLight gives it.
    glm::vec3 pairEnd(size_t pair) const {
        const glm::vec4 light = lightPoint[pairLight[pair]];
        return light.w != 0.0f ? glm::vec3(light)
                               : positionWorld[pairSample[pair]] + glm::vec3(light);
    }
    /// Returns a pair's light, for functions that take lights.
    Light lightOf(size_t pair) const;
    /// Returns 32 digits that are the same for equal pairs of equal triangles; answers repeat them.
    std::string id() const;
};

/// Returns the set of a frame's pairs: by tile of 16 x 16 pixels, within it by light, then sample.
RaySet makeRaySet(const GBufferView& gbuffer, const PairList& pairs, const World& world);

/// Returns RaySet::id of the set of these arrays, whatever else is wrong with them.
std::string raySetId(const std::vector<NamedArray>& arrays);
/// Returns the arrays of a set's file.
std::vector<NamedArray> arraysOf(const RaySet& set);
/// Returns the set of arrays. Throws Error kInput, beginning with `path`, for a missing array, a
/// number that is not finite, an index beyond its array, or an id that is not that of the content.
RaySet raySetOf(const std::vector<NamedArray>& arrays, const std::string& path);

/// Writes a set; a path that ends in .npz gives numpy's form. Throws as OutputFile does.
void writeRaySet(const RaySet& set, const std::string& path);
/// Reads a set of either form. Throws as readArrays and raySetOf do.
RaySet readRaySet(const std::string& path);

} // namespace shadowdag
