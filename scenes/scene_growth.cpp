// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_growth.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/mesh_shapes.h"
#include "scenes/surface_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace shadowdag {

namespace {

constexpr uint64_t kMost = std::numeric_limits<uint64_t>::max();
constexpr uint32_t kLeafTexels = 16; ///< a side of the leaf's mask
constexpr size_t kPollInterval = 65536;

uint64_t times(uint64_t a, uint64_t b) {
    return b != 0 && a > kMost / b ? kMost : a * b;
}

/// Throws unless indices of 32 bits reach all vertices and triangles.
void requireIndices(uint64_t vertexCount, uint64_t triangleCount) {
    if (std::max(vertexCount, triangleCount) >= std::numeric_limits<uint32_t>::max())
        throw Error(ErrorKind::kResource, "a scene of " + std::to_string(triangleCount) +
                                              " triangles and " + std::to_string(vertexCount) +
                                              " vertices: must have fewer than 2^32 of each; grow "
                                              "it less");
}

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
            if (v % kPollInterval == 0)
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
            if (i % kPollInterval == 0)
                pollCpu();
            const glm::uvec3& t = mesh.triangles[i];
            for (int side = 0; side < 3; ++side)
                visit(std::min(t[side], t[(side + 1) % 3]), std::max(t[side], t[(side + 1) % 3]));
        }
    }
};

/// Divides each triangle into four, the corner of its first vertex first, the middle one last.
void divide(Mesh& mesh) {
    const MeshEdges edges(mesh);
    const size_t firstNew = mesh.positions.size();
    requireIndices(firstNew + edges.upperEnd.size(), times(4, mesh.triangles.size()));
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
        if (i % kPollInterval == 0)
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

/// Adds copies on all places of a square of (step + 1)^2 but the one in its middle, or next to it.
void repeat(Mesh& mesh, const Box& bounds, uint64_t step) {
    const size_t vertexCount = mesh.positions.size(), triangleCount = mesh.triangles.size();
    const uint64_t side = step + 1, places = times(side, side);
    requireIndices(times(places, vertexCount), times(places, triangleCount));
    const glm::dvec3 size = glm::dvec3(bounds.max) - glm::dvec3(bounds.min);
    const double gap = std::max({size.x, size.y, size.z}) / 64;
    mesh.positions.reserve(places * vertexCount);
    mesh.triangles.reserve(places * triangleCount);
    mesh.triangleMaterial.reserve(places * triangleCount);
    const int64_t first = -int64_t(step / 2), last = first + int64_t(step);
    for (int64_t z = first; z <= last; ++z)
        for (int64_t x = first; x <= last; ++x) {
            if (x == 0 && z == 0)
                continue;
            pollCpu();
            const glm::dvec3 offset(double(x) * (size.x + gap), 0.0, double(z) * (size.z + gap));
            const uint32_t firstVertex = uint32_t(mesh.positions.size());
            for (size_t v = 0; v < vertexCount; ++v) {
                mesh.positions.push_back(glm::vec3(glm::dvec3(mesh.positions[v]) + offset));
                if (!mesh.uv.empty())
                    mesh.uv.push_back(mesh.uv[v]);
            }
            for (size_t t = 0; t < triangleCount; ++t) {
                mesh.triangles.push_back(mesh.triangles[t] + firstVertex);
                mesh.triangleMaterial.push_back(mesh.triangleMaterial[t]);
            }
        }
}

double areaOf(const TriangleView& triangles) {
    double twice = 0;
    for (size_t t = 0; t < triangles.count(); ++t) {
        if (t % kPollInterval == 0)
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

void strew(Scene& scene, const World& world, uint64_t leafCount, const LeafOptions& options) {
    Mesh& mesh = scene.meshes.front();
    requireIndices(mesh.positions.size() + times(4, leafCount),
                   mesh.triangles.size() + times(2, leafCount));
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
        if (i % kPollInterval == 0)
            pollCpu();
        strewer.addLeaf(mesh, material);
    }
}

} // namespace

uint64_t grownCount(Growth growth, uint64_t triangleCount, uint64_t step) {
    switch (growth) {
    case Growth::kTessellate: {
        uint64_t count = triangleCount;
        for (uint64_t level = 0; level < step && count < kMost; ++level)
            count = times(4, count);
        return count;
    }
    case Growth::kInstance:
        return step == kMost ? kMost : times(triangleCount, times(step + 1, step + 1));
    case Growth::kLeaves:
        break;
    }
    const uint64_t ofLeaves = times(2, step);
    return ofLeaves > kMost - triangleCount ? kMost : triangleCount + ofLeaves;
}

uint64_t nearestStep(Growth growth, uint64_t triangleCount, uint64_t askedCount) {
    if (askedCount <= triangleCount)
        return 0;
    if (growth == Growth::kLeaves)
        return (askedCount - triangleCount) / 2;
    uint64_t step = 0;
    while (grownCount(growth, triangleCount, step + 1) <= askedCount)
        ++step;
    const double below = double(grownCount(growth, triangleCount, step)),
                 above = double(grownCount(growth, triangleCount, step + 1));
    const double asked = double(askedCount);
    return asked * asked > below * above ? step + 1 : step;
}

Scene flattened(const World& world) {
    const Scene& from = world.scene();
    const TriangleView triangles = world.triangles();
    Mesh mesh;
    mesh.name = from.name;
    mesh.positions.assign(triangles.positions.begin(), triangles.positions.end());
    mesh.triangles.assign(triangles.triangles.begin(), triangles.triangles.end());
    mesh.triangleMaterial = world.triangleMaterial();
    if (std::any_of(from.meshes.begin(), from.meshes.end(),
                    [](const Mesh& of) { return !of.uv.empty(); })) {
        mesh.uv.assign(mesh.positions.size(), glm::vec2(0.0f));
        for (const Instance& instance : world.instances()) {
            const std::vector<glm::vec2>& uv = from.meshes[instance.mesh].uv;
            std::copy(uv.begin(), uv.end(), mesh.uv.begin() + instance.firstVertex);
        }
    }
    Scene scene;
    scene.name = from.name;
    scene.materials = from.materials;
    scene.alphaMasks = from.alphaMasks;
    scene.textures = from.textures;
    scene.nodes = from.nodes;
    scene.roots = from.roots;
    scene.lights = from.lights;
    scene.cameras = from.cameras;
    scene.animations = from.animations;
    for (Animation& animation : scene.animations)
        std::erase_if(animation.channels, [](const AnimationChannel& channel) {
            return channel.path == AnimationChannel::Path::kMorphWeight;
        });
    for (Node& node : scene.nodes) {
        node.mesh = node.skin = kNone;
        node.morphWeights.clear();
    }
    Node node;
    node.name = mesh.name;
    node.mesh = 0;
    scene.roots.push_back(int(scene.nodes.size()));
    scene.nodes.push_back(std::move(node));
    scene.meshes.push_back(std::move(mesh));
    return scene;
}

Scene grownScene(const World& world, Growth growth, uint64_t step, const LeafOptions& leaves) {
    SDAG_ASSERT(leaves.cover > 0.0);
    Scene scene = flattened(world);
    if (step == 0)
        return scene;
    switch (growth) {
    case Growth::kTessellate:
        for (uint64_t level = 0; level < step; ++level)
            divide(scene.meshes.front());
        break;
    case Growth::kInstance:
        repeat(scene.meshes.front(), world.boundsWorld(), step);
        break;
    case Growth::kLeaves:
        strew(scene, world, step, leaves);
        break;
    }
    return scene;
}

} // namespace shadowdag
