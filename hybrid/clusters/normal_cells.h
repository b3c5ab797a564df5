// SPDX-License-Identifier: Apache-2.0
// Directions in cells: k x k on every face of a cube (Nk clustering), and whether a surface whose
// normals lie in one cell may face a light. Source: Olsson, Billeter, Assarsson, Clustered Deferred
// and Forward Shading, HPG 2012, sec. 3.2 and 3.5. A deviation: they test a cone around the cell; a
// cell is a pyramid, for which the test is exact and needs no angle.
#pragma once

#include "cuda/view.h"
#include "scenes/box.h"
#include "scenes/light.h"

namespace shadowdag {

/// The most cells along an edge of the cube's faces; a set of all cells is then 1536 bits.
constexpr uint32_t kMaxNormalCellsPerEdge = 16;

/// Returns the cell of a direction: (face * k + row) * k + column; faces +X, -X, +Y, -Y, +Z, -Z,
/// columns along the first and rows along the second of the other two axes, half open. A face's
/// edge belongs to the earlier axis.
/// @param normal not zero, of any length; @param k 1..kMaxNormalCellsPerEdge
SDAG_HD inline uint32_t normalCellOf(const glm::vec3& normal, uint32_t k) {
    const glm::vec3 size = glm::abs(normal);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const float major = size[axis];
    const auto cellAlong = [&](float minor) {
        const int i = int((minor / major + 1.0f) * 0.5f * float(k));
        return uint32_t(glm::clamp(i, 0, int(k) - 1)); // the far edge belongs to the last cell
    };
    const uint32_t face = uint32_t(axis) * 2 + (normal[axis] < 0.0f ? 1 : 0);
    const uint32_t column = cellAlong(normal[axis == 0 ? 1 : 0]);
    const uint32_t row = cellAlong(normal[axis == 2 ? 1 : 2]);
    return (face * k + row) * k + column;
}

/// The cell that contains the normals of all samples of a cluster. cells: clusterCount, as
/// normalCellOf numbers them; empty: unknown.
struct ClusterNormalsView {
    View<const uint32_t> cells;
    uint32_t k = 0; ///< cells along an edge of a face
};

/// Returns whether a point of the box with a normal in the cell may face the light. Never false for
/// a sample whose n.l in floats is positive (isPair).
///
/// Derivation. Scale normals so that the component along the face's axis is 1, which changes no
/// sign of n.l; the other two then range over intervals, and so does every component of l = light -
/// point. n.l is a sum of three terms with a component of each: its maximum is the sum of the
/// maxima, each at ends of the intervals. Rounding of n.l in floats is at most 5 of 2^-24 of the
/// sum of its terms' sizes, and that of the cell's border 2^-23.
SDAG_HD inline bool mayFace(const Light& light, const Box& box, uint32_t normalCell, uint32_t k) {
    const uint32_t face = normalCell / (k * k);
    const uint32_t row = normalCell / k % k, column = normalCell % k;
    const int axis = int(face / 2);
    const int axes[3] = {axis, axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
    constexpr double kBorder = 1e-6;
    const auto low = [&](uint32_t i) { return 2.0 * i / k - 1.0 - kBorder; };
    const double sign = face % 2 ? -1.0 : 1.0;
    const double normalMin[3] = {sign, low(column), low(row)};
    const double normalMax[3] = {sign, low(column + 1) + 2.0 * kBorder,
                                 low(row + 1) + 2.0 * kBorder};
    double most = 0.0, size = 0.0;
    for (int i = 0; i < 3; ++i) {
        const int a = axes[i];
        double toMin = double(light.positionWorld[a]) - box.max[a];
        double toMax = double(light.positionWorld[a]) - box.min[a];
        if (light.kind == Light::kSun)
            toMin = toMax = -double(light.directionWorld[a]);
        most += glm::max(glm::max(normalMin[i] * toMin, normalMin[i] * toMax),
                         glm::max(normalMax[i] * toMin, normalMax[i] * toMax));
        size += glm::max(glm::abs(toMin), glm::abs(toMax));
    }
    return most > -1e-6 * size;
}

} // namespace shadowdag
