// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_device.h"

#include "cuda/buffer.h"
#include "cuda/timer.h"
#include "tools/settings/parse.h"
#include "voxel/dag_trace_pass.h"
#include "voxel/nanovdb_baseline.h"
#include "voxel/voxelize.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <ostream>

namespace shadowdag {

namespace {

/// The rays of one order on the backend, and what is written for them.
struct DeviceRays {
    DeviceRays(Backend backend, const std::vector<DagSegment>& rays)
        : segments(backend, "bench rays"), bits(backend, "bench bits", (rays.size() + 31) / 32),
          blocked(backend, "bench bytes", rays.size()) {
        segments.upload(rays);
    }
    Buffer<DagSegment> segments;
    Buffer<uint32_t> bits;
    Buffer<uint8_t> blocked;
};

/// Returns one byte a ray of the bits of traceSegments.
std::vector<uint8_t> bytesOf(const std::vector<uint32_t>& bits, size_t count) {
    std::vector<uint8_t> bytes(count);
    for (size_t i = 0; i < count; ++i)
        bytes[i] = bits[i / 32] >> (i % 32) & 1;
    return bytes;
}

/// A tracer: queues its pass over the rays, and returns what it answered.
struct DeviceTracer {
    std::string name;
    std::function<void(DeviceRays&)> trace;
    std::function<std::vector<uint8_t>(const DeviceRays&)> answers;
};

uint64_t countDifferences(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
    uint64_t count = 0;
    for (size_t i = 0; i < a.size(); ++i)
        count += a[i] != b[i];
    return count;
}

} // namespace

Json runDeviceBench(Backend backend, const World& world, const Camera& camera,
                    const VoxelBenchOptions& options, const Console& console) {
    SDAG_ASSERT(options.repeats >= 1);
    const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                             gridAround(world.staticBoundsWorld(), options.resolutionLog2),
                             console.progress("voxelize"));
    const BenchView view = makeBenchView(world, camera, options.width, options.height);
    Buffer<uint32_t> words(backend, "bench DAG");
    words.upload(dag.words);
    const DagView traced{std::as_const(words).view(), dag.rootAddress, dag.grid};
    std::unique_ptr<NanoVdbBaseline> nanoVdb;
    if (options.resolutionLog2 <= options.nanoVdbResolutionLog2)
        nanoVdb = std::make_unique<NanoVdbBaseline>(dag);

    std::vector<DeviceTracer> tracers = {
        {"traceSegments",
         [&](DeviceRays& r) {
             traceSegments(backend, traced, std::as_const(r.segments).view(), 0, r.bits.view());
         },
         [](const DeviceRays& r) { return bytesOf(r.bits.download(), r.segments.size()); }}};
    if (nanoVdb)
        tracers.push_back({"NanoVDB HDDA",
                           [&](DeviceRays& r) {
                               nanoVdb->trace(backend, std::as_const(r.segments).view(),
                                              r.blocked.view());
                           },
                           [](const DeviceRays& r) { return r.blocked.download(); }});

    Json rates = Json::array();
    size_t rayCount = 0;
    uint64_t nanoVdbDifferences = 0;
    for (const RayOrder order : kRayOrders) {
        const std::vector<DagSegment> rays = makeBenchRays(view, world, dag.grid, order).voxel;
        rayCount = rays.size();
        if (rayCount == 0)
            throw Error(ErrorKind::kInput,
                        "bench voxel: no light reaches a view sample; use --lights N or --camera");
        DeviceRays onDevice(backend, rays);
        // Verified before anything is timed; this is also the warm-up.
        std::vector<uint32_t> bits((rayCount + 31) / 32);
        traceSegments(Backend::kCpu, dag.view(), viewOf(rays), 0, viewOf(bits));
        const std::vector<uint8_t> expected = bytesOf(bits, rayCount);
        for (const DeviceTracer& tracer : tracers) {
            onDevice.bits.fill(0xaa);
            onDevice.blocked.fill(0xaa);
            tracer.trace(onDevice);
            const std::vector<uint8_t> answers = tracer.answers(onDevice);
            const bool isOurs = &tracer == &tracers.front();
            std::vector<uint8_t> ofCpu = expected;
            if (!isOurs)
                nanoVdb->trace(Backend::kCpu, viewOf(rays), viewOf(ofCpu));
            const uint64_t differences = countDifferences(answers, ofCpu);
            if (!isOurs)
                nanoVdbDifferences = std::max(nanoVdbDifferences, differences);
            if (double(differences) > (isOurs ? 0.0 : kNanoVdbTolerance * double(rayCount)))
                throw Error(ErrorKind::kInput, "bench voxel: " + tracer.name +
                                                   " on the device and "
                                                   "on the CPU differ in " +
                                                   std::to_string(differences) + " of " +
                                                   std::to_string(rayCount) +
                                                   " rays; nothing was measured");
            checkInterrupted();
        }
        std::vector<std::vector<double>> perSecond(tracers.size());
        for (int r = 0; r < options.repeats; ++r)
            for (size_t t = 0; t < tracers.size(); ++t) {
                synchronize(backend);
                const auto start = std::chrono::steady_clock::now();
                tracers[t].trace(onDevice);
                synchronize(backend);
                const double s =
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
                perSecond[t].push_back(double(rayCount) / s * 1e-6);
                checkInterrupted();
            }
        const double ours = Spread::of(perSecond[0]).median.value;
        for (size_t t = 0; t < tracers.size(); ++t) {
            const Spread spread = Spread::of(perSecond[t]);
            Json rate = {{"tracer", tracers[t].name}, {"order", rayOrderName(order)}};
            rate.update(spread.toJson("megarays_per_s"));
            rate["ours_over_it"] = ours / spread.median.value;
            rates.push_back(std::move(rate));
        }
    }
    Json result = {{"bench", "voxel"},
                   {"backend", backend == Backend::kCuda ? "cuda" : "cpu"},
                   {"resolution", dag.grid.resolution()},
                   {"width", options.width},
                   {"height", options.height},
                   {"light_count", world.lights().size()},
                   {"ray_count", rayCount},
                   {"repeat_count", options.repeats},
                   {"traced_bytes", words.bytes()},
                   {"rates", std::move(rates)}};
    if (nanoVdb) {
        result["nanovdb_bytes"] = nanoVdb->bytes();
        result["nanovdb_difference_count"] = nanoVdbDifferences;
    }
    return result;
}

void printDeviceBench(std::ostream& out, const Json& result) {
    char line[200];
    const auto number = [](const Json& json, const std::string& key) {
        return json[key].get<double>();
    };
    std::snprintf(line, sizeof line,
                  "%.0f^3, DAG %s: %.0f rays, %.0f lights; the bits of the CPU\n",
                  number(result, "resolution"), bytesText(number(result, "traced_bytes")).c_str(),
                  number(result, "ray_count"), number(result, "light_count"));
    out << line;
    std::snprintf(line, sizeof line, "%-8s %-20s %9s %9s   %9s %9s\n", "order", "tracer",
                  "M rays/s", "(min", "max)", "ours / it");
    out << line;
    for (const Json& rate : result["rates"]) {
        std::snprintf(line, sizeof line, "%-8s %-20s %9.1f (%8.1f .. %8.1f) %9.2f\n",
                      rate["order"].get<std::string>().c_str(),
                      rate["tracer"].get<std::string>().c_str(), number(rate, "megarays_per_s"),
                      number(rate, "megarays_per_s_min"), number(rate, "megarays_per_s_max"),
                      number(rate, "ours_over_it"));
        out << line;
    }
}

} // namespace shadowdag
