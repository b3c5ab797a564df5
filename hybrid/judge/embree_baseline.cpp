// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/embree_baseline.h"

#include "cuda/thread_clock.h"
#include "hybrid/rays/embree_scene_state.h"
#include "hybrid/rays/float_mode.h"

#include <algorithm>
#include <numeric>

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

} // namespace

struct EmbreeBaseline::State {
    EmbreeScene scene;
    bool isCoherent;

    State(const TriangleView& triangles, View<const uint32_t> which,
          const EmbreeBaselineOptions& options)
        : scene(triangles, which, {options.isRobust, options.useHighQuality}),
          isCoherent(options.isCoherent) {}

    /// Returns the results and, in `seconds`, the time of tracing alone.
    std::vector<uint8_t> run(EmbreeCall call, const std::vector<WorldSegment>& segments,
                             double& seconds) const {
        seconds = 0;
        if (segments.empty())
            return {};
        RTCScene embree = scene.state().scene;
        EmbreeQuery query(isCoherent);
        alignas(64) int valid[16];
        std::fill(std::begin(valid), std::end(valid), -1);
        switch (call) {
        case EmbreeCall::kOccluded8: {
            PackedRays<RTCRay8, 8> rays(segments);
            seconds = secondsOf([&] {
                for (RTCRay8& packet : rays.packets)
                    embreeOccluded8(valid, embree, query, &packet);
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kOccluded16: {
            PackedRays<RTCRay16, 16> rays(segments);
            seconds = secondsOf([&] {
                for (RTCRay16& packet : rays.packets)
                    embreeOccluded16(valid, embree, query, &packet);
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kStream: {
            SingleRays rays(segments);
            seconds = secondsOf([&] {
                for (size_t i = 0; i < rays.count; i += kEmbreeStreamLength)
                    embreeOccludedStream(embree, query, &rays.rays[i],
                                         unsigned(std::min(kEmbreeStreamLength, rays.count - i)));
            });
            return pairResultsOf(rays);
        }
        case EmbreeCall::kOccluded1:
            break;
        }
        SingleRays rays(segments);
        seconds = secondsOf([&] {
            for (RTCRay& ray : rays.rays)
                embreeOccluded1(embree, query, &ray);
        });
        return pairResultsOf(rays);
    }
};

std::span<const EmbreeCall> embreeCalls() {
    static constexpr EmbreeCall kCalls[] = {EmbreeCall::kOccluded1, EmbreeCall::kOccluded8,
                                            EmbreeCall::kOccluded16, EmbreeCall::kStream};
    return {kCalls, std::size(kCalls) - (kHasEmbreeRayStreams ? 0 : 1)};
}

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

EmbreeBaseline::EmbreeBaseline(const TriangleView& triangles,
                               const EmbreeBaselineOptions& options) {
    std::vector<uint32_t> all(triangles.triangles.count);
    std::iota(all.begin(), all.end(), 0u);
    state_ = std::make_unique<State>(triangles, viewOf(all), options);
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
    std::vector<std::vector<double>> perSecond(embreeCalls().size());
    const std::vector<uint8_t> single = occluded(EmbreeCall::kOccluded1, segments);
    for (const EmbreeCall call : embreeCalls()) {
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
            perSecond[c].push_back(s > 0 ? double(segments.size()) / s * 1e-6 : 0.0);
        }
    for (size_t c = 0; c < rates.size(); ++c)
        if (!perSecond[c].empty())
            rates[c].megaraysPerSecond = medianInterval(std::move(perSecond[c]));
    return rates;
}

} // namespace shadowdag
