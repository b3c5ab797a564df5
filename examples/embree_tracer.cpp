// SPDX-License-Identifier: Apache-2.0
// A tracer as a plug-in: Embree 3 or 4 by rtcOccluded1, robust, one ray after the other, on as many
// threads as it is asked to use. Built as libembree_tracer.so; docs/rays.md says how to run it.
#include "tools/workspace/tracer_api.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace {

struct Built {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::string lastError;

    ~Built() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
};

void* build(const ShadowdagTriangles* triangles, ShadowdagError error) {
    auto built = std::make_unique<Built>();
    built->device = rtcNewDevice(("threads=" + std::to_string(triangles->thread_count)).c_str());
    rtcSetDeviceErrorFunction(
        built->device,
        [](void* user, RTCError, const char* text) { *static_cast<std::string*>(user) = text; },
        &built->lastError);
    built->scene = rtcNewScene(built->device);
    rtcSetSceneFlags(built->scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry mesh = rtcNewGeometry(built->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree copies into buffers of its own, because it reads beyond the end of shared ones.
    auto* const positions = static_cast<float*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), triangles->vertex_count));
    auto* const indices = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(uint32_t), triangles->triangle_count));
    if (positions && indices) {
        std::copy_n(triangles->positions, 3 * triangles->vertex_count, positions);
        std::copy_n(triangles->triangles, 3 * triangles->triangle_count, indices);
    }
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(built->scene, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(built->scene);
    if (built->lastError.empty())
        return built.release();
    std::snprintf(error.text, error.size, "%s", built->lastError.c_str());
    return nullptr;
}

/// Answers segments [first, end).
void answer(RTCScene scene, const ShadowdagSegments* segments, uint64_t first, uint64_t end,
            uint8_t* blocked) {
#if RTC_VERSION_MAJOR < 4
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    for (uint64_t i = first; i < end; ++i) {
        const float *p = segments->samples + 3 * i, *n = segments->normals + 3 * i,
                    *light = segments->ends + 3 * i;
        // Off the surface, by 2^-16 of the largest coordinate: floats end at 2^-24 of it.
        const float lift =
            0x1p-16f * std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2]), 1.0f});
        RTCRay ray = {};
        ray.org_x = p[0] + lift * n[0];
        ray.org_y = p[1] + lift * n[1];
        ray.org_z = p[2] + lift * n[2];
        ray.dir_x = light[0] - ray.org_x;
        ray.dir_y = light[1] - ray.org_y;
        ray.dir_z = light[2] - ray.org_z;
        ray.tfar = 1.0f;
        ray.mask = ~0u;
#if RTC_VERSION_MAJOR < 4
        rtcOccluded1(scene, &context, &ray);
#else
        rtcOccluded1(scene, &ray);
#endif
        blocked[i] = ray.tfar < 0.0f;
    }
}

int occluded(void* of, const ShadowdagSegments* segments, uint8_t* blocked, ShadowdagError) {
    constexpr uint64_t kSlice = 4096;
    std::atomic<uint64_t> next{0};
    const auto work = [&] {
        for (uint64_t first; (first = next.fetch_add(kSlice)) < segments->count;)
            answer(static_cast<Built*>(of)->scene, segments, first,
                   std::min(first + kSlice, segments->count), blocked);
    };
    std::vector<std::jthread> others;
    while (others.size() + 1 < segments->thread_count)
        others.emplace_back(work);
    work();
    others.clear(); // waits for them
    return 0;
}

constexpr ShadowdagTracer kTracer = {SHADOWDAG_TRACER_VERSION, "Embree, robust", build, occluded,
                                     [](void* built) { delete static_cast<Built*>(built); }};

} // namespace

extern "C" const ShadowdagTracer* shadowdag_tracer() {
    return &kTracer;
}
