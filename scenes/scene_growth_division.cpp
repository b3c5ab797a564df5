// SPDX-License-Identifier: Apache-2.0
// Divides the triangles of a mesh at their edges' midpoints.
#include "scenes/scene_growth_parts.h"

#include "cuda/cancel.h"

#include <algorithm>
#include <numeric>

namespace shadowdag {

namespace {

glm::vec3 midpoint(const glm::vec3& a, const glm::vec3& b) {
    return glm::vec3(0.5 * (glm::dvec3(a) + glm::dvec3(b)));
}

/// The edges of a mesh, each once, numbered in ascending order of both its ends.
/// firstEdge: vertexCount + 1; the edges whose lower end is a vertex. upperEnd: edgeCount.
struct MeshEdges {
    std::vector<uint64_t> firstEdge;
    std::vector<uint32_t> upperEnd;

    explicit MeshEdges(const Mesh& mesh) : firstEdge(mesh.positions.size() + 1, 0) {
        // Sides by their lower ends, those of two triangles twice: counted, then put in place.
        std::vector<uint64_t> firstSide(mesh.positions.size() + 1, 0);
        forSides(mesh, [&](uint32_t low, uint32_t) { ++firstSide[low + 1]; });
        std::partial_sum(firstSide.begin(), firstSide.end(), firstSide.begin());
        std::vector<uint32_t> ends(firstSide.back());
        std::vector<uint64_t> next(firstSide.begin(), firstSide.end() - 1);
        forSides(mesh, [&](uint32_t low, uint32_t high) { ends[next[low]++] = high; });
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            if (v % kGrowthPollInterval == 0)
                pollCpu();
            const auto begin = ends.begin() + ptrdiff_t(firstSide[v]),
                       end = ends.begin() + ptrdiff_t(firstSide[v + 1]);
            std::sort(begin, end);
            upperEnd.insert(upperEnd.end(), begin, std::unique(begin, end));
            firstEdge[v + 1] = upperEnd.size();
        }
    }

    /// Returns the number of an edge.
    uint64_t at(uint32_t a, uint32_t b) const {
        const uint32_t low = std::min(a, b), high = std::max(a, b);
        const auto begin = upperEnd.begin();
        return uint64_t(std::lower_bound(begin + ptrdiff_t(firstEdge[low]),
                                         begin + ptrdiff_t(firstEdge[low + 1]), high) -
                        begin);
    }

private:
    template <class Visit> static void forSides(const Mesh& mesh, const Visit& visit) {
        for (size_t i = 0; i < mesh.triangles.size(); ++i) {
            if (i % kGrowthPollInterval == 0)
                pollCpu();
            const glm::uvec3& t = mesh.triangles[i];
            for (int side = 0; side < 3; ++side)
                visit(std::min(t[side], t[(side + 1) % 3]), std::max(t[side], t[(side + 1) % 3]));
        }
    }
};

} // namespace

void divideTriangles(Mesh& mesh) {
    const MeshEdges edges(mesh);
    const size_t firstNew = mesh.positions.size();
    requireIndices(firstNew + edges.upperEnd.size(), productOf(4, mesh.triangles.size()));
    mesh.positions.reserve(firstNew + edges.upperEnd.size());
    for (size_t a = 0; a < firstNew; ++a)
        for (uint64_t edge = edges.firstEdge[a]; edge < edges.firstEdge[a + 1]; ++edge) {
            const uint32_t b = edges.upperEnd[edge];
            mesh.positions.push_back(midpoint(mesh.positions[a], mesh.positions[b]));
            if (!mesh.uv.empty())
                mesh.uv.push_back(
                    glm::vec2(0.5 * (glm::dvec2(mesh.uv[a]) + glm::dvec2(mesh.uv[b]))));
        }
    std::vector<glm::uvec3> triangles;
    std::vector<uint32_t> materials;
    triangles.reserve(4 * mesh.triangles.size());
    materials.reserve(4 * mesh.triangles.size());
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (i % kGrowthPollInterval == 0)
            pollCpu();
        const glm::uvec3 t = mesh.triangles[i];
        glm::uvec3 middle;
        for (int side = 0; side < 3; ++side)
            middle[side] = uint32_t(firstNew + edges.at(t[side], t[(side + 1) % 3]));
        triangles.push_back({t.x, middle.x, middle.z});
        triangles.push_back({middle.x, t.y, middle.y});
        triangles.push_back({middle.z, middle.y, t.z});
        triangles.push_back(middle);
        materials.insert(materials.end(), 4, mesh.triangleMaterial[i]);
    }
    mesh.triangles = std::move(triangles);
    mesh.triangleMaterial = std::move(materials);
}

} // namespace shadowdag
