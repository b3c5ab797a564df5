// SPDX-License-Identifier: Apache-2.0
#include "scenes/polygon_lod.h"

#include "cuda/parallel_for.h"
#include "scenes/triangle_tree.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A level that keeps more than this of the finer one is not worth its batches.
constexpr double kLeastReduction = 5.0 / 6.0;
/// Simplification stops at this fraction of the mesh's longest side, beyond which shapes are lost.
constexpr float kMostError = 0.25f;

Box boundsOf(const TriangleView& triangles) {
    Box bounds;
    for (size_t t = 0; t < triangles.count(); ++t)
        for (int corner = 0; corner < 3; ++corner)
            bounds.add(triangles.vertex(t, corner));
    return bounds;
}

/// A surface for distance queries of points, most of which are near.
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
            [&](uint32_t t) { bound = std::min(bound, distanceSquared(triangles_, t, p)); });
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

/// Returns the greatest factor by which a linear map lengthens a vector: its greatest singular
/// value, by Jacobi's rotations of its square (Golub and Van Loan, Matrix Computations, sec. 8.5).
/// Square roots only, so the same on every machine.
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

std::vector<std::vector<MeshPart>> simplifyMeshes(const World& world) {
    const std::vector<Mesh>& meshes = world.scene().meshes;
    std::vector<uint8_t> isUsed(meshes.size(), 0);
    for (const Instance& instance : world.instances())
        isUsed[instance.mesh] = 1;
    std::vector<std::vector<MeshPart>> parts(meshes.size());
    cpuParallelRanges(meshes.size(), 1, [&](size_t begin, size_t end) {
        for (size_t mesh = begin; mesh < end; ++mesh)
            if (isUsed[mesh])
                parts[mesh] = simplifyMesh(meshes[mesh]);
    });
    return parts;
}

} // namespace

std::vector<PolygonLevel> simplify(const TriangleView& full, bool keepsBorder) {
    std::vector<PolygonLevel> levels;
    if (full.count() < 2)
        return levels;
    const glm::vec3 extent = boundsOf(full).extent();
    const float side = std::max({extent.x, extent.y, extent.z});
    if (!(side > 0.0f))
        return levels;
    const Surface fullSurface(full);
    const float* const positions = &full.positions[0].x;
    const size_t vertexCount = full.positions.count, stride = sizeof(glm::vec3);
    const float toAbsolute = meshopt_simplifyScale(positions, vertexCount, stride);

    std::vector<uint32_t> indices(3 * full.count());
    size_t count = full.count();
    float error = 0.0f;
    for (uint32_t level = 1; level < kMaxPolygonLevels; ++level) {
        float relative = 0.0f;
        const size_t kept =
            meshopt_simplify(indices.data(), &full.triangles[0].x, 3 * full.count(), positions,
                             vertexCount, stride, 3 * (full.count() >> level), kMostError,
                             keepsBorder ? meshopt_SimplifyLockBorder : 0, &relative) /
            3;
        if (kept == 0 || double(kept) > kLeastReduction * double(count))
            break;
        count = kept;
        PolygonLevel found;
        for (size_t t = 0; t < kept; ++t)
            found.triangles.push_back({indices[3 * t], indices[3 * t + 1], indices[3 * t + 2]});
        // At least what rounding of positions may hide.
        error = std::max({error, relative * toAbsolute, side * 1e-6f});
        error = farthest(full, fullSurface, {full.positions, viewOf(found.triangles), {}}, error);
        found.error = error;
        levels.push_back(std::move(found));
    }
    return levels;
}

std::vector<MeshPart> simplifyMesh(const Mesh& mesh) {
    const BatchSet batches({viewOf(mesh.positions), viewOf(mesh.triangles), {}},
                           std::vector<uint32_t>(mesh.triangles.size(), 0),
                           {kMaxBatchTriangleCount, BatchCut::kFull});
    const BatchView view = batches.view();
    std::vector<MeshPart> parts(batches.size());
    std::vector<uint32_t> localOf(mesh.positions.size(), ~0u);
    for (size_t i = 0; i < parts.size(); ++i) {
        MeshPart& part = parts[i];
        const Batch& batch = view.batches[i];
        part.triangles.assign(&view.triangles[batch.first],
                              &view.triangles[batch.first] + batch.count);
        std::sort(part.triangles.begin(), part.triangles.end());
        // The simplifier takes time in all vertices, so it gets only the part's own.
        std::vector<uint32_t> meshVertex;
        std::vector<glm::vec3> positions;
        std::vector<glm::uvec3> triangles;
        for (const uint32_t t : part.triangles) {
            glm::uvec3 local;
            for (int corner = 0; corner < 3; ++corner) {
                const uint32_t v = mesh.triangles[t][corner];
                if (localOf[v] == ~0u) {
                    localOf[v] = uint32_t(meshVertex.size());
                    meshVertex.push_back(v);
                    positions.push_back(mesh.positions[v]);
                }
                local[corner] = localOf[v];
            }
            triangles.push_back(local);
        }
        part.levels = simplify({viewOf(positions), viewOf(triangles), {}}, parts.size() > 1);
        for (PolygonLevel& level : part.levels)
            for (glm::uvec3& t : level.triangles)
                t = {meshVertex[t.x], meshVertex[t.y], meshVertex[t.z]};
        for (const uint32_t v : meshVertex)
            localOf[v] = ~0u;
    }
    return parts;
}

PolygonLod::PolygonLod(const World& world, const BatchOptions& options)
    : world_(world), meshParts_(simplifyMeshes(world)) {
    gather();
    batchSet_ = std::make_unique<BatchSet>(triangles(), groupOf_, options, isGroupMoving_);
    const View<const Batch> batches = batchSet_->view().batches;
    firstBatch_.resize(parts_.size() + 1);
    uint32_t b = 0;
    for (uint32_t i = 0; i <= parts_.size(); ++i) {
        while (b < batches.count && batches[b].instance < i)
            ++b;
        firstBatch_[i] = b;
    }
    partBoxes_.resize(parts_.size());
    errorsWorld_.assign(parts_.size() * kMaxPolygonLevels, kInfinity);
    for (uint32_t i = 0; i < parts_.size(); ++i)
        place(i);
    for (std::vector<MeshPart>& parts : meshParts_)
        for (MeshPart& part : parts) {
            part.triangles = {};
            for (PolygonLevel& level : part.levels)
                level.triangles = {};
        }
}

void PolygonLod::gather() {
    const std::vector<Instance>& instances = world_.instances();
    const TriangleView full = world_.triangles();
    for (uint32_t i = 0; i < instances.size(); ++i) {
        firstPart_.push_back(uint32_t(parts_.size()));
        for (uint32_t k = 0; k < meshParts_[instances[i].mesh].size(); ++k)
            parts_.push_back({i, instances[i].mesh, k});
    }
    const size_t partCount = parts_.size();
    firstPart_.push_back(uint32_t(partCount));

    triangles_.assign(full.triangles.begin(), full.triangles.end());
    groupOf_.resize(full.count());
    groupTriangles_.resize(partCount * kMaxPolygonLevels);
    isGroupMoving_.resize(partCount * kMaxPolygonLevels);
    for (uint32_t p = 0; p < partCount; ++p) {
        const Instance& instance = instances[parts_[p].instance];
        const MeshPart& part = meshParts_[instance.mesh][parts_[p].inMesh];
        bool isKept = world_.scene().meshes[instance.mesh].deforms();
        for (const uint32_t t : part.triangles) {
            groupOf_[instance.firstTriangle + t] = p;
            isKept |= full.masks.isCut(instance.firstTriangle + t);
        }
        groupTriangles_[p] = uint32_t(part.triangles.size());
        isGroupMoving_[p] = instance.isMoving;
        if (isKept)
            continue;
        size_t group = p;
        for (const PolygonLevel& level : part.levels) {
            group += partCount;
            for (const glm::uvec3& triangle : level.triangles)
                triangles_.push_back(triangle + instance.firstVertex);
            groupOf_.resize(triangles_.size(), uint32_t(group));
            groupTriangles_[group] = uint32_t(level.triangles.size());
            isGroupMoving_[group] = instance.isMoving;
        }
    }
    if (!full.masks.triangleCut.empty()) {
        cuts_.assign(full.masks.triangleCut.begin(), full.masks.triangleCut.end());
        cuts_.resize(triangles_.size(), kNotCut);
    }
}

void PolygonLod::place(uint32_t part) {
    Box box;
    for (uint32_t b = firstBatch_[part]; b < firstBatch_[part + 1]; ++b)
        box.add(batchSet_->view().boxesWorld[b]);
    partBoxes_[part] = box;
    const double scale =
        greatestScale(glm::dmat3(world_.instances()[parts_[part].instance].worldFromObject));
    float* const errors = &errorsWorld_[size_t(part) * kMaxPolygonLevels];
    errors[0] = 0.0f;
    const std::vector<PolygonLevel>& levels =
        meshParts_[parts_[part].mesh][parts_[part].inMesh].levels;
    for (uint32_t level = 0; level < levels.size() && triangleCount(part, level + 1) > 0; ++level)
        errors[level + 1] = float(scale * double(levels[level].error));
}

void PolygonLod::update(const std::vector<uint32_t>& movedInstances, StageTimes* stages) {
    std::vector<uint32_t> groups;
    for (const uint32_t instance : movedInstances)
        for (uint32_t part = firstPart_[instance]; part < firstPart_[instance + 1]; ++part)
            for (uint32_t level = 0; level < kMaxPolygonLevels; ++level)
                if (triangleCount(part, level) > 0)
                    groups.push_back(uint32_t(level * parts_.size()) + part);
    batchSet_->update(triangles(), groups, stages);
    for (const uint32_t instance : movedInstances)
        for (uint32_t part = firstPart_[instance]; part < firstPart_[instance + 1]; ++part)
            place(part);
}

TriangleView PolygonLod::triangles() const {
    TriangleView view = world_.triangles();
    view.triangles = viewOf(triangles_);
    view.masks.triangleCut = viewOf(cuts_);
    return view;
}

BatchView PolygonLod::batches(float allowedTexels) const {
    BatchView view = batchSet_->view();
    view.levels = {viewOf(partBoxes_), viewOf(errorsWorld_), allowedTexels};
    return view;
}

} // namespace shadowdag
