// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/builtin_measure.h"

#include "cuda/parallel_for.h"

#include <atomic>
#include <cmath>
#include <limits>

namespace shadowdag {

namespace {

void refuseHoles(const RTCFilterFunctionNArguments* args) {
    const AlphaMaskView& masks = *static_cast<const AlphaMaskView*>(args->geometryUserPtr);
    for (unsigned lane = 0; lane < args->N; ++lane) {
        const uint32_t triangle = RTCHitN_primID(args->hit, args->N, lane);
        const double u = RTCHitN_u(args->hit, args->N, lane),
                     v = RTCHitN_v(args->hit, args->N, lane);
        if (masks.isCut(triangle) && !masks.isOpaque(triangle, 1.0 - u - v, u, v))
            args->valid[lane] = 0;
    }
}

} // namespace

EmbreeWorld::EmbreeWorld(const World& world, const glm::dvec3& originWorld) {
    const TriangleView triangles = world.triangles();
    for (const glm::vec3& position : triangles.positions)
        positions_.push_back(glm::vec3(glm::dvec3(position) - originWorld));
    positions_.emplace_back(0.0f);
    device_ = rtcNewDevice("threads=2");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               positions_.data(), 0, sizeof(glm::vec3), positions_.size() - 1);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles.triangles.data, 0, sizeof(glm::uvec3), triangles.count());
    masks_ = triangles.masks;
    rtcSetGeometryUserData(geometry, &masks_);
    rtcSetGeometryIntersectFilterFunction(geometry, refuseHoles);
    rtcSetGeometryOccludedFilterFunction(geometry, refuseHoles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
}

EmbreeWorld::~EmbreeWorld() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
}

RTCRayHit EmbreeWorld::trace(const glm::vec3& origin, const glm::vec3& direction,
                             float tnear) const {
    RTCRayHit hit{};
    hit.ray.org_x = origin.x, hit.ray.org_y = origin.y, hit.ray.org_z = origin.z;
    hit.ray.dir_x = direction.x, hit.ray.dir_y = direction.y, hit.ray.dir_z = direction.z;
    hit.ray.tnear = tnear;
    hit.ray.tfar = std::numeric_limits<float>::infinity();
    hit.ray.mask = ~0u;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    EmbreeQuery query(/*isCoherent=*/false);
    embreeIntersect1(scene_, query, &hit);
    return hit;
}

bool EmbreeWorld::blocked(const glm::vec3& from, const glm::vec3& to) const {
    RTCRay ray{};
    const glm::vec3 d = to - from;
    ray.org_x = from.x, ray.org_y = from.y, ray.org_z = from.z;
    ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z;
    ray.tfar = 1.0f;
    ray.mask = ~0u;
    EmbreeQuery query(/*isCoherent=*/false);
    embreeOccluded1(scene_, query, &ray);
    return ray.tfar < 0.0f;
}

FrameCounts countFrame(const World& world, int width, int height) {
    const EmbreeWorld embree(world);
    const Camera camera = world.cameras().at(0);
    std::atomic<uint64_t> samples = 0, pairs = 0, dark = 0, fights = 0;
    const float tangent = std::tan(camera.yfov / 2);
    cpuParallelRanges(size_t(width) * size_t(height), 256, [&](size_t begin, size_t end) {
        FrameCounts sum;
        for (size_t i = begin; i < end; ++i) {
            const float x = ((float(i % size_t(width)) + 0.5f) / float(width) * 2 - 1) * tangent *
                            (float(width) / float(height));
            const float y = (1 - (float(i / size_t(width)) + 0.5f) / float(height) * 2) * tangent;
            const glm::vec3 direction =
                glm::normalize(camera.forward + camera.right() * x + camera.up * y);
            const RTCRayHit hit = embree.trace(camera.positionWorld, direction, camera.znear);
            if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID)
                continue;
            ++sum.sampleCount;
            const RTCRayHit behind =
                embree.trace(camera.positionWorld, direction, hit.ray.tfar + 1e-5f);
            const auto& material = world.triangleMaterial();
            sum.fightCount += behind.hit.geomID != RTC_INVALID_GEOMETRY_ID &&
                              behind.ray.tfar < hit.ray.tfar + 1e-4f &&
                              material[behind.hit.primID] != material[hit.hit.primID];
            glm::vec3 normal = glm::normalize(glm::vec3(hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z));
            if (glm::dot(normal, direction) > 0)
                normal = -normal;
            const glm::vec3 point = camera.positionWorld + direction * hit.ray.tfar;
            for (const Light& light : world.lights()) {
                if (!lightReaches(light, point) ||
                    glm::dot(normal, light.positionWorld - point) <= 0)
                    continue;
                ++sum.pairCount;
                sum.darkCount += embree.blocked(point + normal * 1e-3f, light.positionWorld);
            }
        }
        samples += sum.sampleCount;
        pairs += sum.pairCount;
        dark += sum.darkCount;
        fights += sum.fightCount;
    });
    return {samples, pairs, dark, fights};
}

} // namespace shadowdag
