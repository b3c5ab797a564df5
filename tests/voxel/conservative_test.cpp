// SPDX-License-Identifier: Apache-2.0
// Voxels are conservative: a ray that Embree finds blocked is never free in the DAG. If the two
// disagree, integers decide, because Embree rounds, too.
#include "hybrid/rays/embree_version.h"
#include "scenes/builtin.h"
#include "tests/voxel/exact_geometry.h"
#include "tests/voxel/soup.h"
#include "voxel/dag_trace.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>

namespace shadowdag {
namespace {

/// Embree over the triangles, robust mode, one ray at a time.
class Embree {
public:
    explicit Embree(const TriangleView& t)
        : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<glm::vec3*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                    sizeof(glm::vec3), t.positions.count));
        std::copy(t.positions.begin(), t.positions.end(), vertices);
        auto* indices = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), t.count()));
        std::copy(t.triangles.begin(), t.triangles.end(), indices);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~Embree() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    Embree(const Embree&) = delete;
    bool isBlocked(const glm::vec3& from, const glm::vec3& to) const {
        EmbreeQuery query(/*isCoherent=*/false);
        const glm::vec3 d = to - from;
        RTCRay ray{from.x, from.y, from.z, 0, d.x, d.y, d.z, 0, 1, ~0u, 0, 0};
        embreeOccluded1(scene_, query, &ray);
        return ray.tfar < 0;
    }

private:
    RTCDevice device_;
    RTCScene scene_;
};

bool isBlockedExactly(const TriangleView& triangles, View<const uint32_t> which,
                      const glm::vec3& from, const glm::vec3& to) {
    Box ray;
    ray.add(from);
    ray.add(to);
    for (const uint32_t t : which) {
        Box box;
        std::vector<exact::Point> corners;
        for (int i = 0; i < 3; ++i)
            box.add(triangles.vertex(t, i));
        if (!overlaps(ray, box))
            continue;
        for (int i = 0; i < 3; ++i)
            corners.push_back(exact::point(triangles.vertex(t, i)));
        if (exact::isDegenerate(corners))
            continue; // Embree does not see it either
        if (exact::segmentMeetsTriangle(exact::point(from), exact::point(to), corners))
            return true;
    }
    return false;
}

/// Rays between empty voxels: a third anywhere, a third short, a third aimed at a vertex or an edge
/// of a triangle.
void expectConservative(const TriangleView& triangles, View<const uint32_t> which,
                        const Box& bounds, uint32_t log2, int rayCount, unsigned seed) {
    const VoxelGrid grid = gridAround(bounds, log2);
    const Dag dag = voxelize(triangles, which, grid);
    const Embree embree(triangles);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    const auto point = [&] {
        return bounds.min + bounds.extent() * glm::vec3(unit(random), unit(random), unit(random));
    };
    const auto direction = [&] {
        return glm::vec3(unit(random), unit(random), unit(random)) * 2.0f - 1.0f;
    };
    const auto isInEmptyVoxel = [&](const glm::vec3& p) {
        const glm::dvec3 v = glm::floor(grid.voxelFromWorld(glm::dvec3(p)));
        for (int a = 0; a < 3; ++a)
            if (v[a] < 0 || v[a] >= grid.resolution())
                return true;
        return !isOccupied(dag.view(), uint32_t(v.x), uint32_t(v.y), uint32_t(v.z));
    };
    const float size = glm::length(bounds.extent());
    int rays = 0, blocked = 0, dark = 0, ties = 0, freeInDag = 0;
    for (int tries = 0; rays < rayCount && tries < 20 * rayCount; ++tries) {
        glm::vec3 from, to;
        const float length = size * std::exp2(-10 * unit(random));
        if (tries % 3 == 0) {
            from = point();
            to = point();
        } else if (tries % 3 == 1) {
            from = point();
            to = from + direction() * length;
        } else {
            const uint32_t t = which[random() % which.count];
            const int corner = int(random() % 3);
            const float along = random() % 3 ? unit(random) : 0.0f;
            const glm::vec3 p =
                glm::mix(triangles.vertex(t, corner), triangles.vertex(t, (corner + 1) % 3), along);
            const glm::vec3 d = direction();
            from = p - d * length;
            to = p + d * (size * std::exp2(-10 * unit(random)));
        }
        if (from == to || !isInEmptyVoxel(from) || !isInEmptyVoxel(to))
            continue;
        ++rays;
        const DagSegment segment{glm::vec3(grid.voxelFromWorld(glm::dvec3(from))),
                                 glm::vec3(grid.voxelFromWorld(glm::dvec3(to)))};
        const bool isDark = occluded(dag.view(), segment);
        const bool isBlocked = embree.isBlocked(from, to);
        dark += isDark;
        blocked += isBlocked;
        if (isBlocked && !isDark) {
            ++freeInDag;
            ASSERT_FALSE(isBlockedExactly(triangles, which, from, to))
                << "seed " << seed << " try " << tries << ": a ray slips through";
            ++ties;
        }
    }
    std::cout << "    " << rays << " rays, blocked " << blocked << ", dark " << dark
              << ", blocked but free " << freeInDag << " (of these rounding of Embree's: " << ties
              << ")\n";
    EXPECT_EQ(rays, rayCount);
    EXPECT_GT(blocked, rayCount / 20);
    EXPECT_GT(rayCount - blocked, rayCount / 20);
    EXPECT_LT(dark - blocked, rayCount / 5)
        << "voxels block far more than triangles: is the grid too coarse to tell?";
}

TEST(Conservative, NoRayThatEmbreeFindsBlockedIsFreeInASoup) {
    std::mt19937 random(61);
    Soup soup = randomSoup(2000, 3.0f, random);
    expectConservative(soup.view(), soup.all(), soup.bounds(), 9, 1000000, 62);
}

TEST(Conservative, NoRayThatEmbreeFindsBlockedIsFreeInTheAtrium) {
    const Scene scene = makeBuiltin("atrium");
    const World world(scene, {});
    expectConservative(world.triangles(), viewOf(world.staticTriangles()), world.boundsWorld(), 10,
                       1000000, 63);
}

} // namespace
} // namespace shadowdag
