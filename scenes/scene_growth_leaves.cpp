// SPDX-License-Identifier: Apache-2.0
// Strews leaves over the surfaces of a scene.
#include "scenes/scene_growth_parts.h"

#include "cuda/cancel.h"
#include "scenes/mesh_shapes.h"
#include "scenes/surface_sampler.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr uint32_t kLeafTexels = 16; ///< a side of the leaf's mask

double areaOf(const TriangleView& triangles) {
    double twice = 0;
    for (size_t t = 0; t < triangles.count(); ++t) {
        if (t % kGrowthPollInterval == 0)
            pollCpu();
        const glm::dvec3 a(triangles.vertex(t, 0)), b(triangles.vertex(t, 1)),
            c(triangles.vertex(t, 2));
        twice += glm::length(glm::cross(b - a, c - a));
    }
    return 0.5 * twice;
}

/// Returns a mask whose opaque texels form an ellipse.
AlphaMask leafMask() {
    AlphaMask mask = makeAlphaMask(kLeafTexels, kLeafTexels, MaskWrap::kClamp, MaskWrap::kClamp);
    for (uint32_t y = 0; y < kLeafTexels; ++y)
        for (uint32_t x = 0; x < kLeafTexels; ++x) {
            const double u = (double(x) + 0.5) / (0.5 * kLeafTexels) - 1.0,
                         v = (double(y) + 0.5) / (0.5 * kLeafTexels) - 1.0;
            if (u * u + v * v <= 1.0)
                setOpaque(mask, x, y);
        }
    return mask;
}

/// Returns a random point of the unit ball other than its centre.
glm::dvec3 inBall(HashRandom& random) {
    while (true) {
        glm::dvec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = random.between(-1.0, 1.0);
        const double squared = glm::dot(p, p);
        if (squared <= 1.0 && squared > 1e-6)
            return p;
    }
}

glm::dvec3 unit(const glm::dvec3& v) {
    return v / std::sqrt(glm::dot(v, v));
}

/// Returns the way that brings [low, high] into [min, max]; to its lower end where it is too long.
double shiftInto(double low, double high, double min, double max) {
    const double down = high > max ? max - high : 0.0;
    return low + down < min ? min - low : down;
}

/// Places leaves on the surfaces of a scene.
class LeafStrewer {
public:
    LeafStrewer(const World& world, uint64_t leafCount, const LeafOptions& options)
        : bounds_(world.boundsWorld()), points_(world.triangles()), places_(options.seed),
          tilts_(~options.seed),
          // A leaf is 2 a long and a wide.
          halfLength_(std::sqrt(options.cover * areaOf(world.triangles()) /
                                (2.0 * double(std::max<uint64_t>(1, leafCount))))) {}

    /// Adds a leaf's two triangles to a mesh.
    void addLeaf(Mesh& mesh, uint32_t material) {
        const SurfaceSampler::Point point = points_.draw(places_);
        const glm::dvec3 normal(point.normal);
        // Within 45 degrees of the surface's normal, since the ball is of radius 0.7.
        const glm::dvec3 up =
            unit(normal == glm::dvec3(0.0) ? inBall(tilts_) : normal + 0.7 * inBall(tilts_));
        glm::dvec3 across = glm::cross(up, inBall(tilts_));
        while (glm::dot(across, across) < 1e-6)
            across = glm::cross(up, inBall(tilts_));
        const glm::dvec3 along = halfLength_ * unit(across),
                         aside = 0.5 * halfLength_ * glm::cross(up, unit(across));
        const glm::dvec3 center = glm::dvec3(point.position) + halfLength_ * tilts_.unit() * normal;
        glm::dvec3 corners[4] = {center - along - aside, center + along - aside,
                                 center + along + aside, center - along + aside};
        keepInBounds(corners);
        const uint32_t first = uint32_t(mesh.positions.size());
        for (const glm::dvec3& corner : corners)
            mesh.positions.push_back(glm::vec3(corner));
        if (!mesh.uv.empty())
            mesh.uv.insert(mesh.uv.end(), {{0, 0}, {1, 0}, {1, 1}, {0, 1}});
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
        mesh.triangleMaterial.insert(mesh.triangleMaterial.end(), 2, material);
    }

private:
    /// Moves a leaf into the scene's bounds, so that the grid of voxels stays.
    void keepInBounds(glm::dvec3 (&corners)[4]) const {
        for (int axis = 0; axis < 3; ++axis) {
            double low = corners[0][axis], high = low;
            for (const glm::dvec3& corner : corners) {
                low = std::min(low, corner[axis]);
                high = std::max(high, corner[axis]);
            }
            const double shift =
                shiftInto(low, high, double(bounds_.min[axis]), double(bounds_.max[axis]));
            for (glm::dvec3& corner : corners)
                corner[axis] += shift;
        }
    }

    Box bounds_;
    SurfaceSampler points_;
    PlacementRandom places_;
    HashRandom tilts_;
    double halfLength_;
};

} // namespace

void strewLeaves(Scene& scene, const World& world, uint64_t leafCount, const LeafOptions& options) {
    Mesh& mesh = scene.meshes.front();
    requireIndices(mesh.positions.size() + productOf(4, leafCount),
                   mesh.triangles.size() + productOf(2, leafCount));
    Material leaf;
    leaf.name = "leaf";
    leaf.baseColor = glm::vec3(0.25f, 0.45f, 0.15f);
    if (options.isMasked) {
        leaf.alphaMask = int(scene.alphaMasks.size());
        scene.alphaMasks.push_back(leafMask());
        mesh.uv.resize(mesh.positions.size(), glm::vec2(0.0f));
    }
    const uint32_t material = uint32_t(scene.materials.size());
    scene.materials.push_back(leaf);
    mesh.positions.reserve(mesh.positions.size() + 4 * leafCount);
    mesh.triangles.reserve(mesh.triangles.size() + 2 * leafCount);
    mesh.triangleMaterial.reserve(mesh.triangles.size() + 2 * leafCount);
    LeafStrewer strewer(world, leafCount, options);
    for (uint64_t i = 0; i < leafCount; ++i) {
        if (i % kGrowthPollInterval == 0)
            pollCpu();
        strewer.addLeaf(mesh, material);
    }
}

} // namespace shadowdag
