// SPDX-License-Identifier: Apache-2.0
// Where a mesh's vertices are: displaced by its morph targets, then placed by its node or, of a
// skinned mesh, by the joints. Source: Khronos, glTF 2.0 specification, sec. 3.7.2.2 and 3.7.3.
#pragma once

#include "scenes/scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace shadowdag {

/// What poses a mesh at one time. Its matrices are non-owning, because all nodes with the same skin
/// share them.
struct MeshPose {
    std::vector<double> morphWeights;          ///< one a morph target
    std::span<const glm::dmat4> worldFromMesh; ///< one a joint; one alone without a skin
    bool isSkinned = false;
};

/// Returns a vertex in world space: the position and the weighted displacements, in the order of
/// targets, and of a skinned mesh the mean of where its joints take it, by their weights, in the
/// order of joints. In double, so every machine gets the same bits.
glm::dvec3 posedVertex(const Mesh& mesh, const MeshPose& pose, uint32_t vertex);

} // namespace shadowdag
