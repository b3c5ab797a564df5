// SPDX-License-Identifier: Apache-2.0
// The number of copies of a frame between host and backend when lengths are guessed, as on CUDA,
// where each is a round trip; counted on the CPU, where it costs nothing. A new copy must be added
// to the list here.
#include "hybrid/frame.h"

#include "tests/cuda/backends.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::test {
namespace {

class HostCopiesOn : public OnBackend {
protected:
    /// Returns the copies of the third of three equal frames: what is kept is kept, nothing moves.
    HostCopyCounts thirdFrame(const char* model, const FrameOptions& options = smallFrame()) {
        const Scene scene = blockerScene(kManyLights, true);
        const World world(scene, {});
        const Dag dag = dagOf(world, 8);
        FrameRenderer renderer(GetParam(), world, dag);
        renderer.guessLengths(true);
        FrameResult frame;
        for (int i = 0; i < 3; ++i)
            frame = renderer.render(roomCamera(), *makeCostModel(model), options);
        return frame.counts.hostCopies;
    }
};

// Gathering: up, the slices of the grid. Back, what every map is asked for, of which the host makes
// routes, and with it how long the lists are.
constexpr uint64_t kGatherUploads = 1, kDemandReadbacks = 1;
// Routing: up, which map serves a record.
constexpr uint64_t kRouteUploads = 1;
// Maps: back, how many pages there are, which the pool must hold; and, while the device draws, how
// many draws there are. Nothing up: lights and their maps stand still.
constexpr uint64_t kMapReadbacks = 2;
// Back, what pages are kept; on CUDA reports alone read that.
uint64_t keptReadbacks(Backend backend) {
    return backend == Backend::kCuda ? 0 : 1;
}

TEST_P(HostCopiesOn, OfAFrameOfRaysAreThoseOfGatheringAndRouting) {
    const HostCopyCounts copies = thirdFrame("texels:inf");
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kDemandReadbacks);
}

TEST_P(HostCopiesOn, OfAFrameOfStaticMapsAreTwoMoreAndOneForWhatIsKept) {
    const HostCopyCounts copies = thirdFrame("texels:0");
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kDemandReadbacks + kMapReadbacks + keptReadbacks(GetParam()));
}

// Without static optimization nothing is kept to be sorted out.
TEST_P(HostCopiesOn, OfAFrameOfMapsDrawnAnewAreTwoMore) {
    FrameOptions options = smallFrame();
    options.maps.useStaticOptimization = false;
    const HostCopyCounts copies = thirdFrame("texels:0", options);
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kDemandReadbacks + kMapReadbacks);
}

// A model that reads pages needs maps laid out (up) and pages counted (back);
// one that reads pairs, their counts.
TEST_P(HostCopiesOn, OfCountedQuantitiesAreTheirs) {
    const HostCopyCounts without = thirdFrame("expr:samples < 9000");
    const HostCopyCounts pages = thirdFrame("expr:samples < 9000 + 0 * pages");
    EXPECT_EQ(pages.uploadCount, without.uploadCount + 1);
    EXPECT_EQ(pages.readbackCount, without.readbackCount + 1);
    const HostCopyCounts pairs = thirdFrame("expr:samples < 9000 + 0 * pairs");
    EXPECT_EQ(pairs.uploadCount, without.uploadCount);
    EXPECT_EQ(pairs.readbackCount, without.readbackCount + 1);
}

TEST_P(HostCopiesOn, DoNotDependOnWhatReportsFetch) {
    FrameOptions options = smallFrame();
    const HostCopyCounts with = thirdFrame("texels:0", options);
    options.recordPairs = false;
    const HostCopyCounts without = thirdFrame("texels:0", options);
    EXPECT_EQ(with.uploadCount, without.uploadCount);
    EXPECT_EQ(with.readbackCount, without.readbackCount);
}

// Without guesses the length of a list is read before it is filled.
TEST_P(HostCopiesOn, AreFiveMoreForFourListsWithReadLengths) {
    const Scene scene = blockerScene(kManyLights, true);
    const World world(scene, {});
    const Dag dag = dagOf(world, 8);
    uint64_t readbackCount[2];
    FrameOptions options = smallFrame();
    options.maps.useStaticOptimization = false; // kept maps may reach nothing: a length less
    for (const bool isGuessing : {false, true}) {
        FrameRenderer renderer(GetParam(), world, dag);
        renderer.guessLengths(isGuessing);
        for (int i = 0; i < 3; ++i)
            readbackCount[isGuessing] =
                renderer.render(roomCamera(), *makeCostModel("texels:0"), options)
                    .counts.hostCopies.readbackCount;
    }
    // Clusters, their samples, their lights, receivers; reached batches and draws by one more than
    // together.
    EXPECT_EQ(readbackCount[false], readbackCount[true] + 5);
}

class FrameMemoryOn : public OnBackend {
protected:
    /// Returns how often the program has taken memory for buffers.
    static uint64_t allocations() {
        uint64_t count = 0;
        for (const LedgerEntry& entry : bufferLedger())
            count += entry.allocationCount;
        return count;
    }
};

// Memory is taken while lists grow, and never again for frames that need no more.
TEST_P(FrameMemoryOn, DoesNotGrowForFramesOfTheSameSize) {
    const Scene scene = blockerScene(kManyLights, true);
    const World world(scene, {});
    const Dag dag = dagOf(world, 8);
    for (const char* model : {"texels:inf", "texels:0", "texels:48", "expr:pairs + pages < 900"})
        for (const bool isGuessing : {false, true}) {
            FrameRenderer renderer(GetParam(), world, dag);
            renderer.guessLengths(isGuessing);
            const uint64_t before = allocations();
            uint64_t counts[6];
            for (uint64_t& count : counts) {
                renderer.render(roomCamera(), *makeCostModel(model), smallFrame());
                count = allocations();
            }
            EXPECT_GT(counts[0], before + 20) << model;
            EXPECT_EQ(counts[3], counts[2]) << model << ", guessing " << isGuessing;
            EXPECT_EQ(counts[5], counts[3]) << model << ", guessing " << isGuessing;
        }
}

// A frame without maps forgets those that were kept; the next ones are drawn into the same memory,
// and where they need more, it grows in steps.
TEST_P(FrameMemoryOn, StaysOverFramesThatDrawNoMaps) {
    const Scene scene = blockerScene(kManyLights, true);
    const World world(scene, {});
    const Dag dag = dagOf(world, 8);
    FrameRenderer renderer(GetParam(), world, dag);
    const auto pool = [] {
        for (const LedgerEntry& entry : bufferLedger())
            if (entry.name == "shadowmap page pool" && entry.backend == GetParam())
                return entry.allocationCount;
        return uint64_t(0);
    };
    Camera camera = roomCamera();
    uint64_t counts[8], most = 0;
    for (size_t i = 0; i < std::size(counts); ++i) {
        const bool draws = i % 2 == 0;
        const FrameResult result = renderer.render(
            camera, *makeCostModel(draws ? "texels:0" : "texels:inf"), smallFrame());
        EXPECT_EQ(result.counts.maps.pageCount > 0, draws);
        most = std::max(most, result.counts.maps.pageCount);
        counts[i] = allocations();
    }
    EXPECT_EQ(counts[7], counts[3]);
    // A closer look needs more pages than all before, time and again; each step adds a half.
    const uint64_t first = most, before = pool();
    int recordCount = 0;
    for (int i = 0; i < 60; ++i) {
        camera.yfov *= 0.996f;
        const uint64_t pages =
            renderer.render(camera, *makeCostModel("texels:0"), smallFrame()).counts.maps.pageCount;
        recordCount += pages > most;
        most = std::max(most, pages);
        renderer.render(camera, *makeCostModel("texels:inf"), smallFrame());
    }
    const double steps = std::ceil(std::log(double(most) / double(first)) / std::log(1.5));
    EXPECT_GT(recordCount, steps + 2);
    EXPECT_LE(double(pool() - before), steps);
}

INSTANTIATE_TEST_SUITE_P(Both, FrameMemoryOn, kBothBackends, backendSuffix);
INSTANTIATE_TEST_SUITE_P(Both, HostCopiesOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag::test
