// SPDX-License-Identifier: Apache-2.0
// The order of the passes that build the virtual cube shadow maps of a frame, and the memory
// between them.
#include "shadowmap/shadow_maps.h"

#include "cuda/fill_pass.h"
#include "cuda/list_length.h"
#include "cuda/pass.h"
#include "cuda/readback.h"
#include "cuda/resident.h"
#include "cuda/scan_sort.h"
#include "scenes/resident_geometry.h"
#include "shadowmap/cull.h"
#include "shadowmap/map_drawer.h"
#include "shadowmap/page_cache.h"
#include "shadowmap/page_mask.h"
#include "shadowmap/rasterize_pass.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

namespace shadowdag {
namespace {

template <class T> void zero(Buffer<T>& buffer, size_t count) {
    buffer.resize(count);
    buffer.fill(0);
}

uint32_t log2Exact(uint32_t value) {
    uint32_t log2 = 0;
    while (1u << log2 < value)
        ++log2;
    return log2;
}

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
    throw Error(ErrorKind::kUsage, "shadow maps: " + what + "; " + remedy);
}

void check(const std::vector<MapRequest>& requests, const ShadowMapOptions& options) {
    const uint32_t side = options.pageTexels;
    if (side < 16 || side > 256 || (side & (side - 1)))
        refuse("page side " + std::to_string(side), "choose 16, 32, 64, 128 or 256 texels");
    if (options.taps != 1 && options.taps != 4 && options.taps != 9)
        refuse("filter of " + std::to_string(options.taps) + " taps", "choose 1, 4 or 9");
    for (size_t i = 0; i < requests.size(); ++i) {
        const MapRequest& r = requests[i];
        const std::string name = "request " + std::to_string(i);
        if (r.faceTexels < 1 || r.faceTexels > kMaxFaceTexels)
            refuse(name + " has " + std::to_string(r.faceTexels) + " texels a face",
                   "choose 1 to " + std::to_string(kMaxFaceTexels));
        if (!(r.rangeWorld > 0.0f) || !std::isfinite(r.rangeWorld))
            refuse(name + " has range " + std::to_string(r.rangeWorld),
                   "give the light a finite range above 0");
        for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(r.lightPositionWorld[axis]))
                refuse(name + " has a light position that is not finite", "place the light");
    }
}

void check(const std::vector<MapRequest>& requests, const std::vector<Box>& boxes,
           const std::vector<MapReceiver>& receivers) {
    for (size_t i = 0; i < receivers.size(); ++i)
        if (receivers[i].map >= requests.size() || receivers[i].box >= boxes.size())
            refuse("receiver " + std::to_string(i) + " refers to map " +
                       std::to_string(receivers[i].map) + " of " + std::to_string(requests.size()) +
                       " and box " + std::to_string(receivers[i].box) + " of " +
                       std::to_string(boxes.size()),
                   "pass the requests and boxes that it was made for");
}

} // namespace

MapLayout layOutMaps(const std::vector<MapRequest>& requests, uint32_t pageTexels, double divisor) {
    MapLayout layout;
    for (const MapRequest& r : requests) {
        const uint32_t texels = glm::max(1u, uint32_t(double(r.faceTexels) / divisor));
        const uint32_t pages = (texels + pageTexels - 1) / pageTexels;
        layout.maps.push_back({r.lightPositionWorld, r.rangeWorld, texels, pages,
                               uint32_t(layout.maskWordCount * 32), r.window, r.cone, 0.0f,
                               r.light});
        layout.maskWordCount += (uint64_t(kFaceCount) * pages * pages + 31) / 32;
    }
    if (layout.maskWordCount * 32 > 0xffffffffull)
        throw Error(ErrorKind::kResource,
                    "shadow maps: page tables of " + std::to_string(layout.maskWordCount * 32) +
                        " entries exceed 32-bit indices; use larger pages, lower resolutions or "
                        "fewer maps");
    return layout;
}

struct ShadowMaps::State {
    State(Backend b, MapDrawer* d) : backend(b), drawer(d), cache(b, d) {}

    Backend backend;
    MapDrawer* drawer;
    ShadowMapOptions options;
    ShadowMapCounts counts;
    size_t batchCount = 0;
    std::vector<uint32_t> pagesPerMap, trianglesPerMap;
    std::vector<ShadowMapInfo> infos; // of the requests
    uint32_t cullParts = 0;           // items of a map
    bool isCounted = true;            // the last build's culling, and pages per map
    CullView lastCull{};              // of the last build, whose inputs it has
    bool skips = false;               // whether it left out closed faces
    bool isSkippedCounted = true;     // and their counts are there, or were given up

    // Inputs of the host.
    Resident<Box> receiverBoxes{backend, "shadowmap receiver boxes"};
    Resident<MapReceiver> receivers{backend, "shadowmap receivers"};
    ResidentGeometry geometry{backend, "shadowmap"};
    Resident<ShadowMapInfo> maps{backend, "shadowmap maps"}; // the requests', then those kept

    // Written by page masks: see PageDemand and CullMaskView.
    Buffer<uint32_t> pageBits{backend, "shadowmap page masks"};
    Buffer<uint32_t> projection{backend, "shadowmap projection maps"};
    Buffer<uint32_t> faces{backend, "shadowmap face masks"};
    Buffer<uint32_t> depthLimits{backend, "shadowmap depth limits"};
    Buffer<uint32_t> cells{backend, "shadowmap cell depths"};
    Buffer<uint32_t> blocks{backend, "shadowmap cell depth blocks"};

    // Steps of lowered resolutions, of which only the pages are counted, and how many the last
    // build took.
    int lastSteps = 0;
    Resident<ShadowMapInfo> stepMaps{backend, "shadowmap maps of steps"};
    Buffer<uint32_t> stepBits{backend, "shadowmap page masks of steps"};

    // Written by page masks: pages before each word, then their number, then those of every map of
    // the steps.
    Buffer<uint32_t> firstPage{backend, "shadowmap first page of word"};
    Readback pagesReadback{backend};      // from their number on
    int markedStep = 0, countedSteps = 0; // of the last mark

    // Written by page allocation; read by rasterization and lookups.
    PageCache cache;

    // Written by culling: the batches that maps reach, and those of them that rasterization draws.
    Buffer<uint32_t> firstReached{backend, "shadowmap first reached of item"};
    Buffer<BatchDraw> reached{backend, "shadowmap reached batches"};
    Buffer<uint32_t> drawOf{backend, "shadowmap draw of reached batch"};
    Buffer<CullCounts> cullCounts{backend, "shadowmap cull counts"};
    Buffer<BatchDraw> draws{backend, "shadowmap draws"};

    // The estimated lengths of culling's two lists.
    bool isGuessing = false;
    LengthGuess reachedGuess, drawGuess;
    Buffer<uint32_t> cullLengths{backend, "shadowmap list lengths"};
    std::unique_ptr<Readback> lengthsReadback;

    // Triangles that are too large for one thread; if the list is full, a triangle is drawn by its
    // own thread.
    SplitWork largeTriangles{backend, "shadowmap large triangles", size_t(1) << 19};
    Buffer<FaceTriangle> largeSetups{backend, "shadowmap setups of large triangles"};

    // What the CPU's rasterizer knows of the pages that it draws into.
    Buffer<PageFloor> pageFloors{backend, "shadowmap page floors"};

    uint32_t pageTexelsLog2() const { return log2Exact(options.pageTexels); }
    uint64_t pageTexelCount() const { return uint64_t(options.pageTexels) * options.pageTexels; }
    CullMaskView masks() {
        return {projection.view(), faces.view(), depthLimits.view(), cells.view(), blocks.view()};
    }

    /// Divisor `step` of resolutions: every second one is a power of two, exactly.
    static double divisorOf(int step) {
        return std::ldexp(step % 2 ? std::sqrt(2.0) : 1.0, step / 2);
    }

    void layOut(const std::vector<MapRequest>& requests, int step, uint64_t& words) {
        MapLayout layout = layOutMaps(requests, options.pageTexels, divisorOf(step));
        words = layout.maskWordCount;
        infos = std::move(layout.maps);
        for (ShadowMapInfo& map : infos)
            map.lodTexels = options.lodTexels;
    }

    /// Lays out the maps of the first `stepCount` divisors one after the other. Returns the words
    /// of their page tables; 0 if these together are too long.
    uint64_t layOutSteps(const std::vector<MapRequest>& requests, int stepCount) {
        std::vector<ShadowMapInfo> all;
        uint64_t words = 0;
        for (int step = 0; step < stepCount; ++step) {
            const MapLayout layout = layOutMaps(requests, options.pageTexels, divisorOf(step));
            if ((words + layout.maskWordCount) * 32 > 0xffffffffull)
                return 0;
            for (ShadowMapInfo map : layout.maps) {
                map.pageTableStart += uint32_t(words * 32);
                all.push_back(map);
            }
            words += layout.maskWordCount;
        }
        stepMaps.take(std::move(all));
        return words;
    }

    /// Queues to mark what all receivers need at a divisor, and to count the pages, and those at
    /// the first `stepCount` divisors, whose page tables have `stepWords` words. Without requests
    /// it queues nothing, and there is nothing to wait for.
    void queueMark(const std::vector<MapRequest>& requests, const MapInputs& inputs, int step,
                   int stepCount, uint64_t stepWords) {
        uint64_t words = 0;
        layOut(requests, step, words);
        markedStep = step;
        countedSteps = stepCount;
        maps.take(infos);
        const bool hasCells =
            options.culling >= MapCulling::kCellDepth || options.useStaticOptimization;
        const size_t countedMaps = requests.size() * size_t(stepCount);
        pageBits.resize(words);
        projection.resize(infos.size() * kProjectionWordsPerMap);
        faces.resize(infos.size());
        depthLimits.resize(infos.size() * kFaceCount);
        cells.resize(hasCells ? infos.size() * kCellsPerMap : 0);
        blocks.resize(hasCells ? infos.size() * kBlocksPerMap : 0);
        stepBits.resize(stepWords);
        firstPage.resize(requests.empty() ? 0 : words + 1 + countedMaps);
        if (requests.empty())
            return;
        fillAll(backend, {pageBits, projection, faces, depthLimits, cells, blocks, stepBits});
        CullMaskView marked = masks();
        if (options.culling < MapCulling::kCellDepth)
            marked.cells = {}; // written later, from the coarser levels
        runPass(backend,
                MarkReceiver{{maps.view(), inputs.receiverBoxes, inputs.receivers, options.taps},
                             marked});
        const auto markPages = [&](View<const ShadowMapInfo> of, int count, View<uint32_t> bits) {
            inputs.pages.mark({of, uint32_t(requests.size()), uint32_t(count), bits,
                               pageTexelsLog2(), options.taps});
        };
        markPages(maps.view(), 1, pageBits.view());
        if (stepCount > 0)
            markPages(stepMaps.view(), stepCount, stepBits.view());
        const View<uint32_t> first{firstPage.view().data, words + 1};
        runPass(backend, CountPages{std::as_const(pageBits).view(), first});
        prefixSums(backend, {first.data, first.count}, first);
        if (countedMaps > 0)
            runPass(backend, CountPagesOfMaps{{stepMaps.view().data, countedMaps},
                                              std::as_const(stepBits).view(),
                                              {first.data + first.count, countedMaps}});
        pagesReadback.request({first.data + words, 1 + countedMaps});
    }

    /// Queues to mark at the divisor of the last build, and to count the pages at those before it,
    /// which would be enough: consecutive frames mostly need the same.
    void queueMarks(const std::vector<MapRequest>& requests, const MapInputs& inputs) {
        const int steps = requests.empty() ? 0 : lastSteps;
        const uint64_t words = layOutSteps(requests, steps);
        const int counted = words > 0 ? steps : 0;
        queueMark(requests, inputs, counted, counted, words);
    }

    /// Waits for queueMarks, and marks again until the divisor is the least one at which `capacity`
    /// pages are enough, or the greatest there is. Returns how many pages are marked.
    uint64_t markFitting(const std::vector<MapRequest>& requests, const MapInputs& inputs,
                         uint64_t capacity) {
        const auto fits = [&](int step, uint64_t wanted) {
            return wanted <= capacity || divisorOf(step) >= double(kMaxFaceTexels);
        };
        if (requests.empty()) {
            lastSteps = 0;
            return 0;
        }
        View<const uint32_t> found = pagesReadback.wait();
        std::vector<uint64_t> counted;
        const uint32_t* ofMaps = found.data + 1;
        for (int step = 0; step < countedSteps; ++step, ofMaps += requests.size())
            counted.push_back(std::accumulate(ofMaps, ofMaps + requests.size(), uint64_t(0)));
        int step = 0;
        while (step < int(counted.size()) && !fits(step, counted[size_t(step)]))
            ++step;
        for (;; ++step) {
            if (step != markedStep) {
                queueMark(requests, inputs, step, 0, 0);
                found = pagesReadback.wait();
            }
            const uint64_t wanted = found[0];
            if (step == 0)
                counts.pagesWantedCount = wanted;
            if (!fits(step, wanted))
                continue;
            if (!counted.empty())
                counts.pagesWantedCount = counted.front();
            counts.degradeDivisor = float(divisorOf(step));
            lastSteps = step;
            return wanted;
        }
    }

    /// The maps of the requests; the buffer may hold more that are kept.
    View<const ShadowMapInfo> requestMaps() const { return {maps.view().data, infos.size()}; }

    /// Returns whether the CPU's own kernel draws, face by face, and clears new pages itself.
    bool drawsByFace() const {
        return !drawer && backend == Backend::kCpu && !options.useAtomicRasterizer;
    }

    void allocate(const std::vector<MapRequest>& requests, uint64_t wanted, StageTimes& stages) {
        const uint64_t capacity = options.poolBytes / (pageTexelCount() * sizeof(uint32_t));
        std::vector<ShadowMapInfo> all = infos;
        uint64_t words = pageBits.size();
        {
            const StageTimer timer(backend, stages, "page commit");
            cache.begin(all, words, options,
                        options.useStaticOptimization && !requests.empty() && wanted <= capacity);
            maps.take(all);
        }
        cache.allocate(maps.view(), std::as_const(pageBits).view(), std::as_const(firstPage).view(),
                       wanted, !drawsByFace(), counts, stages);
    }

    /// Fetches the counts of the last build from the backend.
    void count() {
        if (isCounted)
            return;
        const std::vector<uint32_t> first = firstPage.download();
        const std::vector<CullCounts> found = cullCounts.download();
        cache.count(counts);
        counts.unsplitTriangleCount = largeTriangles.grow();
        isCounted = true; // not earlier, so that a failed download can be repeated
        const uint64_t wanted = counts.pageCount + counts.pagesRefusedCount;
        pagesPerMap.clear();
        for (size_t i = 0; i < infos.size(); ++i) {
            const auto at = [&](size_t map) -> uint64_t {
                return map < infos.size() ? first[infos[map].pageTableStart / 32] : wanted;
            };
            pagesPerMap.push_back(uint32_t(glm::min(at(i + 1), counts.pageCount) -
                                           glm::min(at(i), counts.pageCount)));
        }
        const size_t parts = cullParts;
        trianglesPerMap.clear();
        for (size_t map = 0; map < infos.size(); ++map) {
            const uint64_t faceCount = infos[map].window.isDirectional() ? 1 : kFaceCount;
            uint32_t triangleFaces = 0;
            for (size_t i = map * parts; i < (map + 1) * parts; ++i) {
                counts.batchFaceCount += found[i].batchFaces;
                triangleFaces += found[i].triangleFaces;
                if (!skips)
                    countSphere(found[i], faceCount);
            }
            counts.triangleDrawCount += triangleFaces;
            trianglesPerMap.push_back(triangleFaces);
        }
    }

    void countSphere(const CullCounts& item, uint64_t faceCount) {
        counts.batchFaceSphereCount += faceCount * item.sphereBatches;
        counts.triangleSphereCount += faceCount * item.sphereTriangles;
    }

    /// Counts what culling left out, by testing everything.
    void countSkipped() {
        count(); // before its lists are overwritten
        if (isSkippedCounted)
            return;
        CullView cull = lastCull;
        cull.kept.openFaces = {};
        StageTimes ignored;
        listReached(cull, false, ignored);
        ignored.settle();
        zero(drawOf, reached.size() + 1);
        runPass(backend, CountDraws{cull, std::as_const(firstReached).view(), reached.view(),
                                    drawOf.view(), cullCounts.view()});
        const std::vector<CullCounts> found = cullCounts.download();
        uint64_t neededPairs = 0, neededTriangles = 0;
        for (size_t i = 0; i < found.size(); ++i) {
            // Of what is drawn some is drawn by now, so only the sums are those of the build.
            neededPairs += found[i].batchFaces + found[i].keptBatchFaces;
            neededTriangles += found[i].triangleFaces + found[i].keptTriangleFaces;
            countSphere(found[i], infos[i / cull.parts()].window.isDirectional() ? 1 : kFaceCount);
        }
        counts.batchFaceKeptCount = neededPairs - counts.batchFaceCount;
        counts.triangleKeptCount = neededTriangles - counts.triangleDrawCount;
        isSkippedCounted = true;
    }

    /// Turns the counts of all items, which are followed by a 0, into offsets, and allocates the
    /// list: `guess` elements, or, when it is 0, as many as needed.
    void placeList(Buffer<uint32_t>& firstOfItem, Buffer<BatchDraw>& list, size_t guess) {
        if (guess > 0) {
            prefixSums(backend, std::as_const(firstOfItem).view(), firstOfItem.view());
            list.resize(guess);
            return;
        }
        const uint64_t count =
            firstOfItem.size() > 1
                ? exclusiveScan(backend, std::as_const(firstOfItem).view(), firstOfItem.view())
                : 0;
        if (count > 0xffffffffull)
            throw Error(ErrorKind::kResource, "shadow maps: " + std::to_string(count) +
                                                  " (batch, map) pairs exceed 32-bit indices; use "
                                                  "fewer maps");
        list.resize(count);
    }

    /// Returns the input of culling, and prepares its masks.
    CullView prepareCulling(const BatchView& onBackend, StageTimes& stages) {
        CullView cull{requestMaps(), masks(), onBackend, options.culling, {}};
        const StageTimer timer(backend, stages, "culling masks");
        if (cells.size()) {
            if (cache.keeps())
                cull.kept = cache.prepareCulling(maps.view(), masks(), options.culling);
            else
                runPass(backend, GatherBlock{cells.view(), blocks.view()});
            cull.cells = {std::as_const(cells).view(), std::as_const(blocks).view()};
        }
        return cull;
    }

    /// Lists the batches that maps reach.
    /// @param isGuessed allocates lists of the guessed lengths, those of the draws as well
    void listReached(const CullView& cull, bool isGuessed, StageTimes& stages) {
        const StageTimer timer(backend, stages, "culling query");
        cullParts = cull.parts();
        const size_t items = infos.size() * cullParts;
        cullCounts.resize(items);
        firstReached.resize(items + 1);
        drawOf.resize(isGuessed ? reachedGuess.get() + 1 : 0);
        draws.resize(isGuessed ? drawGuess.get() : 0);
        fillAll(backend, {firstReached, drawOf, draws}); // draws: of no face
        runPass(backend, CountReached{cull, {firstReached.view().data, items}, cullCounts.view()});
        placeList(firstReached, reached, isGuessed ? reachedGuess.get() : 0);
        runPass(backend, ListReached{cull, std::as_const(firstReached).view(), reached.view()});
    }

    /// Lists the draws, after the batches that are reached.
    /// @param isGuessed as listReached had it; cullLengths then gives the lengths needed
    void listDraws(const CullView& cull, bool isGuessed, StageTimes& stages) {
        const StageTimer timer(backend, stages, "culling tests");
        const View<const uint32_t> firstOfItem = std::as_const(firstReached).view();
        if (!isGuessed)
            zero(drawOf, reached.size() + 1);
        runPass(backend,
                CountDraws{cull, firstOfItem, reached.view(), drawOf.view(), cullCounts.view()});
        placeList(drawOf, draws, isGuessed ? drawGuess.get() : 0);
        runPass(backend, ListDraws{std::as_const(reached).view(), std::as_const(drawOf).view(),
                                   draws.view()});
        if (isGuessed) {
            runPass(backend,
                    NoteCullLengths{firstOfItem, std::as_const(drawOf).view(), cullLengths.view()});
            lengthsReadback->request(std::as_const(cullLengths).view());
        } else if (!infos.empty()) {
            reachedGuess.note(reached.size());
            drawGuess.note(draws.size());
        }
    }

    /// Returns whether lengths may be guessed: they fit 32 bits, and those of the last build are
    /// known.
    bool mayGuess() const {
        return isGuessing && reachedGuess.get() > 0 && !infos.empty() &&
               uint64_t(infos.size()) * batchCount <= 0xffffffffull;
    }

    /// Waits for the lengths that were guessed. Returns whether the lists were long enough; their
    /// excess is removed.
    bool trimDraws() {
        const View<const uint32_t> lengths = lengthsReadback->wait();
        const size_t reachedCount = lengths[kReachedLength], drawCount = lengths[kDrawLength];
        if (reachedCount > reached.size() || drawCount > draws.size())
            return false;
        reached.resize(reachedCount);
        draws.resize(drawCount);
        reachedGuess.note(reachedCount);
        drawGuess.note(drawCount);
        return true;
    }

    /// Returns the first draw of every map, and their number last, limited to the lists. On the
    /// CPU.
    std::vector<uint32_t> drawStarts() const {
        SDAG_ASSERT(backend == Backend::kCpu);
        std::vector<uint32_t> start;
        for (size_t map = 0; map <= infos.size(); ++map) {
            const size_t entry =
                glm::min(size_t(firstReached.view()[map * cullParts]), reached.size());
            start.push_back(uint32_t(glm::min(size_t(drawOf.view()[entry]), draws.size())));
        }
        return start;
    }
};

namespace {

/// A build that ends by an exception leaves maps that do not match the cache.
struct ForgetUnlessDone {
    PageCache& cache;
    bool isDone = false;

    ~ForgetUnlessDone() {
        if (!isDone)
            cache.forget();
    }
};

} // namespace

// The parts of a triangle that fills a face, one per page.
static_assert((kMaxFaceTexels / 16) * (kMaxFaceTexels / 16) <= kMaxSplitParts);

ShadowMaps::ShadowMaps(Backend backend, MapDrawer* drawer)
    : state_(std::make_unique<State>(backend, drawer)) {
    SDAG_ASSERT(!drawer || backend == Backend::kCpu);
    guessLengths(backend == Backend::kCuda);
}
ShadowMaps::~ShadowMaps() = default;

void ShadowMaps::guessLengths(bool isOn, size_t spare) {
    State& s = *state_;
    s.isGuessing = isOn;
    s.reachedGuess.forget(spare);
    s.drawGuess.forget(spare);
    if (isOn && !s.lengthsReadback) {
        s.cullLengths.resize(kCullLengths);
        s.lengthsReadback = std::make_unique<Readback>(s.backend, kCullLengths);
    }
}

void ShadowMaps::build(const std::vector<MapRequest>& requests,
                       const std::vector<Box>& receiverBoxes,
                       const std::vector<MapReceiver>& receivers, const TriangleView& geometry,
                       const BatchView& batches, const ShadowMapOptions& options,
                       StageTimes& stages, View<const uint32_t> movedBatches) {
    check(requests, options);
    check(requests, receiverBoxes, receivers);
    State& s = *state_;
    {
        const StageTimer timer(s.backend, stages, "page masks");
        s.receiverBoxes.set(receiverBoxes);
        s.receivers.set(receivers);
    }
    const BoxPageMarker marker(s.backend, s.receiverBoxes.view(), s.receivers.view());
    MapInputs inputs{s.receiverBoxes.view(), s.receivers.view(), geometry, batches, marker, false};
    if (s.backend != Backend::kCpu) {
        const StageTimer timer(s.backend, stages, "geometry copy");
        s.geometry.set(geometry, batches);
        inputs.geometry = s.geometry.triangles();
        inputs.batches = s.geometry.batches(batches);
    }
    build(requests, inputs, batches, options, stages, movedBatches);
    stages.settle();
}

void ShadowMaps::build(const std::vector<MapRequest>& requests, const MapInputs& inputs,
                       const BatchView& batches, const ShadowMapOptions& options,
                       StageTimes& stages, View<const uint32_t> movedBatches) {
    State& s = *state_;
    ForgetUnlessDone guard{s.cache}; // first: moved batches are not named again after a refusal
    check(requests, options);
    if (!std::isfinite(options.lodTexels) || options.lodTexels < 0.0f)
        refuse("level of detail by " + std::to_string(options.lodTexels) + " texels",
               "choose a number of texels >= 0; 0 is full detail");
    if (options.lodTexels > 0.0f && batches.levels.empty() && batches.batches.count > 0)
        refuse("level of detail by " + std::to_string(options.lodTexels) +
                   " texels, but the batches have one level",
               "pass the batches of PolygonLod");
    for (const uint32_t batch : movedBatches)
        if (batch >= batches.batches.count)
            refuse("moved batch " + std::to_string(batch) + " of " +
                       std::to_string(batches.batches.count),
                   "give indices of the passed batches");
    // Nothing is drawn without requests, so kept maps could not follow motion meanwhile.
    if (!(options == s.options) || batches.batches.count != s.batchCount || requests.empty())
        s.cache.forget();
    s.batchCount = batches.batches.count;
    s.options = options;
    s.counts = {};
    // For a build that ends by an exception: nothing was counted.
    s.isCounted = s.isSkippedCounted = true;
    s.pagesPerMap.clear();
    s.trianglesPerMap.clear();

    {
        const StageTimer timer(s.backend, stages, "page masks");
        s.queueMarks(requests, inputs);
    }
    BatchView onBackend = inputs.batches;
    onBackend.levels.allowedTexels = options.lodTexels;
    const bool isGuessed = s.mayGuess();
    // Which batches are reached depends on the maps' resolutions with levels of detail alone.
    // Without them the device lists them while the host waits for the numbers of pages.
    const bool isListedEarly = isGuessed && options.lodTexels == 0.0f;
    if (isListedEarly)
        s.listReached({s.requestMaps(), {}, onBackend, options.culling, {}}, true, stages);
    if (options.useStaticOptimization && !requests.empty()) {
        const StageTimer timer(s.backend, stages, "page commit");
        s.cache.noteMotion(batches, movedBatches, inputs.areMovedNamed);
    }
    uint64_t wanted = 0;
    {
        const StageTimer timer(s.backend, stages, "page masks");
        wanted = s.markFitting(requests, inputs,
                               options.poolBytes / (s.pageTexelCount() * sizeof(uint32_t)));
    }
    s.allocate(requests, wanted, stages);
    const CullView cull = s.prepareCulling(onBackend, stages);
    s.lastCull = cull;
    if (!isListedEarly)
        s.listReached(cull, isGuessed, stages);
    s.listDraws(cull, isGuessed, stages);
    const auto draw = [&](bool isFirst) {
        const StageTimer timer(s.backend, stages, "rasterization");
        const RasterView raster{s.requestMaps(),
                                s.cache.openTable(),
                                s.cache.pool(),
                                s.pageTexelsLog2(),
                                inputs.geometry,
                                onBackend.batches,
                                onBackend.triangles,
                                std::as_const(s.draws).view(),
                                onBackend.maxTriangleCount};
        if (s.drawer)
            s.drawer->draw(raster, std::as_const(s.cache).pageTable());
        else if (s.drawsByFace()) {
            s.pageFloors.resize(raster.depths.count / s.pageTexelCount());
            const View<PageFloor> floors = s.pageFloors.view();
            std::fill(floors.begin(), floors.end(), PageFloor{0, PageFloors::kUnknownRows});
            PagesToClear fresh;
            if (isFirst)
                fresh = {s.cache.freshEntries(), std::as_const(s.cache).pageTable()};
            rasterizeByFace(raster, onBackend.vertices, s.drawStarts(), onBackend.boxesWorld,
                            floors, fresh);
        } else
            rasterizeTriangles(s.backend, raster, s.largeTriangles, s.largeSetups);
    };
    draw(true);
    // Drawing is queued before the lengths are waited for, so that the device stays busy.
    if (isGuessed && !s.trimDraws()) {
        ++s.counts.listRerunCount;
        s.listReached(cull, false, stages);
        s.listDraws(cull, false, stages);
        draw(false); // drawing twice has no effect
    }
    if (s.cache.keeps()) {
        const StageTimer timer(s.backend, stages, "rasterization");
        s.cache.noteDrawn(std::as_const(s.cells).view());
    }
    guard.isDone = true;
    s.isCounted = false;
    s.skips = s.cache.keeps();
    s.isSkippedCounted = !s.skips;
}

ShadowMapView ShadowMaps::view() const {
    const State& s = *state_;
    return {s.requestMaps(), s.cache.pageTable(), s.cache.pool(), s.pageTexelsLog2()};
}

void ShadowMaps::forget() {
    state_->cache.reset();
    state_->isSkippedCounted = true; // of maps that are gone
    state_->maps.forget();
    state_->stepMaps.forget();
    state_->lastSteps = 0;
    state_->reachedGuess.forget();
    state_->drawGuess.forget();
}

View<const uint32_t> ShadowMaps::projectionMaps() const {
    const State& s = *state_;
    return {s.projection.view().data, s.infos.size() * kProjectionWordsPerMap};
}

void ShadowMaps::countSkipped() {
    state_->countSkipped();
}

const ShadowMapCounts& ShadowMaps::counts() const {
    state_->count();
    return state_->counts;
}
const std::vector<uint32_t>& ShadowMaps::pagesPerMap() const {
    state_->count();
    return state_->pagesPerMap;
}
const std::vector<uint32_t>& ShadowMaps::trianglesPerMap() const {
    state_->count();
    return state_->trianglesPerMap;
}

} // namespace shadowdag
