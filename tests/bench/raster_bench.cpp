// SPDX-License-Identifier: Apache-2.0
// Google Benchmark over the building of virtual cube shadow maps at small sizes, for watching our
// own changes. The stages and the comparison with Embree are `shadowdag bench raster`, which this
// runs once first: nothing is timed before it has verified the depths.
#include "scenes/batches.h"
#include "scenes/builtin.h"
#include "tools/bench/bench_raster.h"

#include <benchmark/benchmark.h>

#include <nlohmann/json.hpp>

#include <iostream>

using namespace shadowdag;

namespace {

struct Setup {
    Scene scene = loadScene("builtin:atrium");
    World world{scene, {}};
    Camera camera = world.cameras().empty() ? placeCamera(world) : world.cameras()[0];
    BatchSet batches{world};
};

Setup& setup() {
    static Setup s;
    return s;
}

/// Texels a second of ShadowMaps::build; arguments: largest face resolution, page side.
void buildMaps(benchmark::State& state) {
    const Setup& s = setup();
    RasterBenchOptions options;
    options.width = 160;
    options.height = 90;
    options.faceTexels = uint32_t(state.range(0));
    const RasterBenchInputs inputs = makeRasterBenchInputs(s.world, s.camera, options);
    ShadowMapOptions mapOptions;
    mapOptions.pageTexels = uint32_t(state.range(1));
    mapOptions.poolBytes = 2ull << 30;
    mapOptions.useStaticOptimization = false;
    ShadowMaps maps(Backend::kCpu);
    for (auto _ : state) {
        StageTimes stages;
        maps.build(inputs.requests, inputs.boxes, inputs.receivers, s.world.triangles(),
                   s.batches.view(), mapOptions, stages);
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(maps.counts().texelCount));
}
BENCHMARK(buildMaps)
    ->ArgsProduct({{128, 512}, {32, 64, 128}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

} // namespace

int main(int argc, char** argv) try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv))
        return 1;
    RasterBenchOptions options;
    options.width = 64;
    options.height = 36;
    options.faceTexels = 128;
    options.repeats = 1;
    runRasterBench(setup().world, setup().camera, options, Console(false));
    benchmark::RunSpecifiedBenchmarks();
    return 0;
} catch (const Error& error) {
    std::cerr << error.what() << "\n";
    return int(error.kind());
}
