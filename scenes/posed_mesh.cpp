// SPDX-License-Identifier: Apache-2.0
#include "scenes/posed_mesh.h"

namespace shadowdag {

namespace {

// The contribution of a point's coordinates: rows times columns in a stated order, in double.
glm::dvec3 transformPoint(const glm::dmat4& m, const glm::dvec3& p) {
    return {m[0].x * p.x + m[1].x * p.y + m[2].x * p.z + m[3].x,
            m[0].y * p.x + m[1].y * p.y + m[2].y * p.z + m[3].y,
            m[0].z * p.x + m[1].z * p.y + m[2].z * p.z + m[3].z};
}

} // namespace

glm::dvec3 posedVertex(const Mesh& mesh, const MeshPose& pose, uint32_t vertex) {
    glm::dvec3 p(mesh.positions[vertex]);
    for (size_t target = 0; target < pose.morphWeights.size(); ++target)
        if (pose.morphWeights[target] != 0.0)
            p += pose.morphWeights[target] * glm::dvec3(mesh.morphTargets[target][vertex]);
    if (!pose.isSkinned)
        return transformPoint(pose.worldFromMesh.front(), p);
    // Stored weights add up to 1 but for their rounding, which the division undoes.
    glm::dvec3 sum(0.0);
    double weights = 0.0;
    const JointWeight* const first = &mesh.jointWeights[size_t(vertex) * mesh.jointsPerVertex];
    for (uint32_t k = 0; k < mesh.jointsPerVertex; ++k) {
        if (first[k].weight == 0.0f)
            continue;
        sum += double(first[k].weight) * transformPoint(pose.worldFromMesh[first[k].joint], p);
        weights += double(first[k].weight);
    }
    return sum / weights;
}

} // namespace shadowdag
