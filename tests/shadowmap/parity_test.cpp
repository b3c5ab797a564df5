// SPDX-License-Identifier: Apache-2.0
// Parity of the shadow maps' passes: the output of each for the same inputs, by every culling; and
// maps that are kept over an animation, build by build.
#include "tests/cuda/backends.h"
#include "tests/cuda/parity.h"

#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "shadowmap/cull.h"
#include "shadowmap/page_mask.h"
#include "shadowmap/rasterize_pass.h"
#include "tests/shadowmap/kept_maps.h"

#include <utility>

namespace shadowdag {
namespace {

using test::Animation;
using test::keeping;

class ShadowMapParityOn : public OnBackend {
protected:
    void TearDown() override { setThreadCount(0); }

    /// Returns where what `run`(backend, isOneText) left on the CPU and on the backend under test
    /// differ; of the CPU itself: by the one text, on one thread.
    template <class Run> std::string differenceOf(const Run& run) {
        const Snapshot expected = run(Backend::kCpu, false);
        const bool isOneText = GetParam() == Backend::kCpu;
        setThreadCount(isOneText ? 1 : 0);
        return firstDifference(expected, run(GetParam(), isOneText));
    }
};

/// A copy of a host array on a backend.
template <class T> Buffer<T> place(Backend backend, View<const T> host) {
    Buffer<T> buffer(backend, "test/parity input");
    buffer.upload(std::vector<T>(host.begin(), host.end()));
    return buffer;
}

Buffer<uint32_t> zeros(Backend backend, size_t count) {
    Buffer<uint32_t> words(backend, "test/parity words", count);
    words.fill(0);
    return words;
}

/// Runs mask, culling and drawing passes one by one; every page has memory, in order.
/// @param isShared shares out work as a device does: triangles by pages, culling by entries
Snapshot passesOf(Backend backend, const Animation& a, MapCulling culling, bool isShared) {
    constexpr uint32_t kPageTexelsLog2 = 4;
    Snapshot snapshot;
    const MapLayout layout = layOutMaps(a.requests, 1u << kPageTexelsLog2);
    const size_t count = layout.maps.size();
    const Buffer<ShadowMapInfo> maps = place(backend, viewOf(layout.maps));
    const Buffer<Box> boxes = place(backend, viewOf(a.boxes));
    const Buffer<MapReceiver> receivers = place(backend, viewOf(a.receivers));
    Buffer<uint32_t> pages = zeros(backend, layout.maskWordCount),
                     projection = zeros(backend, count * kProjectionWordsPerMap),
                     faces = zeros(backend, count), depths = zeros(backend, count * kFaceCount),
                     cells = zeros(backend, count * kCellsPerMap),
                     blocks = zeros(backend, count * kBlocksPerMap);
    const CullMaskView masks{projection.view(), faces.view(), depths.view(), cells.view(),
                             blocks.view()};
    constexpr uint32_t kTaps = 4;
    runPass(backend, MarkReceiver{{maps.view(), boxes.view(), receivers.view(), kTaps}, masks});
    BoxPageMarker(backend, boxes.view(), receivers.view())
        .mark({maps.view(), uint32_t(count), 1, pages.view(), kPageTexelsLog2, kTaps});
    snapshot.add("pages", pages);
    snapshot.add("projection", projection);
    snapshot.add("faces", faces);
    snapshot.add("depth limits", depths);
    snapshot.add("cells", cells);
    Buffer<uint32_t> first = zeros(backend, layout.maskWordCount);
    runPass(backend, CountPages{std::as_const(pages).view(), first.view()});
    const uint64_t pageCount = exclusiveScan(backend, std::as_const(first).view(), first.view());
    snapshot.add("first page", first);
    snapshot.add("page count", pageCount);
    runPass(backend, GatherBlock{cells.view(), blocks.view()});
    snapshot.add("blocks", blocks);

    const BatchView host = a.batches->view();
    const Buffer<Batch> batches = place(backend, host.batches);
    const Buffer<Box> batchBoxes = place(backend, host.boxesWorld),
                      bvhBoxes = place(backend, host.bvh.boxes);
    const Buffer<uint32_t> batchTriangles = place(backend, host.triangles),
                           bvhItems = place(backend, host.bvh.items);
    BatchView onBackend = host;
    onBackend.batches = batches.view();
    onBackend.boxesWorld = batchBoxes.view();
    onBackend.triangles = batchTriangles.view();
    onBackend.bvh.boxes = bvhBoxes.view();
    onBackend.bvh.items = bvhItems.view();
    onBackend.vertices = {}; // are the host's
    CullView cull{maps.view(), masks, onBackend, culling, {}};
    cull.cells = {std::as_const(cells).view(), std::as_const(blocks).view()};
    const size_t items = count * cull.parts();
    // One element more than there are items: scans then end with the total.
    Buffer<uint32_t> firstReached = zeros(backend, items + 1);
    Buffer<CullCounts> counts(backend, "test/cull counts", items);
    runPass(backend, CountReached{cull, {firstReached.view().data, items}, counts.view()});
    const uint64_t reachedCount =
        exclusiveScan(backend, std::as_const(firstReached).view(), firstReached.view());
    Buffer<BatchDraw> reached(backend, "test/reached", reachedCount);
    runPass(backend, ListReached{cull, std::as_const(firstReached).view(), reached.view()});
    snapshot.add("reached", reached);
    Buffer<uint32_t> drawOf = zeros(backend, reachedCount + 1);
    const CountDraws countAll{cull, std::as_const(firstReached).view(), reached.view(),
                              drawOf.view(), counts.view()};
    if (isShared && backend == Backend::kCpu) // as a device does, in an order of its own
        for (size_t i = reachedCount * kFaceCount; i-- > 0;) {
            const size_t at = i / kFaceCount, item = countAll.itemOf(at);
            const BatchDraw draw = reached.view()[at];
            countAll.note(item, at,
                          cull.faceToDraw(draw.map, draw.batch, uint32_t(i % kFaceCount)));
        }
    else
        runPass(backend, countAll);
    snapshot.add("cull counts", counts);
    Buffer<BatchDraw> draws(backend, "test/draws",
                            exclusiveScan(backend, std::as_const(drawOf).view(), drawOf.view()));
    runPass(backend,
            ListDraws{std::as_const(reached).view(), std::as_const(drawOf).view(), draws.view()});
    snapshot.add("draws", draws);

    std::vector<uint32_t> table(layout.maskWordCount * 32, kNoPage);
    const std::vector<uint32_t> marked = pages.download();
    uint32_t next = 0;
    for (size_t i = 0; i < table.size(); ++i)
        if (marked[i / 32] >> i % 32 & 1u)
            table[i] = next++;
    const Buffer<uint32_t> pageTable = place(backend, View<const uint32_t>(viewOf(table)));
    Buffer<uint32_t> pool = zeros(backend, pageCount << (2 * kPageTexelsLog2));
    const Buffer<glm::vec3> positions = place(backend, a.scene.view().positions);
    const Buffer<glm::uvec3> triangles = place(backend, a.scene.view().triangles);
    SplitWork large(backend, "test/large triangles", isShared ? size_t(1) << 16 : 0);
    Buffer<FaceTriangle> setups(backend, "test/setups");
    rasterizeTriangles(backend,
                       {maps.view(),
                        pageTable.view(),
                        pool.view(),
                        kPageTexelsLog2,
                        {positions.view(), triangles.view(), {}},
                        onBackend.batches,
                        onBackend.triangles,
                        std::as_const(draws).view(),
                        onBackend.maxTriangleCount},
                       large, setups);
    snapshot.add("texels", pool);
    return snapshot;
}

TEST_P(ShadowMapParityOn, OfEveryPassByEveryCullingIsBitForBit) {
    for (const MapCulling culling :
         {MapCulling::kSphere, MapCulling::kFaceMask, MapCulling::kProjectionMap,
          MapCulling::kMaximumDepth, MapCulling::kCellDepth})
        for (uint32_t seed = 1; seed <= 3; ++seed) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << " culling " << int(culling)
                                            << " of " << int(MapCulling::kCellDepth));
            Animation animation(seed);
            for (int step = 0; step < 5; ++step)
                animation.step();
            ASSERT_FALSE(animation.receivers.empty());
            bool isShared = false; // in the first run every triangle is drawn whole
            EXPECT_EQ(differenceOf([&](Backend backend, bool) {
                          return passesOf(backend, animation, culling,
                                          std::exchange(isShared, true));
                      }),
                      "");
        }
}

/// Builds the maps of every step; `poolPages` of them fit.
Snapshot keptMapsOf(Backend backend, uint32_t seed, bool isOneText, uint64_t poolPages) {
    Animation animation(seed);
    ShadowMaps maps(backend);
    ShadowMapOptions options = keeping(MapCulling::kCellDepth);
    options.poolBytes = poolPages * options.pageTexels * options.pageTexels * sizeof(uint32_t);
    options.useAtomicRasterizer = isOneText;
    Snapshot snapshot;
    StageTimes stages;
    for (int step = 0; step < 40; ++step) {
        snapshot.under("step " + std::to_string(step) + ": ");
        animation.step();
        maps.build(animation.requests, animation.boxes, animation.receivers, animation.scene.view(),
                   animation.batches->view(), options, stages, viewOf(animation.moved));
        animation.moved.clear();
        maps.countSkipped();
        const ShadowMapCounts& counts = maps.counts();
        snapshot.add("counts",
                     std::vector<uint64_t>{
                         counts.pageCount, counts.pagesWantedCount, counts.pagesRefusedCount,
                         counts.batchFaceCount, counts.triangleDrawCount,
                         counts.pagesCommittedCount, counts.pagesFreedCount,
                         counts.pagesRetainedCount, counts.pagesClearedCount, counts.keptMapCount,
                         counts.batchFaceKeptCount, counts.triangleKeptCount, counts.mapBytes});
        snapshot.add("divisor", std::vector<float>{counts.degradeDivisor});
        snapshot.add("pages per map", maps.pagesPerMap());
        snapshot.add("triangles per map", maps.trianglesPerMap());
        const ShadowMapView view = maps.view();
        std::vector<uint32_t> table(view.pageTable.count), pool(view.depths.count), texels;
        detail::copyBytes(Backend::kCpu, table.data(), backend, view.pageTable.data,
                          table.size() * sizeof(uint32_t));
        detail::copyBytes(Backend::kCpu, pool.data(), backend, view.depths.data,
                          pool.size() * sizeof(uint32_t));
        snapshot.add("page table", table);
        const size_t pageTexels = size_t(options.pageTexels) * options.pageTexels;
        for (const uint32_t page : table)
            if (page != kNoPage)
                texels.insert(texels.end(), pool.begin() + long(page * pageTexels),
                              pool.begin() + long((page + 1) * pageTexels));
        snapshot.add("texels", texels);
    }
    return snapshot;
}

TEST_P(ShadowMapParityOn, OfKeptMapsOverAnAnimationIsBitForBit) {
    for (uint32_t seed = 11; seed <= 14; ++seed) {
        const uint64_t poolPages = seed % 2 ? 16384 : 300; // roomy, and now and then too small
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", pool of " << poolPages);
        EXPECT_EQ(differenceOf([&](Backend backend, bool isOneText) {
                      return keptMapsOf(backend, seed, isOneText, poolPages);
                  }),
                  "");
    }
}

INSTANTIATE_TEST_SUITE_P(Both, ShadowMapParityOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
