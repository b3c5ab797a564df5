// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_voxel.h"

#include "cuda/thread_clock.h"
#include "tools/bench/bench_frame.h"
#include "tools/settings/parse.h"
#include "voxel/dag_stream.h"
#include "voxel/dag_trace_pass.h"
#include "voxel/nanovdb_baseline.h"
#include "voxel/voxelize.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <ostream>

namespace shadowdag {

namespace {

using PairResults = std::vector<uint8_t>;

/// Sets one thread for its lifetime.
class OneThread {
public:
    OneThread() : before_(threadCount()) { setThreadCount(1); }
    ~OneThread() { setThreadCount(before_); }
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;

private:
    int before_;
};

/// One tracer: computes the results of a set of rays and returns the processor time in seconds.
struct Tracer {
    std::string name;
    std::function<PairResults(const BenchRays&, double& seconds)> trace;
};

PairResults traceSingly(const DagView& dag, const BenchRays& rays, double& seconds) {
    PairResults blocked(rays.voxel.size());
    const double start = threadSeconds();
    for (size_t i = 0; i < blocked.size(); ++i)
        blocked[i] = occluded(dag, rays.voxel[i]);
    seconds = threadSeconds() - start;
    return blocked;
}

/// The pass as frames use it; it may have a kernel of its own.
PairResults tracePass(const DagView& dag, const BenchRays& rays, double& seconds) {
    std::vector<uint32_t> bits((rays.voxel.size() + 31) / 32);
    const double start = threadSeconds();
    traceSegments(Backend::kCpu, dag, viewOf(rays.voxel), 0, viewOf(bits));
    seconds = threadSeconds() - start;
    PairResults blocked(rays.voxel.size());
    for (size_t i = 0; i < blocked.size(); ++i)
        blocked[i] = bits[i / 32] >> (i % 32) & 1;
    return blocked;
}

/// All rays as one stream: neighbours in the list are traced together.
PairResults traceAsStream(const DagView& dag, StreamIsa isa, const BenchRays& rays,
                          double& seconds) {
    PairResults blocked(rays.voxel.size());
    const double start = threadSeconds();
    traceStream(dag, viewOf(rays.voxel), viewOf(blocked), isa);
    seconds = threadSeconds() - start;
    return blocked;
}

uint64_t countOf(const PairResults& answers) {
    return uint64_t(std::count(answers.begin(), answers.end(), 1));
}

/// Returns how many rays are dark in the first results and lit in the second.
uint64_t countDarkLit(const PairResults& dark, const PairResults& lit) {
    uint64_t count = 0;
    for (size_t i = 0; i < dark.size(); ++i)
        count += dark[i] && !lit[i];
    return count;
}

void checkShare(const std::string& what, uint64_t count, size_t total, double tolerance) {
    if (double(count) > tolerance * double(total))
        throw Error(ErrorKind::kInput,
                    "bench voxel: " + std::to_string(count) + " of " + std::to_string(total) +
                        " rays are " + what + ", more than the share of " + numberText(tolerance) +
                        " that rounding can cause; nothing was measured, please report the scene");
}

/// Voxelizes again and again; returns the DAG and, in `json`, times and sizes.
Dag measureVoxelizing(const World& world, const VoxelBenchOptions& options, const Console& console,
                      Json& json) {
    std::vector<double> wall, processor;
    Dag dag;
    double spent = 0;
    for (int r = 0;
         r < options.repeats && (r == 0 || spent + wall.back() < options.voxelizeSeconds); ++r) {
        const std::clock_t processorStart = std::clock();
        const auto start = std::chrono::steady_clock::now();
        dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                       gridAround(world.staticBoundsWorld(), options.resolutionLog2),
                       console.progress("voxelize"));
        wall.push_back(
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        processor.push_back(double(std::clock() - processorStart) / CLOCKS_PER_SEC);
        spent += wall.back();
        checkInterrupted();
    }
    const DagStats stats = computeDagStats(dag);
    json = {{"repeat_count", wall.size()}, {"thread_count", threadCount()}};
    json.update(Spread::of(processor).toJson("cpu_s"));
    json.update(Spread::of(wall).toJson("wall_s"));
    json["voxel_count"] = stats.voxelCount;
    json["node_counts"] = stats.nodeCounts;
    json["traced_bytes"] = stats.tracedBytes;
    json["traced_bits_per_voxel"] =
        stats.voxelCount > 0 ? 8.0 * double(stats.tracedBytes) / double(stats.voxelCount) : 0.0;
    return dag;
}

} // namespace

Json runVoxelBench(const World& world, const Camera& camera, const VoxelBenchOptions& options,
                   const Console& console) {
    SDAG_ASSERT(options.repeats >= 1);
    Json voxelizing;
    const Dag dag = measureVoxelizing(world, options, console, voxelizing);

    const BenchView view = makeBenchView(world, camera, options.width, options.height);
    std::vector<BenchRays> rays;
    for (const RayOrder order : kRayOrders)
        rays.push_back(makeBenchRays(view, world, dag.grid, order));
    const size_t rayCount = rays[0].voxel.size();
    if (rayCount == 0)
        throw Error(ErrorKind::kInput,
                    "bench voxel: no light reaches a view sample; use --lights N or --camera");

    // The DAG contains the static triangles, so the baselines must, too.
    std::vector<glm::uvec3> triangles;
    for (const uint32_t t : world.staticTriangles())
        triangles.push_back(world.triangles().triangles[t]);
    const EmbreeBaseline embree({world.triangles().positions, viewOf(triangles)});
    std::unique_ptr<NanoVdbBaseline> nanoVdb;
    if (options.resolutionLog2 <= options.nanoVdbResolutionLog2)
        nanoVdb = std::make_unique<NanoVdbBaseline>(dag);

    // As a frame traces them on the CPU.
    const WideDag wide = buildWideDag(dag);
    DagView traced = dag.view();
    traced.wide = wide.view();
    std::vector<Tracer> tracers = {
        {"occluded", [&](const BenchRays& r, double& s) { return traceSingly(traced, r, s); }},
        {"traceSegments", [&](const BenchRays& r, double& s) { return tracePass(traced, r, s); }}};
    for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512})
        if (hasStreamIsa(isa))
            tracers.push_back({std::string("traceStream ") + streamIsaName(isa),
                               [&traced, isa](const BenchRays& r, double& s) {
                                   return traceAsStream(traced, isa, r, s);
                               }});
    const size_t ourCount = tracers.size(); // Embree's first call is next
    for (const EmbreeCall call : embreeCalls())
        tracers.push_back({embreeCallName(call), [&embree, call](const BenchRays& r, double& s) {
                               return embree.occluded(call, r.world, &s);
                           }});
    if (nanoVdb)
        tracers.push_back({"NanoVDB HDDA", [&](const BenchRays& r, double& s) {
                               return nanoVdb->occluded(r.voxel, &s);
                           }});

    // Verified before anything is timed; this is also the warm-up.
    const OneThread oneThread;
    Json rates = Json::array();
    Json checks;
    std::vector<std::vector<double>> seconds(tracers.size() * rays.size());
    for (size_t o = 0; o < rays.size(); ++o) {
        std::vector<PairResults> answers;
        for (const Tracer& tracer : tracers) {
            double ignored;
            answers.push_back(tracer.trace(rays[o], ignored));
            rates.push_back({{"tracer", tracer.name},
                             {"order", rayOrderName(kRayOrders[o])},
                             {"occluded_count", countOf(answers.back())}});
            checkInterrupted();
        }
        for (size_t t = 1; t < ourCount; ++t)
            if (answers[t] != answers[0])
                throw Error(ErrorKind::kInput,
                            "bench voxel: " + tracers[t].name +
                                " and single rays differ; please report the scene");
        const uint64_t falseLight = countDarkLit(answers[ourCount], answers[0]);
        const uint64_t falseShadow = countDarkLit(answers[0], answers[ourCount]);
        checkShare("lit by ours and dark by Embree", falseLight, rayCount, kEmbreeTolerance);
        Json check = {{"false_shadow_count", falseShadow}, {"false_light_count", falseLight}};
        if (nanoVdb) {
            const uint64_t missed = countDarkLit(answers.back(), answers[0]);
            const uint64_t margin = countDarkLit(answers[0], answers.back());
            check["lit_by_ours_dark_by_nanovdb_count"] = missed;
            check["dark_by_ours_lit_by_nanovdb_count"] = margin;
            checkShare("lit by ours and dark by NanoVDB", missed, rayCount, kNanoVdbTolerance);
            checkShare("dark by ours and lit by NanoVDB", margin, rayCount, kNanoVdbTolerance);
        }
        if (o > 0 && check != checks)
            throw Error(ErrorKind::kInput, "bench voxel: the order of rays changed their results");
        checks = std::move(check);
    }
    if (nanoVdb && nanoVdb->voxelCount() != voxelizing["voxel_count"].get<uint64_t>())
        throw Error(ErrorKind::kInput,
                    "bench voxel: NanoVDB's grid and the DAG hold different voxels");

    for (int r = 0; r < options.repeats; ++r)
        for (size_t o = 0; o < rays.size(); ++o)
            for (size_t t = 0; t < tracers.size(); ++t) {
                double s;
                tracers[t].trace(rays[o], s);
                seconds[o * tracers.size() + t].push_back(s);
                checkInterrupted();
            }
    std::vector<double> ours(rays.size(), 0.0);
    for (size_t i = 0; i < rates.size(); ++i) {
        std::vector<double> perSecond;
        for (const double s : seconds[i])
            perSecond.push_back(s > 0 ? double(rayCount) / s * 1e-6 : 0.0);
        const Spread spread = Spread::of(perSecond);
        rates[i].update(spread.toJson("megarays_per_s"));
        if (i % tracers.size() < ourCount)
            ours[i / tracers.size()] = std::max(ours[i / tracers.size()], spread.median.value);
    }
    // Ours is our fastest tracer.
    for (size_t i = 0; i < rates.size(); ++i) {
        const double rate = rates[i]["megarays_per_s"].get<double>();
        rates[i]["ours_over_it"] = rate > 0 ? ours[i / tracers.size()] / rate : 0.0;
    }

    Json result = {{"bench", "voxel"},
                   {"resolution", dag.grid.resolution()},
                   {"width", options.width},
                   {"height", options.height},
                   {"light_count", world.lights().size()},
                   {"triangle_count", triangles.size()},
                   {"ray_count", rayCount},
                   {"repeat_count", options.repeats},
                   {"voxelize", std::move(voxelizing)},
                   {"checks", std::move(checks)},
                   {"rates", std::move(rates)}};
    if (nanoVdb)
        result["nanovdb_bytes"] = nanoVdb->bytes();
    rays.clear(); // a gigabyte at 1920 x 1080, no longer needed
    const BenchView frameView =
        makeBenchView(world, camera, options.frameWidth, options.frameHeight);
    result["frame"] = runFrameBench(frameView, world, traced, embree, options.repeats);
    result["frame"]["width"] = options.frameWidth;
    result["frame"]["height"] = options.frameHeight;
    return result;
}

void printVoxelBench(std::ostream& out, const Json& result) {
    char line[200];
    const auto number = [](const Json& json, const std::string& key) {
        return json[key].get<double>();
    };
    const Json& v = result["voxelize"];
    std::snprintf(line, sizeof line, "%.0f^3: %.0f voxels, DAG %s (%.3f bits a voxel)\n",
                  number(result, "resolution"), number(v, "voxel_count"),
                  bytesText(number(v, "traced_bytes")).c_str(), number(v, "traced_bits_per_voxel"));
    out << line;
    std::snprintf(line, sizeof line,
                  "voxelize: %.2f (%.2f .. %.2f) s of processor, %.2f s wall, %.0f threads\n",
                  number(v, "cpu_s"), number(v, "cpu_s_low"), number(v, "cpu_s_high"),
                  number(v, "wall_s"), number(v, "thread_count"));
    out << line;
    if (result.contains("nanovdb_bytes"))
        out << "NanoVDB mask grid: " << bytesText(number(result, "nanovdb_bytes")) << "\n";
    const double rays = number(result, "ray_count");
    std::snprintf(line, sizeof line,
                  "%.0f rays, %.0f lights; verified against Embree: false shadow %.4f %%, false "
                  "light %.5f %%\n",
                  rays, number(result, "light_count"),
                  100 * number(result["checks"], "false_shadow_count") / rays,
                  100 * number(result["checks"], "false_light_count") / rays);
    out << line;
    if (result.contains("nanovdb_bytes")) {
        std::snprintf(line, sizeof line,
                      "compared with NanoVDB: %.4f %% dark by ours alone (margin), %.4f %% by "
                      "NanoVDB alone\n",
                      100 * number(result["checks"], "dark_by_ours_lit_by_nanovdb_count") / rays,
                      100 * number(result["checks"], "lit_by_ours_dark_by_nanovdb_count") / rays);
        out << line;
    }
    std::snprintf(line, sizeof line, "%-8s %-20s %9s %9s   %9s %9s\n", "order", "tracer",
                  "M rays/s", "(low", "high)", "ours / it");
    out << line;
    for (const Json& rate : result["rates"]) {
        std::snprintf(line, sizeof line, "%-8s %-20s %9.3f (%8.3f .. %8.3f) %9.2f\n",
                      rate["order"].get<std::string>().c_str(),
                      rate["tracer"].get<std::string>().c_str(), number(rate, "megarays_per_s"),
                      number(rate, "megarays_per_s_low"), number(rate, "megarays_per_s_high"),
                      number(rate, "ours_over_it"));
        out << line;
    }
    printFrameBench(out, result["frame"]);
}

} // namespace shadowdag
