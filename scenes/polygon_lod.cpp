// SPDX-License-Identifier: Apache-2.0
#include "scenes/polygon_lod.h"

#include "cuda/parallel_for.h"
#include "scenes/triangle_grid.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A level that keeps more than this of the finer one is not worth its batches.
constexpr double kLeastReduction = 5.0 / 6.0;
/// Simplification stops at this part of the mesh's longest side: beyond, shapes are gone.
constexpr float kMostError = 0.25f;

Box boundsOf(const TriangleView& triangles) {
    Box bounds;
    for (size_t t = 0; t < triangles.count(); ++t)
        for (int corner = 0; corner < 3; ++corner)
            bounds.add(triangles.vertex(t, corner));
    return bounds;
}

/// A surface that is asked how far points are from it, most of which are near.
class Surface {
public:
    explicit Surface(const TriangleView& triangles) : triangles_(triangles) {
        std::vector<Box> boxes(triangles.count());
        for (size_t t = 0; t < boxes.size(); ++t)
            for (int corner = 0; corner < 3; ++corner)
                boxes[t].add(triangles.vertex(t, corner));
        bvh_.build(viewOf(boxes));
    }

    /// Returns the distance to a point that is farther than `near`, else a number up to `near`.
    float distanceBeyond(const glm::vec3& p, float near) const {
        float squared = search(p, near * near, near * near);
        for (float limit = near; squared >= limit * limit && limit < kInfinity;) {
            limit *= 2.0f;
            squared = search(p, limit * limit, near * near);
        }
        return std::sqrt(squared);
    }

private:
    /// Returns the least squared distance below `bound`, or the first found below `enough`; `bound`
    /// for none.
    float search(const glm::vec3& p, float bound, float enough) const {
        traverse(
            bvh_.view(),
            [&](const Box& box) { return bound >= enough && distanceSquared(box, p) < bound; },
            [&](uint32_t t) {
                const glm::vec3 d =
                    p - closestPoint(p, triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                                     triangles_.vertex(t, 2));
                bound = std::min(bound, glm::dot(d, d));
            });
        return bound;
    }

    TriangleView triangles_;
    WideBvh bvh_;
};

/// Returns the greatest distance of one level's triangles to the other, or `most` if that is
/// greater. Corners of the coarse level are corners of the full one.
/// @param most above 0
float farthest(const TriangleView& full, const Surface& fullSurface, const TriangleView& coarse,
               float most) {
    const Surface coarseSurface(coarse);
    std::vector<uint8_t> isDone(full.positions.count, 0);
    const auto look = [&](const Surface& surface, const glm::vec3& p) {
        most = std::max(most, surface.distanceBeyond(p, most));
    };
    for (size_t t = 0; t < full.count(); ++t) {
        glm::vec3 sum(0.0f);
        for (int corner = 0; corner < 3; ++corner) {
            const uint32_t v = full.triangles[t][corner];
            sum += full.positions[v];
            if (!isDone[v])
                look(coarseSurface, full.positions[v]);
            isDone[v] = 1;
        }
        look(coarseSurface, sum / 3.0f);
    }
    for (size_t t = 0; t < coarse.count(); ++t) {
        const glm::vec3 p[3] = {coarse.vertex(t, 0), coarse.vertex(t, 1), coarse.vertex(t, 2)};
        for (int i = 0; i < 3; ++i)
            look(fullSurface, (p[i] + p[(i + 1) % 3]) * 0.5f);
        look(fullSurface, (p[0] + p[1] + p[2]) / 3.0f);
    }
    return most;
}

/// Returns how much a linear map lengthens a vector at most: its greatest singular value, by
/// Jacobi's rotations of its square (Golub and Van Loan, Matrix Computations, sec. 8.5). Square
/// roots only, so the same on every machine.
double greatestScale(const glm::dmat3& m) {
    glm::dmat3 s = glm::transpose(m) * m;
    for (int sweep = 0; sweep < 12; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (s[p][q] == 0.0)
                    continue;
                const double theta = (s[q][q] - s[p][p]) / (2.0 * s[p][q]);
                const double t = (theta < 0.0 ? -1.0 : 1.0) /
                                 (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
                const double c = 1.0 / std::sqrt(t * t + 1.0);
                glm::dmat3 turn(1.0);
                turn[p][p] = turn[q][q] = c;
                turn[q][p] = t * c;
                turn[p][q] = -t * c;
                s = glm::transpose(turn) * s * turn;
            }
    return std::sqrt(std::max({s[0][0], s[1][1], s[2][2], 0.0}));
}

template <class Holds> bool anyOf(uint32_t count, const Holds& holds) {
    for (uint32_t i = 0; i < count; ++i)
        if (holds(i))
            return true;
    return false;
}

std::vector<std::vector<MeshLevel>> simplifyMeshes(const World& world) {
    const std::vector<Mesh>& meshes = world.scene().meshes;
    std::vector<uint8_t> isUsed(meshes.size(), 0);
    for (const Instance& instance : world.instances())
        isUsed[instance.mesh] = 1;
    std::vector<std::vector<MeshLevel>> levels(meshes.size());
    cpuParallelRanges(meshes.size(), 1, [&](size_t begin, size_t end) {
        for (size_t mesh = begin; mesh < end; ++mesh)
            if (isUsed[mesh])
                levels[mesh] = simplifyMesh(meshes[mesh]);
    });
    return levels;
}

} // namespace

std::vector<MeshLevel> simplifyMesh(const Mesh& mesh) {
    std::vector<MeshLevel> levels;
    const TriangleView full{viewOf(mesh.positions), viewOf(mesh.triangles)};
    if (full.count() < 2)
        return levels;
    const Box bounds = boundsOf(full);
    const glm::vec3 extent = bounds.extent();
    const float side = std::max({extent.x, extent.y, extent.z});
    if (!(side > 0.0f))
        return levels;
    const Surface fullSurface(full);
    const float* const positions = &mesh.positions[0].x;
    const size_t vertexCount = mesh.positions.size();
    const float toAbsolute =
        meshopt_simplifyScale(positions, vertexCount, sizeof(mesh.positions[0]));

    std::vector<uint32_t> indices(3 * full.count());
    size_t count = full.count();
    float error = 0.0f;
    for (uint32_t level = 1; level < kMaxPolygonLevels; ++level) {
        float relative = 0.0f;
        const size_t kept =
            meshopt_simplify(indices.data(), &mesh.triangles[0].x, 3 * full.count(), positions,
                             vertexCount, sizeof(mesh.positions[0]), 3 * (full.count() >> level),
                             kMostError, 0, &relative) /
            3;
        if (kept == 0 || double(kept) > kLeastReduction * double(count))
            break;
        count = kept;
        MeshLevel found;
        for (size_t t = 0; t < kept; ++t)
            found.triangles.push_back({indices[3 * t], indices[3 * t + 1], indices[3 * t + 2]});
        const TriangleView coarse{full.positions, viewOf(found.triangles)};
        // Not less than what rounding of positions may hide.
        error = std::max({error, relative * toAbsolute, side * 1e-6f});
        error = farthest(full, fullSurface, coarse, error);
        found.error = error;
        levels.push_back(std::move(found));
    }
    return levels;
}

PolygonLod::Triangles PolygonLod::gather(const World& world,
                                         const std::vector<std::vector<MeshLevel>>& levels) {
    const std::vector<Instance>& instances = world.instances();
    const TriangleView full = world.triangles();
    Triangles all;
    all.triangles.assign(full.triangles.begin(), full.triangles.end());
    all.group = world.triangleInstance();
    all.isGroupMoving.resize(instances.size() * kMaxPolygonLevels);
    all.groupTriangles.resize(instances.size() * kMaxPolygonLevels);
    for (uint32_t i = 0; i < instances.size(); ++i) {
        const Instance& instance = instances[i];
        all.groupTriangles[i] = instance.triangleCount;
        all.isGroupMoving[i] = instance.isMoving;
        const auto isCut = [&](uint32_t t) { return full.masks.isCut(instance.firstTriangle + t); };
        if (anyOf(instance.triangleCount, isCut))
            continue;
        uint32_t group = i;
        for (const MeshLevel& level : levels[instance.mesh]) {
            group += uint32_t(instances.size());
            for (const glm::uvec3& triangle : level.triangles)
                all.triangles.push_back(triangle + instance.firstVertex);
            all.group.resize(all.triangles.size(), group);
            all.groupTriangles[group] = uint32_t(level.triangles.size());
            all.isGroupMoving[group] = instance.isMoving;
        }
    }
    if (!full.masks.triangleCut.empty()) {
        all.cuts.assign(full.masks.triangleCut.begin(), full.masks.triangleCut.end());
        all.cuts.resize(all.triangles.size(), kNotCut);
    }
    return all;
}

PolygonLod::PolygonLod(const World& world, const BatchOptions& options)
    : world_(world), meshLevels_(simplifyMeshes(world)), all_(gather(world, meshLevels_)),
      batchSet_(triangles(), all_.group, options, all_.isGroupMoving) {
    const uint32_t instanceCount = uint32_t(world.instances().size());
    const View<const Batch> batches = batchSet_.view().batches;
    firstBatch_.resize(instanceCount + 1);
    uint32_t b = 0;
    for (uint32_t i = 0; i <= instanceCount; ++i) {
        while (b < batches.count && batches[b].instance < i)
            ++b;
        firstBatch_[i] = b;
    }
    instanceBoxes_.resize(instanceCount);
    errorsWorld_.assign(size_t(instanceCount) * kMaxPolygonLevels, kInfinity);
    for (uint32_t i = 0; i < instanceCount; ++i)
        place(i);
    for (std::vector<MeshLevel>& levels : meshLevels_)
        for (MeshLevel& level : levels)
            level.triangles = {};
}

void PolygonLod::place(uint32_t instance) {
    Box box;
    for (uint32_t b = firstBatch_[instance]; b < firstBatch_[instance + 1]; ++b)
        box.add(batchSet_.view().boxesWorld[b]);
    instanceBoxes_[instance] = box;
    const Instance& placed = world_.instances()[instance];
    const double scale = greatestScale(glm::dmat3(placed.worldFromObject));
    float* const errors = &errorsWorld_[size_t(instance) * kMaxPolygonLevels];
    errors[0] = 0.0f;
    const std::vector<MeshLevel>& levels = meshLevels_[placed.mesh];
    for (uint32_t level = 0; level < levels.size() && triangleCount(instance, level + 1) > 0;
         ++level)
        errors[level + 1] = float(scale * double(levels[level].error));
}

void PolygonLod::update(const std::vector<uint32_t>& movedInstances) {
    const uint32_t instanceCount = uint32_t(world_.instances().size());
    std::vector<uint32_t> groups;
    for (const uint32_t instance : movedInstances)
        for (uint32_t level = 0; level < kMaxPolygonLevels; ++level)
            if (triangleCount(instance, level) > 0)
                groups.push_back(level * instanceCount + instance);
    batchSet_.update(triangles(), groups);
    for (const uint32_t instance : movedInstances)
        place(instance);
}

TriangleView PolygonLod::triangles() const {
    TriangleView view = world_.triangles();
    view.triangles = viewOf(all_.triangles);
    view.masks.triangleCut = viewOf(all_.cuts);
    return view;
}

BatchView PolygonLod::batches(float allowedTexels) const {
    BatchView view = batchSet_.view();
    view.levels = {viewOf(instanceBoxes_), viewOf(errorsWorld_), allowedTexels};
    return view;
}

uint32_t PolygonLod::triangleCount(uint32_t instance, uint32_t level) const {
    return all_.groupTriangles[level * world_.instances().size() + instance];
}

} // namespace shadowdag
