// SPDX-License-Identifier: Apache-2.0
// Small triangle scenes for the shadow-map tests: built by hand, batched, drawn, and traced by
// Embree.
#pragma once

#include "hybrid/rays/embree_version.h"
#include "scenes/batches.h"
#include "shadowmap/shadow_maps.h"

#include <cmath>
#include <random>

namespace shadowdag::test {

/// Returns the options that the counts of these tests hold for: pages of 64 texels, nine taps,
/// every map drawn from nothing.
inline ShadowMapOptions freshMaps() {
    ShadowMapOptions options;
    options.pageTexels = 64;
    options.taps = 9;
    options.useStaticOptimization = false;
    return options;
}

/// Returns the default bias with nine taps.
inline ShadowMapBias nineTaps() {
    ShadowMapBias bias;
    bias.taps = 9;
    return bias;
}

/// Triangles with their own storage, one instance.
struct SmallScene {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    AlphaMaskSet masks; ///< empty: nothing is cut

    TriangleView view() const { return {viewOf(positions), viewOf(triangles), masks.view()}; }
    BatchSet batches() const {
        return BatchSet(view(), std::vector<uint32_t>(triangles.size(), 0u));
    }
    void addTriangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        const uint32_t n = uint32_t(positions.size());
        positions.insert(positions.end(), {a, b, c});
        triangles.push_back({n, n + 1, n + 2});
    }
    /// Adds a parallelogram centred at c with half sides u and v, divided into n x n cells with
    /// shared corners.
    void addQuad(const glm::vec3& c, const glm::vec3& u, const glm::vec3& v, uint32_t n = 1) {
        const uint32_t first = uint32_t(positions.size());
        for (uint32_t j = 0; j <= n; ++j)
            for (uint32_t i = 0; i <= n; ++i)
                positions.push_back(c + u * (2.0f * float(i) / float(n) - 1.0f) +
                                    v * (2.0f * float(j) / float(n) - 1.0f));
        for (uint32_t j = 0; j < n; ++j)
            for (uint32_t i = 0; i < n; ++i) {
                const uint32_t p = first + j * (n + 1) + i;
                triangles.push_back({p, p + 1, p + n + 2});
                triangles.push_back({p, p + n + 2, p + n + 1});
            }
    }
    void addBox(const glm::vec3& lo, const glm::vec3& hi, uint32_t n = 1) {
        const glm::vec3 c = (lo + hi) * 0.5f, e = (hi - lo) * 0.5f;
        for (int axis = 0; axis < 3; ++axis)
            for (int side = -1; side <= 1; side += 2) {
                glm::vec3 w(0.0f), u(0.0f), v(0.0f);
                w[axis] = e[axis] * float(side);
                u[(axis + 1) % 3] = e[(axis + 1) % 3];
                v[(axis + 2) % 3] = e[(axis + 2) % 3];
                addQuad(c + w, u, v, n);
            }
    }
    /// Adds a sphere of triangles with shared corners.
    void addSphere(const glm::vec3& c, float radius, uint32_t rings) {
        const uint32_t first = uint32_t(positions.size());
        const uint32_t sectors = 2 * rings;
        for (uint32_t j = 0; j <= rings; ++j)
            for (uint32_t i = 0; i < sectors; ++i) {
                const float theta = float(M_PI) * float(j) / float(rings);
                const float phi = 2.0f * float(M_PI) * float(i) / float(sectors);
                positions.push_back(c + radius * glm::vec3(std::sin(theta) * std::cos(phi),
                                                           std::cos(theta),
                                                           std::sin(theta) * std::sin(phi)));
            }
        for (uint32_t j = 0; j < rings; ++j)
            for (uint32_t i = 0; i < sectors; ++i) {
                const uint32_t k = (i + 1) % sectors;
                const uint32_t a = first + j * sectors, b = a + sectors;
                triangles.push_back({a + i, b + i, b + k});
                triangles.push_back({a + i, b + k, a + k});
            }
    }
};

/// Returns a unit vector, uniform over directions.
inline glm::vec3 randomDirection(std::mt19937& rng) {
    std::normal_distribution<float> normal;
    for (;;) {
        const glm::vec3 d(normal(rng), normal(rng), normal(rng));
        const float length = glm::length(d);
        if (length > 1e-3f)
            return d / length;
    }
}

/// Returns a scene of `count` random triangles of edge about `size` in the cube [-1, 1]^3 times
/// `extent`.
inline SmallScene randomScene(std::mt19937& rng, uint32_t count, float extent, float size) {
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    SmallScene scene;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3 c = extent * glm::vec3(unit(rng), unit(rng), unit(rng));
        const auto corner = [&] { return c + size * glm::vec3(unit(rng), unit(rng), unit(rng)); };
        const glm::vec3 a = corner(), b = corner();
        scene.addTriangle(a, b, corner());
    }
    return scene;
}

/// A box that holds everything within the range of a light: its map then is needed whole.
inline Box wholeBox(const glm::vec3& light, float range) {
    Box box;
    box.add(light - range);
    box.add(light + range);
    return box;
}

/// Draws one map of a light, needed whole unless `receiverBoxes` says otherwise.
struct DrawnMap {
    ShadowMaps maps{Backend::kCpu};
    StageTimes stages;

    DrawnMap(const SmallScene& scene, const glm::vec3& light, float range, uint32_t faceTexels,
             std::vector<Box> receiverBoxes = {}, const ShadowMapOptions& options = freshMaps()) {
        if (receiverBoxes.empty())
            receiverBoxes.push_back(wholeBox(light, range));
        std::vector<MapReceiver> receivers;
        for (uint32_t i = 0; i < receiverBoxes.size(); ++i)
            receivers.push_back({i, 0});
        const BatchSet batches = scene.batches();
        maps.build({{light, range, 0, faceTexels}}, receiverBoxes, receivers, scene.view(),
                   batches.view(), options, stages);
    }
};

/// Embree over a small scene, robust: whether a segment is blocked, and where first.
class Oracle {
public:
    explicit Oracle(const SmallScene& scene) {
        device_ = rtcNewDevice(nullptr);
        scene_ = rtcNewScene(device_);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        if (!scene.triangles.empty()) {
            void* v = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                              RTC_FORMAT_FLOAT3, 12, scene.positions.size());
            memcpy(v, scene.positions.data(), scene.positions.size() * 12);
            void* t = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              12, scene.triangles.size());
            memcpy(t, scene.triangles.data(), scene.triangles.size() * 12);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    Oracle(const Oracle&) = delete;
    Oracle& operator=(const Oracle&) = delete;
    ~Oracle() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    /// Returns the first hit of origin + t d for t in (tNear, tFar), as t; infinity for none.
    float firstHit(const glm::vec3& origin, const glm::vec3& d, float tNear, float tFar,
                   uint32_t* triangle = nullptr) const {
        EmbreeQuery query(/*isCoherent=*/false);
        RTCRayHit hit{};
        hit.ray.org_x = origin.x, hit.ray.org_y = origin.y, hit.ray.org_z = origin.z;
        hit.ray.dir_x = d.x, hit.ray.dir_y = d.y, hit.ray.dir_z = d.z;
        hit.ray.tnear = tNear;
        hit.ray.tfar = tFar;
        hit.ray.mask = ~0u;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        embreeIntersect1(scene_, query, &hit);
        if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            return std::numeric_limits<float>::infinity();
        if (triangle)
            *triangle = hit.hit.primID;
        return hit.ray.tfar;
    }

private:
    RTCDevice device_;
    RTCScene scene_;
};

} // namespace shadowdag::test
