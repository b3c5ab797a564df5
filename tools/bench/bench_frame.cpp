// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_frame.h"

#include "cuda/thread_clock.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/gbuffer/lights.h"
#include "voxel/shaft_receivers.h"

#include <cstdio>

namespace shadowdag {

namespace {

/// Rays that Embree is given at once: packed, they take 48 bytes each.
constexpr size_t kChunkRays = 1 << 18;

/// The pairs of one cluster and one light.
struct ClusterLight {
    uint32_t cluster, light;
    size_t firstMask; ///< of the cluster's samples, into isAsked
    size_t firstPair; ///< into answers
    uint32_t pairCount;
};

/// What is asked: a sample and a light a pair, by cluster, light, then as shafts sort samples.
struct FramePairs {
    std::vector<uint32_t> samples; ///< by cluster, in the order of shafts
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
    }

    size_t pairCount() const { return pairs_.pairCount; }
    size_t clusterLightCount() const { return pairs_.asked.size(); }
    size_t clusterCount() const { return clusters_.count(); }
    size_t sampleCount() const { return pairs_.samples.size(); }

    /// By shafts, parts of clusters and streams; where only proofs are asked for, kUnproven.
    std::vector<uint8_t> byShafts(bool onlyProofs, double& seconds, ShaftCounts& counts) {
        std::vector<uint8_t> answers(pairs_.pairCount);
        std::vector<uint8_t> blocked;
        const double start = threadSeconds();
        for (size_t a = 0; a < pairs_.asked.size();) {
            const uint32_t cluster = pairs_.asked[a].cluster;
            prepare(cluster);
            blocked.resize(receivers_.count());
            for (; a < pairs_.asked.size() && pairs_.asked[a].cluster == cluster; ++a) {
                const ClusterLight& c = pairs_.asked[a];
                const View<const uint8_t> isAsked{&pairs_.isAsked[c.firstMask], blocked.size()};
                receivers_.answer(
                    dag_, world_.lights()[c.light].positionWorld, isAsked, viewOf(blocked), counts,
                    onlyProofs ? ShaftReceivers::kOnlyProofs : ShaftReceivers::kProofsAndRays);
                size_t next = c.firstPair;
                for (size_t i = 0; i < blocked.size(); ++i)
                    if (isAsked[i])
                        answers[next++] = blocked[i];
            }
        }
        seconds = threadSeconds() - start;
        return answers;
    }

    /// By streams of the same segments, a cluster and light at a time.
    std::vector<uint8_t> byStreams(double& seconds) {
        std::vector<uint8_t> answers(pairs_.pairCount);
        std::vector<uint32_t> which;
        std::vector<DagSegment> segments;
        const double start = threadSeconds();
        for (size_t a = 0; a < pairs_.asked.size();) {
            const uint32_t cluster = pairs_.asked[a].cluster;
            prepare(cluster);
            for (; a < pairs_.asked.size() && pairs_.asked[a].cluster == cluster; ++a) {
                const ClusterLight& c = pairs_.asked[a];
                which.clear();
                for (uint32_t i = 0; i < receivers_.count(); ++i)
                    if (pairs_.isAsked[c.firstMask + i])
                        which.push_back(i);
                segments.resize(which.size());
                receivers_.starts().segments(world_.lights()[c.light].positionWorld, viewOf(which),
                                             segments.data());
                traceStream(dag_, viewOf(segments), {&answers[c.firstPair], which.size()});
            }
        }
        seconds = threadSeconds() - start;
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

    /// By rtcOccluded16; of pairs already known (not kUnproven) nothing is asked.
    std::vector<uint8_t> byEmbree(const std::vector<uint8_t>* known, double& seconds) {
        std::vector<uint8_t> answers(pairs_.pairCount);
        std::vector<WorldSegment> chunk;
        std::vector<size_t> pairOf;
        seconds = 0;
        const auto flush = [&] {
            double s = 0;
            const std::vector<uint8_t> blocked =
                embree_.occluded(EmbreeCall::kOccluded16, chunk, &s);
            seconds += s;
            for (size_t i = 0; i < chunk.size(); ++i)
                answers[pairOf[i]] = blocked[i];
            chunk.clear();
            pairOf.clear();
        };
        size_t pair = 0;
        forEachPair([&](const ClusterLight& c, uint32_t sample) {
            if (known && (*known)[pair] != ShaftReceivers::kUnproven) {
                answers[pair] = (*known)[pair];
            } else {
                const DagSegment s = segment(c, sample);
                chunk.push_back({glm::vec3(dag_.grid.worldFromVoxel(glm::dvec3(s.from))),
                                 glm::vec3(dag_.grid.worldFromVoxel(glm::dvec3(s.to)))});
                pairOf.push_back(pair);
            }
            ++pair;
            if (chunk.size() == kChunkRays)
                flush();
        });
        flush();
        return answers;
    }

    /// Returns in how many pairs the light is wholly lit, wholly dark and mixed in its cluster.
    void trueShares(const std::vector<uint8_t>& answers, uint64_t shares[3]) const {
        for (const ClusterLight& c : pairs_.asked) {
            uint32_t dark = 0;
            for (uint32_t i = 0; i < c.pairCount; ++i)
                dark += answers[c.firstPair + i];
            shares[dark == 0 ? 0 : dark == c.pairCount ? 1 : 2] += c.pairCount;
        }
    }

private:
    void prepare(uint32_t cluster) {
        receivers_.reset(dag_.grid, 1.0f);
        for (uint32_t i = pairs_.sampleStart[cluster]; i < pairs_.sampleStart[cluster + 1]; ++i) {
            const uint32_t s = pairs_.samples[i];
            receivers_.add(gbuffer_.positionWorld[s], gbuffer_.normalWorld[s],
                           s % gbuffer_.width % kTileSize, s / gbuffer_.width % kTileSize);
        }
        receivers_.build();
    }

    void listPairs() {
        FramePairs& p = pairs_;
        p.sampleStart.assign(1, 0);
        for (uint32_t cluster = 0; cluster < clusters_.count(); ++cluster) {
            // Sorted as shafts sort: rays that are neighbours in a packet are then neighbours in
            // an 8 x 8 block of pixels.
            const uint32_t begin = clusters_.sampleStart[cluster],
                           count = clusters_.sampleCount(cluster);
            receivers_.reset(dag_.grid, 1.0f);
            for (uint32_t i = begin; i < begin + count; ++i) {
                const uint32_t s = clusters_.samples[i];
                receivers_.add(gbuffer_.positionWorld[s], gbuffer_.normalWorld[s],
                               s % gbuffer_.width % kTileSize, s / gbuffer_.width % kTileSize);
            }
            receivers_.build();
            for (const uint32_t i : receivers_.order())
                p.samples.push_back(clusters_.samples[begin + i]);
            p.sampleStart.push_back(uint32_t(p.samples.size()));
            for (uint32_t l = 0; l < world_.lights().size(); ++l) {
                const Light& light = world_.lights()[l];
                if (light.kind == Light::kSun || // neither streams nor shafts are for suns
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
    FramePairs pairs_;
    ShaftReceivers receivers_;
};

} // namespace

Json runFrameBench(const BenchView& view, const World& world, const DagView& dag,
                   const EmbreeBaseline& embree, int repeats) {
    FrameBench bench(view, world, dag, embree);
    const double pairCount = double(bench.pairCount());
    enum Method { kShafts, kStreams, kEmbree, kEmbreeShafts, kMethodCount };
    const char* const names[] = {"shafts and streams", "streams", "rtcOccluded16",
                                 "rtcOccluded16 behind shafts"};
    std::vector<uint8_t> answers[kMethodCount];
    std::vector<double> seconds[kMethodCount], proofSeconds;
    ShaftCounts counts;
    // The first time verifies and warms up.
    for (int r = -1; r < repeats; ++r) {
        double s[kMethodCount], proofs;
        ShaftCounts ignored;
        answers[kShafts] = bench.byShafts(false, s[kShafts], r < 0 ? counts : ignored);
        answers[kStreams] = bench.byStreams(s[kStreams]);
        answers[kEmbree] = bench.byEmbree(nullptr, s[kEmbree]);
        const std::vector<uint8_t> known = bench.byShafts(true, proofs, ignored);
        answers[kEmbreeShafts] = bench.byEmbree(&known, s[kEmbreeShafts]);
        s[kEmbreeShafts] += proofs;
        checkInterrupted();
        if (r < 0) {
            const std::vector<uint8_t> single = bench.bySingleRays();
            for (const Method m : {kShafts, kStreams})
                if (answers[m] != single)
                    throw Error(ErrorKind::kInput,
                                std::string("bench voxel: ") + names[m] +
                                    " and occluded differ over a frame; please report the scene");
            continue;
        }
        for (int m = 0; m < kMethodCount; ++m)
            seconds[m].push_back(s[m]);
        proofSeconds.push_back(proofs);
    }

    Json methods = Json::array();
    const double embreeSeconds = Spread::of(seconds[kEmbree]).median;
    for (int m = 0; m < kMethodCount; ++m) {
        const Spread spread = Spread::of(seconds[m]);
        uint64_t differs = 0;
        for (size_t i = 0; i < answers[m].size(); ++i)
            differs += answers[m][i] != answers[kEmbree][i];
        methods.push_back(
            {{"method", names[m]},
             {"cpu_s", spread.median},
             {"cpu_s_min", spread.min},
             {"cpu_s_max", spread.max},
             {"ns_per_pair", pairCount > 0 ? 1e9 * spread.median / pairCount : 0.0},
             {"embree_over_it", spread.median > 0 ? embreeSeconds / spread.median : 0.0},
             {"disagreement_count", differs},
             {"disagreement_share", pairCount > 0 ? double(differs) / pairCount : 0.0}});
    }
    uint64_t shares[3] = {};
    bench.trueShares(answers[kShafts], shares);
    const auto share = [&](uint64_t count) {
        return pairCount > 0 ? double(count) / pairCount : 0.0;
    };
    const double asked = double(bench.clusterLightCount());
    return {{"pair_count", bench.pairCount()},
            {"cluster_count", bench.clusterCount()},
            {"sample_count", bench.sampleCount()},
            {"cluster_light_count", bench.clusterLightCount()},
            {"proven_lit_cluster_light_count", counts.litCount},
            {"proven_dark_cluster_light_count", counts.darkCount},
            {"proven_lit_share", share(counts.litPairCount)},
            {"proven_dark_share", share(counts.darkPairCount)},
            {"true_lit_share", share(shares[0])},
            {"true_dark_share", share(shares[1])},
            {"true_mixed_share", share(shares[2])},
            {"shaft_count", counts.shaftCount},
            {"mean_cut_cell_count",
             counts.cutCount > 0 ? double(counts.cutCellCount) / double(counts.cutCount) : 0.0},
            {"proof_us_per_cluster_light",
             asked > 0 ? 1e6 * Spread::of(proofSeconds).median / asked : 0.0},
            {"methods", std::move(methods)}};
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
    std::snprintf(line, sizeof line,
                  "pairs in cluster-light pairs wholly lit %.1f %%, dark %.1f %%, mixed %.1f %%; "
                  "pairs proven lit %.1f %%, dark %.1f %%\n",
                  100 * number(result, "true_lit_share"), 100 * number(result, "true_dark_share"),
                  100 * number(result, "true_mixed_share"),
                  100 * number(result, "proven_lit_share"),
                  100 * number(result, "proven_dark_share"));
    out << line;
    std::snprintf(line, sizeof line,
                  "proofs: %.2f us a cluster-light pair, %.2f shafts each; cuts of %.1f cells\n",
                  number(result, "proof_us_per_cluster_light"),
                  number(result, "shaft_count") / number(result, "cluster_light_count"),
                  number(result, "mean_cut_cell_count"));
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
