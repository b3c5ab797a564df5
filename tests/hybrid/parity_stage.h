// SPDX-License-Identifier: Apache-2.0
// Built-in scenes by the CPU and by another runner of the same passes, compared pass by pass and
// frame by frame.
#pragma once

#include "hybrid/frame/frame_state.h"
#include "hybrid/frame/shade_pass.h"
#include "scenes/builtin.h"
#include "tests/cuda/parity.h"
#include "tests/scenes/fewer_lights.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace shadowdag::test {

/// The runner that is compared with the CPU.
enum class Runner {
    kOneText, ///< the CPU by the one text alone, on one thread: no streams, no rasterizer by face
    kCuda,
};

struct ParityCase {
    std::string scene;
    Runner runner;

    Backend backend() const { return runner == Runner::kCuda ? Backend::kCuda : Backend::kCpu; }
};

inline void PrintTo(const ParityCase& c, std::ostream* out) {
    *out << c.scene << " by " << (c.runner == Runner::kCuda ? "cuda" : "the one text");
}

/// Returns every built-in scene by every runner.
inline std::vector<ParityCase> parityCases() {
    std::vector<ParityCase> cases;
    for (const BuiltinInfo& scene : builtinScenes())
        for (const Runner runner : {Runner::kOneText, Runner::kCuda})
            cases.push_back({scene.name, runner});
    return cases;
}

inline std::string caseName(const testing::TestParamInfo<ParityCase>& info) {
    std::string name = info.param.scene;
    for (char& c : name)
        c = c == '-' ? '_' : c;
    return name + (info.param.runner == Runner::kCuda ? "_cuda" : "_one_text");
}

/// Radiances: a runner adds a sample's lights in the same order by the same operations, so they
/// were always equal where both are CPUs. What a device's compiler does to sums that feed no
/// integer is not promised; a few last bits of a sum of tens of lights are below this.
constexpr double kColorTolerance = 1e-5;

/// Lights of which tests may leave out some.
constexpr uint32_t kManyLights = 32;

/// A scene at a small size, for both runners. Skips the test where the case's backend is absent.
class ParityStage : public testing::TestWithParam<ParityCase> {
protected:
    void SetUp() override {
        try {
            if (GetParam().runner == Runner::kCuda)
                chooseBackend("cuda");
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
        scene = makeBuiltin(GetParam().scene);
        if (lightCount(scene) > kManyLights)
            scene = withEveryNthLight(std::move(scene), lightStride());
        world = std::make_unique<World>(scene, WorldOptions{});
        dag = voxelize(world->triangles(), viewOf(world->staticTriangles()),
                       gridAround(world->boundsWorld(), 8));
    }
    void TearDown() override { setThreadCount(0); }

    /// Every how many-th light of a scene the test needs, where it has more than kManyLights.
    virtual uint32_t lightStride() const { return 1; }

    /// Returns what `run`(backend, isOneText) leaves: of the CPU, and of the case's runner.
    template <class Run> std::string differenceOf(const Run& run) {
        world->setTime(0);
        const Snapshot expected = run(Backend::kCpu, false);
        world->setTime(0);
        const bool isOneText = GetParam().runner == Runner::kOneText;
        setThreadCount(isOneText ? 1 : 0);
        return firstDifference(expected, run(GetParam().backend(), isOneText));
    }

    /// Returns the options of small frames; those of the one text leave out what the CPU does its
    /// own way.
    static FrameOptions options(bool isOneText) {
        FrameOptions options;
        options.width = 160;
        options.height = 90;
        options.maps.poolBytes = 64ull << 20;
        options.maps.useAtomicRasterizer = isOneText;
        options.rays.batch = isOneText ? RayBatch::kSingle : RayBatch::kStream;
        return options;
    }
    Camera camera() const { return world->cameras().at(0); }

    Scene scene;
    std::unique_ptr<World> world;
    Dag dag;
};

/// Adds the maps that lookups read: tables, and the texels of every page that has memory.
inline void addMaps(Snapshot& snapshot, const ShadowMapView& maps) {
    std::vector<uint32_t> infos, texels;
    for (const ShadowMapInfo& map : maps.maps)
        infos.insert(infos.end(), {map.faceTexels, map.facePages, map.pageTableStart});
    snapshot.add("map sizes", infos);
    snapshot.add("page table", std::vector<uint32_t>(maps.pageTable.begin(), maps.pageTable.end()));
    const size_t pageTexels = size_t(1) << (2 * maps.pageTexelsLog2);
    for (const uint32_t page : maps.pageTable)
        if (page != kNoPage)
            texels.insert(texels.end(), maps.depths.data + page * pageTexels,
                          maps.depths.data + (page + 1) * pageTexels);
    snapshot.add("depths", texels);
}

inline void addCounts(Snapshot& snapshot, const ShadowMapCounts& counts) {
    snapshot.add("map counts",
                 std::vector<uint64_t>{
                     counts.pageCount, counts.pagesWantedCount, counts.pagesRefusedCount,
                     counts.texelCount, counts.batchFaceCount, counts.batchFaceSphereCount,
                     counts.triangleDrawCount, counts.triangleSphereCount,
                     counts.pagesCommittedCount, counts.pagesFreedCount, counts.pagesRetainedCount,
                     counts.pagesClearedCount, counts.keptMapCount, counts.batchFaceKeptCount,
                     counts.triangleKeptCount, counts.mapBytes});
    snapshot.add("degrade divisor", std::vector<float>{counts.degradeDivisor});
}

/// Adds what was known of every map, and who served it.
inline void addRecords(Snapshot& snapshot, const std::vector<MapRecord>& records) {
    std::vector<uint64_t> counts;
    std::vector<float> texels;
    for (const MapRecord& record : records) {
        const MapQuantities& map = record.quantities;
        counts.insert(counts.end(), {map.light, map.octave, map.faceTexels, map.pages, map.samples,
                                     map.clusters, map.triangles, map.batches, map.lights,
                                     map.pairs, map.movers, uint64_t(map.previous),
                                     uint64_t(record.route), record.pairCount, record.heldTexels});
        texels.insert(texels.end(), {map.texels, map.range, map.moverCrossings});
    }
    snapshot.add("map quantities", counts);
    snapshot.add("map quantities in floats", texels);
}

} // namespace shadowdag::test
