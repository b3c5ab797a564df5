// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/embree_baseline.h"

#include "cuda/error.h"
#include "cuda/thread_clock.h"
#include "hybrid/rays/float_mode.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace shadowdag {
namespace {

/// Rays of all segments in the format of one interface; Embree overwrites tfar, so every run packs
/// them again.
template <class Packet, uint32_t kWidth> struct PackedRays {
    std::vector<Packet> packets;
    size_t count;

    explicit PackedRays(const std::vector<WorldSegment>& segments)
        : packets((segments.size() + kWidth - 1) / kWidth), count(segments.size()) {
        for (size_t i = 0; i < packets.size() * kWidth; ++i) {
            const WorldSegment& s = segments[std::min(i, count - 1)];
            const glm::vec3 direction = s.to - s.from;
            Packet& p = packets[i / kWidth];
            const size_t k = i % kWidth;
            p.org_x[k] = s.from.x;
            p.org_y[k] = s.from.y;
            p.org_z[k] = s.from.z;
            p.dir_x[k] = direction.x;
            p.dir_y[k] = direction.y;
            p.dir_z[k] = direction.z;
            p.tnear[k] = 0.0f;
            p.tfar[k] = 1.0f;
            p.time[k] = 0.0f;
            p.mask[k] = ~0u;
            p.id[k] = uint32_t(k);
            p.flags[k] = 0;
        }
    }
    bool isBlocked(size_t i) const { return packets[i / kWidth].tfar[i % kWidth] < 0.0f; }
};

struct SingleRays {
    std::vector<RTCRay> rays;
    size_t count;

    explicit SingleRays(const std::vector<WorldSegment>& segments)
        : rays(segments.size()), count(segments.size()) {
        for (size_t i = 0; i < count; ++i) {
            const glm::vec3 direction = segments[i].to - segments[i].from;
            const glm::vec3& from = segments[i].from;
            rays[i] = {from.x,      from.y, from.z, 0.0f, direction.x, direction.y,
                       direction.z, 0.0f,   1.0f,   ~0u,  0,           0};
        }
    }
    bool isBlocked(size_t i) const { return rays[i].tfar < 0.0f; }
};

/// Runs `trace` over the packed rays and returns its processor time in seconds.
template <class F> double secondsOf(const F& trace) {
    const EmbreeFloatMode mode;
    const double start = threadSeconds();
    trace();
    return threadSeconds() - start;
}

template <class Rays> std::vector<uint8_t> pairResultsOf(const Rays& rays) {
    std::vector<uint8_t> blocked(rays.count);
    for (size_t i = 0; i < rays.count; ++i)
        blocked[i] = rays.isBlocked(i);
    return blocked;
}

/// Rejects hits in holes, by Embree's own coordinates of the hit.
void refuseHoles(const RTCFilterFunctionNArguments* args) {
    const AlphaMaskView masks = static_cast<const AlphaMaskSet*>(args->geometryUserPtr)->view();
    for (unsigned lane = 0; lane < args->N; ++lane) {
        const uint32_t triangle = RTCHitN_primID(args->hit, args->N, lane);
        const double u = RTCHitN_u(args->hit, args->N, lane);
        const double v = RTCHitN_v(args->hit, args->N, lane);
        if (args->valid[lane] == -1 && masks.isCut(triangle) &&
            !masks.isOpaque(triangle, 1.0 - u - v, u, v))
            args->valid[lane] = 0;
    }
}

void onEmbreeError(void* user, RTCError, const char* text) {
    *static_cast<std::string*>(user) = text ? text : "unknown error";
}

} // namespace

struct EmbreeBaseline::State {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::string lastError;
    std::vector<glm::vec4> vertices; ///< 16 bytes each because Embree reads a float past the third
    std::vector<glm::uvec3> triangles;
    AlphaMaskSet masks;
    RTCIntersectContextFlags flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;

    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        if (scene)
            rtcReleaseScene(scene);
        if (device)
            rtcReleaseDevice(device);
    }

    /// Returns the results and, in `seconds`, the time of tracing alone.
    std::vector<uint8_t> run(EmbreeCall call, const std::vector<WorldSegment>& segments,
                             double& seconds) const {
        seconds = 0;
        if (segments.empty())
            return {};
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = flags;
        alignas(64) int valid[16];
        std::fill(std::begin(valid), std::end(valid), -1);
        switch (call) {
        case EmbreeCall::kOccluded8: {
            PackedRays<RTCRay8, 8> rays(segments);
            seconds = secondsOf([&] {
                for (RTCRay8& packet : rays.packets)
                    rtcOccluded8(valid, scene, &context, &packet);
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kOccluded16: {
            PackedRays<RTCRay16, 16> rays(segments);
            seconds = secondsOf([&] {
                for (RTCRay16& packet : rays.packets)
                    rtcOccluded16(valid, scene, &context, &packet);
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kStream: {
            SingleRays rays(segments);
            seconds = secondsOf([&] {
                for (size_t i = 0; i < rays.count; i += kEmbreeStreamLength)
                    rtcOccluded1M(scene, &context, &rays.rays[i],
                                  unsigned(std::min(kEmbreeStreamLength, rays.count - i)),
                                  sizeof(RTCRay));
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kOccluded1:
            break;
        }
        SingleRays rays(segments);
        seconds = secondsOf([&] {
            for (RTCRay& ray : rays.rays)
                rtcOccluded1(scene, &context, &ray);
        });
        return pairResultsOf(rays);
    }
};

const char* embreeCallName(EmbreeCall call) {
    switch (call) {
    case EmbreeCall::kOccluded8:
        return "rtcOccluded8";
    case EmbreeCall::kOccluded16:
        return "rtcOccluded16";
    case EmbreeCall::kStream:
        return "rtcOccluded1M";
    case EmbreeCall::kOccluded1:
        break;
    }
    return "rtcOccluded1";
}

EmbreeBaseline::EmbreeBaseline(const TriangleView& triangles, const EmbreeBaselineOptions& options)
    : state_(std::make_unique<State>()) {
    State& s = *state_;
    for (const glm::vec3& p : triangles.positions) {
        if (!(std::fabs(p.x) < 1e18f && std::fabs(p.y) < 1e18f && std::fabs(p.z) < 1e18f))
            throw Error(ErrorKind::kInput,
                        "Embree ignores triangles beyond 1e18; a vertex is at (" +
                            std::to_string(p.x) + ", " + std::to_string(p.y) + ", " +
                            std::to_string(p.z) + "); scale the scene down");
        s.vertices.emplace_back(p, 0.0f);
    }
    s.triangles.assign(triangles.triangles.begin(), triangles.triangles.end());
    s.masks = AlphaMaskSet(triangles.masks);
    s.flags = options.isCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                 : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;

    const EmbreeFloatMode mode;
    s.device = rtcNewDevice(nullptr);
    if (!s.device)
        throw Error(ErrorKind::kResource, "Embree cannot start (code " +
                                              std::to_string(rtcGetDeviceError(nullptr)) +
                                              "); install libembree 3.13");
    rtcSetDeviceErrorFunction(s.device, onEmbreeError, &s.lastError);
    s.scene = rtcNewScene(s.device);
    rtcSetSceneFlags(s.scene, options.isRobust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(s.scene, options.useHighQuality ? RTC_BUILD_QUALITY_HIGH
                                                            : RTC_BUILD_QUALITY_MEDIUM);
    RTCGeometry mesh = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               s.vertices.data(), 0, sizeof(glm::vec4), s.vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s.triangles.data(),
                               0, sizeof(glm::uvec3), s.triangles.size());
    if (!s.masks.triangleCut.empty()) { // a filter costs time even if it rejects nothing
        rtcSetGeometryUserData(mesh, &s.masks);
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

EmbreeBaseline::~EmbreeBaseline() = default;

std::vector<uint8_t> EmbreeBaseline::occluded(EmbreeCall call,
                                              const std::vector<WorldSegment>& segments,
                                              double* seconds) const {
    double ignored;
    return state_->run(call, segments, seconds ? *seconds : ignored);
}

std::vector<EmbreeRate> EmbreeBaseline::measure(const std::vector<WorldSegment>& segments,
                                                int repeats) const {
    std::vector<EmbreeRate> rates;
    std::vector<std::vector<double>> seconds(std::size(kEmbreeCalls));
    const std::vector<uint8_t> single = occluded(EmbreeCall::kOccluded1, segments);
    for (const EmbreeCall call : kEmbreeCalls) {
        EmbreeRate rate;
        rate.call = call;
        const std::vector<uint8_t> answers = occluded(call, segments); // warm-up
        for (size_t i = 0; i < answers.size(); ++i) {
            rate.occludedCount += answers[i];
            rate.disagreementCount += answers[i] != single[i];
        }
        rates.push_back(rate);
    }
    for (int r = 0; r < repeats; ++r)
        for (size_t c = 0; c < rates.size(); ++c) {
            double s;
            state_->run(rates[c].call, segments, s);
            seconds[c].push_back(s);
        }
    for (size_t c = 0; c < rates.size(); ++c) {
        std::vector<double>& s = seconds[c];
        if (s.empty() || segments.empty())
            continue;
        std::sort(s.begin(), s.end());
        const auto rate = [&](double time) {
            return time > 0 ? double(segments.size()) / time * 1e-6 : 0.0;
        };
        rates[c].megaraysPerSecond = rate(s[s.size() / 2]);
        rates[c].megaraysPerSecondMin = rate(s.back());
        rates[c].megaraysPerSecondMax = rate(s.front());
    }
    return rates;
}

} // namespace shadowdag
