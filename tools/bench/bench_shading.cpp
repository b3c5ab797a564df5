// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_shading.h"

#include "cuda/quantile_interval.h"
#include "cuda/thread_clock.h"
#include "hybrid/frame.h"
#include "hybrid/frame/lookup_lanes.h"
#include "hybrid/frame/sample_lanes.h"
#include "tools/workspace/timing.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace shadowdag {

namespace {

constexpr uint32_t kTaps[] = {1, 4, 9};
constexpr uint32_t kNoLookups = 0; ///< in place of taps: every pair is lit
const glm::vec3 kAlbedo(0.5f);

/// A frame whose lights have all been drawn into maps, shaded again on one thread.
class ShadedFrame {
public:
    ShadedFrame(const FrameRenderer& renderer, const World& world)
        : gbuffer_(renderer.gbuffer()), clusters_(renderer.clusters()),
          lists_(renderer.clusterLights()), maps_(renderer.shadowMaps()), lights_(world.lights()) {}

    /// Shades every cluster and calls `looked(map, bias)` after each lookup; pairs without one are
    /// lit.
    /// @param taps of the filter, or kNoLookups
    template <class Looked> void shade(uint32_t taps, const Looked& looked) {
        ShadowMapBias bias;
        bias.taps = taps;
        pairCount_ = lookupCount_ = 0;
        for (size_t cluster = 0; cluster < clusters_.count(); ++cluster) {
            start(cluster);
            for (uint32_t l = lists_.start[cluster]; l < lists_.start[cluster + 1]; ++l) {
                const uint32_t askedCount = lanes_.mark(lights_[lists_.lights[l]]);
                if (askedCount == 0)
                    continue;
                pairCount_ += askedCount;
                const uint32_t map = lists_.record[l];
                if (taps == kNoLookups || map == kProvenLit) {
                    std::fill_n(lanes_.seen().data, lanes_.count(), uint8_t(255));
                } else {
                    lookupCount_ += askedCount;
                    lookups_.lookUp(maps_, map, bias, lanes_.arrays(), lanes_.isAsked(),
                                    lanes_.seen());
                    looked(map, bias);
                }
                lanes_.add();
            }
            for (uint32_t i = 0; i < lanes_.count(); ++i)
                color_ += lanes_.color(i);
        }
    }

    /// Returns how many lookups differ from the one text's.
    uint64_t differingCount(uint32_t taps) {
        uint64_t count = 0;
        shade(taps, [&](uint32_t map, const ShadowMapBias& bias) {
            for (uint32_t i = 0; i < lanes_.count(); ++i)
                if (lanes_.isAsked()[i])
                    count += lanes_.seen()[i] !=
                             lookupVisibility(maps_, map, vectorOf(lanes_.arrays().position, i),
                                              vectorOf(lanes_.arrays().normal, i), bias);
        });
        return count;
    }

    uint64_t pairCount() const { return pairCount_; }
    uint64_t lookupCount() const { return lookupCount_; }
    /// Returns the sum of all colours so far, so that no compiler leaves them out.
    const glm::vec3& color() const { return color_; }

private:
    static glm::vec3 vectorOf(const float* const (&arrays)[3], uint32_t i) {
        return {arrays[0][i], arrays[1][i], arrays[2][i]};
    }

    void start(size_t cluster) {
        const uint32_t count = clusters_.sampleCount(cluster);
        const uint32_t* const samples = clusters_.samples.data + clusters_.sampleStart[cluster];
        lanes_.reset(count);
        for (uint32_t i = 0; i < count; ++i)
            lanes_.set(i, gbuffer_.positionWorld[samples[i]], gbuffer_.normalWorld[samples[i]],
                       kAlbedo, glm::vec3(0.0f));
    }

    GBufferView gbuffer_;
    ClusterView clusters_;
    ClusterLightsView lists_;
    ShadowMapView maps_;
    const std::vector<Light>& lights_;
    SampleLanes lanes_;
    LookupLanes lookups_;
    uint64_t pairCount_ = 0, lookupCount_ = 0;
    glm::vec3 color_{0.0f};
};

/// Returns what the times of a run are for each of `count` items in ns, less those of `base`, if
/// any.
Json rowOf(const std::string& name, const Timing& timing, const Timing* base, uint64_t count) {
    std::vector<double> nsEach;
    for (size_t i = 0; i < timing.totalMs.size(); ++i)
        nsEach.push_back(1e6 / double(count) *
                         (timing.totalMs[i] - (base ? base->totalMs[i] : 0.0)));
    const QuantileInterval interval = medianInterval(nsEach);
    return {{"name", name},
            {"ns_each", interval.value},
            {"ns_each_low", interval.low},
            {"ns_each_high", interval.high},
            {"ns_each_confidence", interval.confidence},
            {"repeat_count", nsEach.size()}};
}

} // namespace

Json runShadingBench(const World& world, const Camera& camera, const ShadingBenchOptions& options,
                     const Console& console) {
    SDAG_ASSERT(options.repeats >= 1);
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    FrameOptions frame;
    frame.width = options.width;
    frame.height = options.height;
    frame.maps.taps = *std::max_element(std::begin(kTaps), std::end(kTaps));
    frame.maps.poolBytes = 1ull << 30;
    frame.recordPairs = frame.recordQuantities = false;
    const auto maps = makeCostModel("texels:0");
    const auto draw = [&](size_t) {
        checkInterrupted();
        return renderer.render(camera, *maps, frame).stages;
    };
    {
        const auto step = console.step("draw the maps");
        draw(0);
    }
    const std::vector<Timing> frames = timeInTurn(1, 1, options.repeats, draw);

    ShadedFrame shaded(renderer, world);
    uint64_t differing = 0, lookups = 0;
    for (const uint32_t taps : kTaps) {
        differing += shaded.differingCount(taps);
        lookups += shaded.lookupCount();
    }
    const uint64_t lookupCount =
        shaded.lookupCount(); // of the last; a run without any sets it to 0
    if (shaded.pairCount() == 0)
        throw Error(
            ErrorKind::kInput,
            "bench shading: no light reaches a visible surface; use --lights N or --camera");
    if (differing > 0)
        throw Error(ErrorKind::kInput,
                    "bench shading: " + std::to_string(differing) + " of " +
                        std::to_string(lookups) +
                        " lookups in lanes differ from the shared code's; please "
                        "report the scene");
    constexpr size_t kRunCount = 1 + std::size(kTaps);
    const std::vector<Timing> runs = timeInTurn(kRunCount, 1, options.repeats, [&](size_t i) {
        checkInterrupted();
        const double start = threadSeconds();
        shaded.shade(i == 0 ? kNoLookups : kTaps[i - 1], [](uint32_t, const ShadowMapBias&) {});
        StageTimes stages;
        stages.stagesMs.emplace_back("processor", 1e3 * (threadSeconds() - start));
        return stages;
    });

    Json rows = Json::array({rowOf("marking and colour", runs[0], nullptr, shaded.pairCount())});
    for (size_t t = 0; t < std::size(kTaps); ++t)
        if (lookupCount > 0)
            rows.push_back(
                rowOf("lookup, " + std::to_string(kTaps[t]) + (kTaps[t] == 1 ? " tap" : " taps"),
                      runs[t + 1], runs.data(), lookupCount));
    SDAG_ASSERT(shaded.color().x >= 0.0f);
    return {{"bench", "shading"},
            {"width", options.width},
            {"height", options.height},
            {"pair_count", shaded.pairCount()},
            {"lookup_count", lookupCount},
            {"repeat_count", options.repeats},
            {"thread_count", threadCount()},
            {"checks", {{"lookup_count", lookups}, {"differing_count", differing}}},
            {"frame", frames[0].toJson()},
            {"rows", rows}};
}

void printShadingBench(std::ostream& out, const Json& result) {
    char line[200];
    std::snprintf(line, sizeof line, "%llu pairs, %llu of them looked up in maps\n",
                  (unsigned long long)result["pair_count"].get<uint64_t>(),
                  (unsigned long long)result["lookup_count"].get<uint64_t>());
    out << line;
    std::snprintf(line, sizeof line,
                  "verified: %llu lookups with 1, 4 and 9 taps, bit for bit as the shared code's\n",
                  (unsigned long long)result["checks"]["lookup_count"].get<uint64_t>());
    out << line << "one thread, ns a pair (median, and interval, of processor time):\n";
    for (const Json& row : result["rows"]) {
        std::snprintf(line, sizeof line, "  %-20s %8.2f  (%.2f to %.2f)\n",
                      row["name"].get<std::string>().c_str(), row["ns_each"].get<double>(),
                      row["ns_each_low"].get<double>(), row["ns_each_high"].get<double>());
        out << line;
    }
    std::snprintf(line, sizeof line,
                  "stages of a frame whose maps are kept, %d threads, ms (medians):\n",
                  result["thread_count"].get<int>());
    out << line;
    for (const auto& [stage, ms] : result["frame"]["stages_ms"].items()) {
        std::snprintf(line, sizeof line, "  %-20s %8.2f\n", stage.c_str(), ms.get<double>());
        out << line;
    }
}

} // namespace shadowdag
