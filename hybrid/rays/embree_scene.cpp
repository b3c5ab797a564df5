// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/embree_scene.h"

#include "cuda/error.h"
#include "hybrid/rays/embree_device.h"
#include "hybrid/rays/embree_scene_state.h"
#include "hybrid/rays/float_mode.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {
namespace {

/// Embree ignores triangles beyond.
constexpr float kLargestCoordinate = 1e18f;

/// Rejects hits in holes, by Embree's own coordinates of the hit.
void refuseHoles(const RTCFilterFunctionNArguments* args) {
    const auto& state = *static_cast<const EmbreeScene::State*>(args->geometryUserPtr);
    const AlphaMaskView masks = state.masks.view();
    for (unsigned lane = 0; lane < args->N; ++lane) {
        if (args->valid[lane] != -1)
            continue;
        const uint32_t triangle = state.sourceOf[RTCHitN_primID(args->hit, args->N, lane)];
        const double u = RTCHitN_u(args->hit, args->N, lane);
        const double v = RTCHitN_v(args->hit, args->N, lane);
        if (masks.isCut(triangle) && !masks.isOpaque(triangle, 1.0 - u - v, u, v))
            args->valid[lane] = 0;
    }
}

/// Traces as EmbreeScene::trace, kWidth rays at a time. @param occluded of embree_version.h
template <class Packet, uint32_t kWidth>
void tracePackets(RTCScene scene, void (*occluded)(const int*, RTCScene, EmbreeQuery&, Packet*),
                  const Light& light, View<const glm::vec3> positionsWorld,
                  View<const glm::vec3> normalsWorld, View<const uint32_t> which,
                  View<uint8_t> blocked) {
    EmbreeQuery query(/*isCoherent=*/true);
    const bool isDirectional = light.kind == Light::kSun;
    alignas(64) Packet packet;
    alignas(64) int valid[kWidth];
    for (uint32_t k = 0; k < kWidth; ++k) {
        packet.tnear[k] = packet.time[k] = 0.0f;
        packet.mask[k] = ~0u;
        packet.id[k] = k;
        packet.flags[k] = 0;
    }
    for (size_t first = 0; first < which.count; first += kWidth) {
        const auto count = uint32_t(std::min<size_t>(kWidth, which.count - first));
        for (uint32_t k = 0; k < kWidth; ++k) {
            const uint32_t sample = which[first + std::min(k, count - 1)];
            const glm::vec3& position = positionsWorld[sample];
            const glm::vec3 toLight = pointAtLight(light, position) - position;
            // Rays from a light end with the rounding of their whole length.
            const glm::vec3 start = liftedSample(position, normalsWorld[sample],
                                                 isDirectional ? glm::vec3(0.0f) : toLight);
            const glm::vec3 from = isDirectional ? start : light.positionWorld;
            const glm::vec3 way = isDirectional ? toLight : start - from;
            valid[k] = k < count ? -1 : 0;
            packet.org_x[k] = from.x;
            packet.org_y[k] = from.y;
            packet.org_z[k] = from.z;
            packet.dir_x[k] = way.x;
            packet.dir_y[k] = way.y;
            packet.dir_z[k] = way.z;
            packet.tfar[k] = 1.0f;
        }
        occluded(valid, scene, query, &packet);
        for (uint32_t k = 0; k < count; ++k)
            blocked[first + k] = packet.tfar[k] < 0.0f;
    }
}

void onEmbreeError(void* user, RTCError, const char* text) {
    *static_cast<std::string*>(user) = text ? text : "unknown error";
}

bool countBytes(void* user, ssize_t bytes, bool) {
    *static_cast<std::atomic<int64_t>*>(user) += bytes;
    return true;
}

} // namespace

EmbreeScene::EmbreeScene(const TriangleView& triangles, View<const uint32_t> which,
                         const EmbreeSceneOptions& options)
    : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.vertices.reserve(triangles.positions.count);
    for (const glm::vec3& p : triangles.positions) {
        for (int a = 0; a < 3; ++a)
            if (!(std::fabs(p[a]) < kLargestCoordinate))
                throw Error(ErrorKind::kInput,
                            "Embree ignores triangles beyond 1e18; a vertex is at (" +
                                std::to_string(p.x) + ", " + std::to_string(p.y) + ", " +
                                std::to_string(p.z) + "); scale the scene down");
        s.vertices.emplace_back(p, 0.0f);
    }
    s.triangles.reserve(which.count);
    bool hasHoles = false;
    for (const uint32_t triangle : which) {
        s.triangles.push_back(triangles.triangles[triangle]);
        hasHoles = hasHoles || triangles.masks.isCut(triangle);
    }

    const EmbreeFloatMode mode;
    s.device = newEmbreeDevice();
    s.hasNative16 = rtcGetDeviceProperty(s.device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    rtcSetDeviceErrorFunction(s.device, onEmbreeError, &s.lastError);
    rtcSetDeviceMemoryMonitorFunction(s.device, countBytes, &s.embreeBytes);
    s.scene = rtcNewScene(s.device);
    rtcSetSceneFlags(s.scene, options.isRobust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(s.scene, options.useHighQuality ? RTC_BUILD_QUALITY_HIGH
                                                            : RTC_BUILD_QUALITY_MEDIUM);
    RTCGeometry mesh = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               s.vertices.data(), 0, sizeof(glm::vec4), s.vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s.triangles.data(),
                               0, sizeof(glm::uvec3), s.triangles.size());
    if (hasHoles) { // a filter costs time even if it rejects nothing
        s.masks = AlphaMaskSet(triangles.masks);
        s.sourceOf.assign(which.begin(), which.end());
        rtcSetGeometryUserData(mesh, &s);
        rtcSetGeometryOccludedFilterFunction(mesh, refuseHoles);
    }
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(s.scene, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(s.scene);
    if (!s.lastError.empty())
        throw Error(ErrorKind::kResource,
                    "Embree cannot build over " + std::to_string(s.triangles.size()) +
                        " triangles: " + s.lastError + "; free memory or use a smaller scene");
}

EmbreeScene::~EmbreeScene() = default;

uint64_t EmbreeScene::bytes() const {
    const State& s = *state_;
    return uint64_t(s.embreeBytes.load()) + s.vertices.size() * sizeof(glm::vec4) +
           s.triangles.size() * sizeof(glm::uvec3) + s.sourceOf.size() * sizeof(uint32_t);
}

uint32_t EmbreeScene::packetWidth() const {
    return state_->hasNative16 ? 16 : 8;
}

void EmbreeScene::trace(const Light& light, View<const glm::vec3> positionsWorld,
                        View<const glm::vec3> normalsWorld, View<const uint32_t> which,
                        View<uint8_t> blocked) const {
    SDAG_ASSERT(blocked.count >= which.count);
    const EmbreeFloatMode mode;
    if (state_->hasNative16)
        tracePackets<RTCRay16, 16>(state_->scene, embreeOccluded16, light, positionsWorld,
                                   normalsWorld, which, blocked);
    else
        tracePackets<RTCRay8, 8>(state_->scene, embreeOccluded8, light, positionsWorld,
                                 normalsWorld, which, blocked);
}
glm::vec3 liftedSample(const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                       const glm::vec3& wayWorld) {
    constexpr float kShare = 1.0f / 262144.0f;
    float largest = 0.0f;
    for (int a = 0; a < 3; ++a)
        largest = std::max(largest, std::max(std::fabs(positionWorld[a]), std::fabs(wayWorld[a])));
    return positionWorld + kShare * largest * normalWorld;
}

} // namespace shadowdag
