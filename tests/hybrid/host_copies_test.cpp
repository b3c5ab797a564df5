// SPDX-License-Identifier: Apache-2.0
// How often a frame goes between host and backend: counted on the CPU, where it costs nothing, and
// the same on CUDA, where each is a round trip. Whoever adds one finds the list here.
#include "hybrid/frame.h"

#include "tests/cuda/backends.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

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
        FrameResult frame;
        for (int i = 0; i < 3; ++i)
            frame = renderer.render(roomCamera(), *makeCostModel(model), options);
        return frame.counts.hostCopies;
    }
};

// Gathering: up, the slices of the grid. Back, how many clusters, samples, and (cluster, light)
// pairs there are, and what every map is asked for, of which the host makes routes.
constexpr uint64_t kGatherUploads = 1, kGatherReadbacks = 3, kDemandReadbacks = 1;
// Routing: up, which map serves a record.
constexpr uint64_t kRouteUploads = 1;
// Maps: back, how many receivers, pages, missing pages, batches that maps reach, and draws there
// are, and what pages are kept. Nothing up: lights and their maps stand still.
constexpr uint64_t kMapReadbacks = 6;

TEST_P(HostCopiesOn, OfAFrameOfRaysAreThoseOfGatheringAndRouting) {
    const HostCopyCounts copies = thirdFrame("texels:inf");
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kGatherReadbacks + kDemandReadbacks);
}

TEST_P(HostCopiesOn, OfAFrameOfMapsThatStandStillAreSixMore) {
    const HostCopyCounts copies = thirdFrame("texels:0");
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kGatherReadbacks + kDemandReadbacks + kMapReadbacks);
}

// Without static optimization nothing is kept to be sorted out.
TEST_P(HostCopiesOn, OfAFrameOfMapsDrawnAnewAreFourMore) {
    FrameOptions options = smallFrame();
    options.maps.useStaticOptimization = false;
    const HostCopyCounts copies = thirdFrame("texels:0", options);
    EXPECT_EQ(copies.uploadCount, kGatherUploads + kRouteUploads);
    EXPECT_EQ(copies.readbackCount, kGatherReadbacks + kDemandReadbacks + kMapReadbacks - 2);
}

// A model that asks for pages needs maps laid out (up), receivers counted and pages counted (back);
// one that asks for pairs, their counts.
TEST_P(HostCopiesOn, OfCountedQuantitiesAreTheirs) {
    const HostCopyCounts without = thirdFrame("expr:samples < 9000");
    const HostCopyCounts pages = thirdFrame("expr:samples < 9000 + 0 * pages");
    EXPECT_EQ(pages.uploadCount, without.uploadCount + 1);
    EXPECT_EQ(pages.readbackCount, without.readbackCount + 2);
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

INSTANTIATE_TEST_SUITE_P(Both, HostCopiesOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag::test
