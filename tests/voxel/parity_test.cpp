// SPDX-License-Identifier: Apache-2.0
// Parity of the voxel passes: rays through DAGs of random grids and of every built-in scene.
#include "tests/cuda/backends.h"
#include "tests/cuda/parity.h"

#include "scenes/builtin.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/dag_trace_pass.h"
#include "voxel/voxelize.h"

namespace shadowdag {
namespace {

class VoxelParityOn : public OnBackend {};

/// Segments between points in and around a grid, some along axes and diagonals, some of no length,
/// some not finite.
std::vector<DagSegment> segmentsAround(const VoxelGrid& grid, size_t count, std::mt19937& random) {
    std::uniform_real_distribution<float> unit(-0.1f, 1.1f);
    const float side = float(grid.resolution());
    const auto point = [&] {
        glm::vec3 p;
        for (int a = 0; a < 3; ++a) {
            p[a] = unit(random) * side;
            if (random() % 4 == 0)
                p[a] = std::round(p[a]); // on a voxel's face
        }
        return p;
    };
    std::vector<DagSegment> segments;
    for (size_t i = 0; i < count; ++i) {
        DagSegment s{point(), point()};
        if (random() % 8 == 0)
            s.to = s.from;
        for (int a = 0; a < 3; ++a)
            if (random() % 6 == 0)
                s.to[a] = s.from[a];
        if (i % 997 == 0)
            s.to.x = i % 2 ? INFINITY : NAN;
        segments.push_back(s);
    }
    return segments;
}

Snapshot pairResultsOf(Backend backend, const Dag& dag, const std::vector<DagSegment>& segments) {
    Snapshot snapshot;
    Buffer<uint32_t> words(backend, "test/dag words"), bits(backend, "test/answers");
    Buffer<DagSegment> asked(backend, "test/segments");
    words.upload(dag.words);
    asked.upload(segments);
    bits.resize((segments.size() + 31) / 32);
    for (uint32_t level = 0; level <= std::min(4u, dag.grid.resolutionLog2); ++level) {
        const DagView view{std::as_const(words).view(), dag.rootAddress, dag.grid};
        traceSegments(backend, view, std::as_const(asked).view(), level, bits.view());
        snapshot.add("level " + std::to_string(level), bits);
    }
    return snapshot;
}

/// The same by occluded(), segment by segment.
Snapshot definitionOf(const Dag& dag, const std::vector<DagSegment>& segments) {
    Snapshot snapshot;
    for (uint32_t level = 0; level <= std::min(4u, dag.grid.resolutionLog2); ++level) {
        std::vector<uint32_t> bits((segments.size() + 31) / 32, 0);
        for (size_t i = 0; i < segments.size(); ++i)
            bits[i / 32] |= uint32_t(occluded(dag.view(), segments[i], level)) << i % 32;
        snapshot.add("level " + std::to_string(level), bits);
    }
    return snapshot;
}

TEST_P(VoxelParityOn, OfRaysThroughRandomGridsIsBitForBit) {
    constexpr unsigned kSeed = 71;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 random(kSeed);
    for (uint32_t log2 = 0; log2 <= 6; ++log2)
        for (const double density : {0.0, 0.002, 0.05, 0.6}) {
            const Dag dag = dagOf(randomGrid(log2, density, random));
            const std::vector<DagSegment> segments = segmentsAround(dag.grid, 3001, random);
            EXPECT_EQ(firstDifference(definitionOf(dag, segments),
                                      pairResultsOf(GetParam(), dag, segments)),
                      "")
                << log2 << " " << density;
        }
}

TEST_P(VoxelParityOn, OfRaysThroughEveryBuiltinSceneIsBitForBit) {
    constexpr unsigned kSeed = 72;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 random(kSeed);
    for (const BuiltinInfo& info : builtinScenes()) {
        const Scene scene = makeBuiltin(info.name);
        const World world(scene, {});
        const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                                 gridAround(world.boundsWorld(), 8));
        const std::vector<DagSegment> segments = segmentsAround(dag.grid, 10'007, random);
        EXPECT_EQ(
            firstDifference(definitionOf(dag, segments), pairResultsOf(GetParam(), dag, segments)),
            "")
            << info.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Both, VoxelParityOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
