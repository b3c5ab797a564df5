// SPDX-License-Identifier: Apache-2.0
// Google Benchmark over voxelizing and shadow rays at small sizes, for watching our own changes.
// The comparison with Embree and NanoVDB is `shadowdag bench voxel`, which this runs once first:
// nothing is timed before it has verified the results.
#include "scenes/builtin.h"
#include "tools/bench/bench_voxel.h"
#include "voxel/dag_stream.h"
#include "voxel/dag_trace.h"
#include "voxel/voxelize.h"

#include <benchmark/benchmark.h>

#include <nlohmann/json.hpp>

#include <iostream>

using namespace shadowdag;

namespace {

struct Setup {
    Scene scene = loadScene("builtin:atrium");
    World world{scene, {}};
    Camera camera = world.cameras().empty() ? placeCamera(world) : world.cameras()[0];
};

Setup& setup() {
    static Setup s;
    return s;
}

Dag dagAt(int64_t resolutionLog2) {
    const World& world = setup().world;
    return voxelize(world.triangles(), viewOf(world.staticTriangles()),
                    gridAround(world.staticBoundsWorld(), uint32_t(resolutionLog2)));
}

void voxelizeAtrium(benchmark::State& state) {
    for (auto _ : state)
        benchmark::DoNotOptimize(dagAt(state.range(0)).words.data());
}
BENCHMARK(voxelizeAtrium)
    ->DenseRange(8, 10)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

/// Rays a second of occluded() on one thread; arguments: log2 of the resolution, RayOrder.
void traceAtrium(benchmark::State& state) {
    const Dag dag = dagAt(state.range(0));
    const BenchView view = makeBenchView(setup().world, setup().camera, 160, 90);
    const BenchRays rays = makeBenchRays(view, setup().world, dag.grid, kRayOrders[state.range(1)]);
    for (auto _ : state) {
        size_t dark = 0;
        for (const DagSegment& segment : rays.voxel)
            dark += occluded(dag.view(), segment);
        benchmark::DoNotOptimize(dark);
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(rays.voxel.size()));
    state.SetLabel(rayOrderName(kRayOrders[state.range(1)]));
}
BENCHMARK(traceAtrium)->ArgsProduct({{8, 10}, {0, 1}})->Unit(benchmark::kMillisecond);

/// The same of traceStream() over the wide form, in the widest instructions that are there.
void streamAtrium(benchmark::State& state) {
    const Dag dag = dagAt(state.range(0));
    const WideDag wide = buildWideDag(dag);
    DagView traced = dag.view();
    traced.wide = wide.view();
    const BenchView view = makeBenchView(setup().world, setup().camera, 160, 90);
    const BenchRays rays = makeBenchRays(view, setup().world, dag.grid, kRayOrders[state.range(1)]);
    std::vector<uint8_t> blocked(rays.voxel.size());
    for (auto _ : state) {
        traceStream(traced, viewOf(rays.voxel), viewOf(blocked));
        benchmark::DoNotOptimize(blocked.data());
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(rays.voxel.size()));
    state.SetLabel(rayOrderName(kRayOrders[state.range(1)]));
}
BENCHMARK(streamAtrium)->ArgsProduct({{8, 10}, {0, 1}})->Unit(benchmark::kMillisecond);

} // namespace

int main(int argc, char** argv) try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv))
        return 1;
    VoxelBenchOptions options;
    options.width = 64;
    options.height = 36;
    options.resolutionLog2 = 8;
    options.repeats = 1;
    runVoxelBench(setup().world, setup().camera, options, Console(false));
    benchmark::RunSpecifiedBenchmarks();
    return 0;
} catch (const Error& error) {
    std::cerr << error.what() << "\n";
    return int(error.kind());
}
