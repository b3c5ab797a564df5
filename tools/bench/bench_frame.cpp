// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_frame.h"

#include "cuda/thread_clock.h"
#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/clusters/cluster_rays.h"
#include "hybrid/judge/truth.h"
#include "tools/settings/parse.h"

#include <nlohmann/json.hpp>

#include <cstdio>

namespace shadowdag {

namespace {

/// Rays that Embree gets at once: packed, they take 48 bytes each.
constexpr size_t kChunkRays = 1 << 18;

/// The pairs of one cluster and one light.
struct ClusterLight {
    uint32_t cluster, light;
    size_t firstMask; ///< of the cluster's samples, into isAsked
    size_t firstPair; ///< into answers
    uint32_t pairCount;
};

/// The pairs: a sample and a light each, by cluster, light, then in the order of streams.
struct FramePairs {
    std::vector<uint32_t> samples; ///< by cluster, in the order of ReceiverGroups
    std::vector<uint32_t> sampleStart;
    std::vector<ClusterLight> asked;
    std::vector<uint8_t> isAsked;
    size_t pairCount = 0;
};

class FrameBench {
public:
    FrameBench(const BenchView& view, const World& world, const DagView& dag,
               const EmbreeBaseline& embree)
        : gbuffer_(view.gbuffer.view()), clusters_(view.clusters.view()), world_(world), dag_(dag),
          embree_(embree) {
        listPairs();
        const TruthSpace space = truthSpaceOf(world.triangles().positions);
        // Without alpha masks, as Embree here.
        geometry_ = {{world.triangles().positions, world.triangles().triangles},
                     space.origin,
                     space.diagonal};
        bvh_ = buildTriangleBvh(geometry_, viewOf(world.staticTriangles()));
    }

    size_t pairCount() const { return pairs_.pairCount; }
    size_t clusterLightCount() const { return pairs_.asked.size(); }
    size_t clusterCount() const { return clusters_.count(); }
    uint64_t exactBytes() const { return bvh_.bytes(); }
    size_t sampleCount() const { return pairs_.samples.size(); }

    /// By streams, one cluster and light at a time, as frames do.
    /// @param believe RayOptions::believe: all voxels or none
    std::vector<uint8_t> byStreams(float believe, double& seconds) {
        std::vector<uint8_t> answers(pairs_.pairCount), isDark;
        RayInputs inputs{dag_, {}};
        inputs.options.believe = believe;
        inputs.exact = {geometry_, bvh_.view()};
        ClusterRays rays(gbuffer_, inputs);
        const double start = threadSeconds();
        for (size_t a = 0; a < pairs_.asked.size();) {
            const uint32_t cluster = pairs_.asked[a].cluster;
            const View<const uint32_t> samples = samplesOf(cluster);
            rays.setCluster(samples);
            isDark.resize(samples.count);
            for (; a < pairs_.asked.size() && pairs_.asked[a].cluster == cluster; ++a) {
                const ClusterLight& c = pairs_.asked[a];
                const View<const uint8_t> isAsked{&pairs_.isAsked[c.firstMask], samples.count};
                rays.answer(c.light, world_.lights()[c.light], isAsked, viewOf(isDark));
                size_t next = c.firstPair;
                for (size_t i = 0; i < samples.count; ++i)
                    if (isAsked[i])
                        answers[next++] = isDark[i];
            }
        }
        seconds = threadSeconds() - start;
        return answers;
    }

    /// By the truth: Embree, its hits confirmed in double.
    std::vector<uint8_t> byTruth() const {
        std::vector<glm::uvec3> still;
        for (const uint32_t t : world_.staticTriangles())
            still.push_back(world_.triangles().triangles[t]);
        std::vector<uint32_t> ofStill(world_.triangles().count(), kBackground);
        for (uint32_t i = 0; i < world_.staticTriangles().size(); ++i)
            ofStill[world_.staticTriangles()[i]] = i;
        const Truth truth({world_.triangles().positions, viewOf(still)});
        std::vector<TruthRay> rays;
        rays.reserve(pairs_.pairCount);
        forEachPair([&](const ClusterLight& c, uint32_t s) {
            const uint32_t receiver = gbuffer_.triangle[s];
            rays.push_back(truth.pairRay(gbuffer_.positionWorld[s], gbuffer_.normalWorld[s],
                                         receiver == kBackground ? receiver : ofStill[receiver],
                                         world_.lights()[c.light].positionWorld));
        });
        std::vector<uint8_t> answers(rays.size());
        truth.traceBlocked(rays.data(), rays.size(), answers.data());
        return answers;
    }

    /// One by one: the definition.
    std::vector<uint8_t> bySingleRays() {
        std::vector<uint8_t> answers;
        answers.reserve(pairs_.pairCount);
        forEachPair([&](const ClusterLight& c, uint32_t sample) {
            answers.push_back(occluded(dag_, segment(c, sample)));
        });
        return answers;
    }

    /// By Embree, with finished segments.
    std::vector<uint8_t> byEmbree(EmbreeCall call, double& seconds) {
        std::vector<uint8_t> answers(pairs_.pairCount);
        std::vector<WorldSegment> chunk;
        std::vector<size_t> pairOf;
        seconds = 0;
        const auto flush = [&] {
            double s = 0;
            const std::vector<uint8_t> blocked = embree_.occluded(call, chunk, &s);
            seconds += s;
            for (size_t i = 0; i < chunk.size(); ++i)
                answers[pairOf[i]] = blocked[i];
            chunk.clear();
            pairOf.clear();
        };
        size_t pair = 0;
        forEachPair([&](const ClusterLight& c, uint32_t sample) {
            const DagSegment s = segment(c, sample);
            chunk.push_back({glm::vec3(dag_.grid.worldFromVoxel(glm::dvec3(s.from))),
                             glm::vec3(dag_.grid.worldFromVoxel(glm::dvec3(s.to)))});
            pairOf.push_back(pair);
            ++pair;
            if (chunk.size() == kChunkRays)
                flush();
        });
        flush();
        return answers;
    }

    /// Returns in how many pairs the light is completely lit, completely dark and mixed in its
    /// cluster.
    void trueShares(const std::vector<uint8_t>& answers, uint64_t shares[3]) const {
        for (const ClusterLight& c : pairs_.asked) {
            uint32_t dark = 0;
            for (uint32_t i = 0; i < c.pairCount; ++i)
                dark += answers[c.firstPair + i];
            shares[dark == 0 ? 0 : dark == c.pairCount ? 1 : 2] += c.pairCount;
        }
    }

private:
    View<const uint32_t> samplesOf(uint32_t cluster) const {
        const uint32_t begin = pairs_.sampleStart[cluster];
        return {&pairs_.samples[begin], pairs_.sampleStart[cluster + 1] - begin};
    }

    void listPairs() {
        FramePairs& p = pairs_;
        ReceiverGroups receivers;
        p.sampleStart.assign(1, 0);
        for (uint32_t cluster = 0; cluster < clusters_.count(); ++cluster) {
            // Rays that are neighbours in a packet then come from one 8 x 8 block of pixels.
            const uint32_t begin = clusters_.sampleStart[cluster],
                           count = clusters_.sampleCount(cluster);
            setReceivers(gbuffer_, {clusters_.samples.data + begin, count}, {dag_, {}}, receivers);
            for (const uint32_t i : receivers.order())
                p.samples.push_back(clusters_.samples[begin + i]);
            p.sampleStart.push_back(uint32_t(p.samples.size()));
            for (uint32_t l = 0; l < world_.lights().size(); ++l) {
                const Light& light = world_.lights()[l];
                if (light.kind == Light::kSun || // Embree gets finished segments: no end, no ray
                    !mayReach(light, clusters_.boxesWorld[cluster]))
                    continue;
                ClusterLight asked{cluster, l, p.isAsked.size(), p.pairCount, 0};
                for (uint32_t i = begin; i < begin + count; ++i) {
                    const uint32_t s = p.samples[i];
                    const bool is =
                        isPair(light, gbuffer_.positionWorld[s], gbuffer_.normalWorld[s]);
                    p.isAsked.push_back(is);
                    asked.pairCount += is;
                }
                if (asked.pairCount == 0) {
                    p.isAsked.resize(asked.firstMask);
                    continue;
                }
                p.pairCount += asked.pairCount;
                p.asked.push_back(asked);
            }
        }
    }

    template <class F> void forEachPair(const F& f) const {
        for (const ClusterLight& c : pairs_.asked)
            for (uint32_t i = pairs_.sampleStart[c.cluster]; i < pairs_.sampleStart[c.cluster + 1];
                 ++i)
                if (pairs_.isAsked[c.firstMask + i - pairs_.sampleStart[c.cluster]])
                    f(c, pairs_.samples[i]);
    }

    DagSegment segment(const ClusterLight& c, uint32_t sample) const {
        return shadowSegment(dag_.grid, gbuffer_.positionWorld[sample],
                             gbuffer_.normalWorld[sample], world_.lights()[c.light].positionWorld,
                             1.0f, 0);
    }

    GBufferView gbuffer_;
    ClusterView clusters_;
    const World& world_;
    DagView dag_;
    const EmbreeBaseline& embree_;
    TruthGeometry geometry_;
    TriangleBvh bvh_;
    FramePairs pairs_;
};

} // namespace

Json runFrameBench(const BenchView& view, const World& world, const DagView& dag,
                   const EmbreeBaseline& embree, int repeats) {
    FrameBench bench(view, world, dag, embree);
    const double pairCount = double(bench.pairCount());
    enum Method { kStreams, kTriangles, kEmbree, kEmbree8, kMethodCount };
    const char* const names[] = {"streams", "exact streams",
                                 embreeCallName(EmbreeCall::kOccluded16),
                                 embreeCallName(EmbreeCall::kOccluded8)};
    std::vector<uint8_t> answers[kMethodCount];
    std::vector<double> seconds[kMethodCount];
    uint64_t exactWrongCount = 0; // Embree itself misses a few at edges
    // The first run verifies and warms up.
    for (int r = -1; r < repeats; ++r) {
        double s[kMethodCount];
        answers[kStreams] = bench.byStreams(RayOptions{}.believe, s[kStreams]);
        answers[kTriangles] = bench.byStreams(0.0f, s[kTriangles]);
        answers[kEmbree] = bench.byEmbree(EmbreeCall::kOccluded16, s[kEmbree]);
        answers[kEmbree8] = bench.byEmbree(EmbreeCall::kOccluded8, s[kEmbree8]);
        checkInterrupted();
        if (r < 0) {
            if (answers[kStreams] != bench.bySingleRays())
                throw Error(ErrorKind::kInput, "bench voxel: streams and single rays differ over a "
                                               "frame; please report the scene");
            const std::vector<uint8_t> truth = bench.byTruth();
            for (size_t i = 0; i < truth.size(); ++i)
                exactWrongCount += answers[kTriangles][i] != truth[i];
            if (double(exactWrongCount) > 1e-5 * pairCount)
                throw Error(ErrorKind::kInput,
                            "bench voxel: exact streams and the truth differ in " +
                                std::to_string(exactWrongCount) + " of " +
                                std::to_string(truth.size()) + " pairs; please report the scene");
            continue;
        }
        for (int m = 0; m < kMethodCount; ++m)
            seconds[m].push_back(s[m]);
    }

    Json methods = Json::array();
    for (int m = 0; m < kMethodCount; ++m) {
        std::vector<double> nsPerPair, embreeOverIt;
        for (size_t r = 0; r < seconds[m].size(); ++r) {
            const double s = seconds[m][r];
            nsPerPair.push_back(pairCount > 0 ? 1e9 * s / pairCount : 0.0);
            embreeOverIt.push_back(s > 0 ? seconds[kEmbree][r] / s : 0.0); // of the same round
        }
        uint64_t differs = 0;
        for (size_t i = 0; i < answers[m].size(); ++i)
            differs += answers[m][i] != answers[kEmbree][i];
        Json method = {{"method", names[m]}, {"repeat_count", seconds[m].size()}};
        method.update(Spread::of(seconds[m]).toJson("cpu_s"));
        method.update(Spread::of(nsPerPair).toJson("ns_per_pair"));
        method.update(Spread::of(embreeOverIt).toJson("embree_over_it"));
        method["disagreement_count"] = differs;
        method["disagreement_share"] = pairCount > 0 ? double(differs) / pairCount : 0.0;
        methods.push_back(std::move(method));
    }
    uint64_t shares[3] = {};
    bench.trueShares(answers[kStreams], shares);
    const auto share = [&](uint64_t count) {
        return pairCount > 0 ? double(count) / pairCount : 0.0;
    };
    return {
        {"pair_count", bench.pairCount()},      {"cluster_count", bench.clusterCount()},
        {"sample_count", bench.sampleCount()},  {"cluster_light_count", bench.clusterLightCount()},
        {"true_lit_share", share(shares[0])},   {"true_dark_share", share(shares[1])},
        {"true_mixed_share", share(shares[2])}, {"exact_wrong_count", exactWrongCount},
        {"exact_bytes", bench.exactBytes()},    {"methods", std::move(methods)}};
}

void printFrameBench(std::ostream& out, const Json& result) {
    char line[240];
    const auto number = [](const Json& json, const char* key) { return json[key].get<double>(); };
    std::snprintf(
        line, sizeof line,
        "frame, %.0f x %.0f: %.0f pairs of %.0f samples, %.0f cluster-light pairs of %.0f "
        "clusters\n",
        number(result, "width"), number(result, "height"), number(result, "pair_count"),
        number(result, "sample_count"), number(result, "cluster_light_count"),
        number(result, "cluster_count"));
    out << line;
    std::snprintf(
        line, sizeof line,
        "pairs in cluster-light pairs completely lit %.1f %%, dark %.1f %%, mixed %.1f %%\n",
        100 * number(result, "true_lit_share"), 100 * number(result, "true_dark_share"),
        100 * number(result, "true_mixed_share"));
    out << line;
    std::snprintf(line, sizeof line,
                  "exact streams: %.0f pairs differ from the truth; hierarchy of triangles %s\n",
                  number(result, "exact_wrong_count"),
                  bytesText(number(result, "exact_bytes")).c_str());
    out << line;
    std::snprintf(line, sizeof line, "%-28s %9s %9s   %9s %9s %10s %12s\n", "one thread",
                  "ns / pair", "s (min", "median", "max)", "Embree/it", "disagreement");
    out << line;
    for (const Json& m : result["methods"]) {
        std::snprintf(line, sizeof line, "%-28s %9.2f %9.3f   %9.3f %9.3f %10.2f %10.3f %%\n",
                      m["method"].get<std::string>().c_str(), number(m, "ns_per_pair"),
                      number(m, "cpu_s_min"), number(m, "cpu_s"), number(m, "cpu_s_max"),
                      number(m, "embree_over_it"), 100 * number(m, "disagreement_share"));
        out << line;
    }
}

} // namespace shadowdag
