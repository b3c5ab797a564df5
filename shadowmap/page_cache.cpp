// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/page_cache.h"

#include "cuda/fill_pass.h"
#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/map_drawer.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace shadowdag {
namespace {

template <class T> void zero(Buffer<T>& buffer, size_t count) {
    buffer.resize(count);
    buffer.fill(0);
}

uint64_t wordsOf(const ShadowMapInfo& map) {
    return (uint64_t(kFaceCount) * map.facePages * map.facePages + 31) / 32;
}

/// Returns whether two maps hold the same texels, wherever their page tables are. The sphere around
/// the scene, which is the position and range of a directional light, does not matter.
bool isSameMap(ShadowMapInfo a, const ShadowMapInfo& b) {
    a.pageTableStart = b.pageTableStart;
    if (!(a.lightPositionWorld == b.lightPositionWorld) && isMutant(Mutant::kMapsKeptStale))
        a.lightPositionWorld = b.lightPositionWorld;
    if (a.window.isDirectional()) {
        a.lightPositionWorld = b.lightPositionWorld;
        a.rangeWorld = b.rangeWorld;
    }
    return a == b;
}

/// Returns whether two maps differ at most in resolution or, for a directional light, in the part
/// of the world that they cover.
bool isSameLight(ShadowMapInfo a, const ShadowMapInfo& b) {
    if (a.window.isDirectional() || b.window.isDirectional())
        return a.window.w == b.window.w && a.window.w0 == b.window.w0;
    a.faceTexels = b.faceTexels;
    a.facePages = b.facePages;
    return isSameMap(a, b);
}

} // namespace

PageCache::PageCache(Backend backend, MapDrawer* drawer)
    : backend_(backend), drawer_(drawer), startBefore_(backend, "shadowmap page table moves"),
      slots_(backend, "shadowmap map slots"), freshSlots_(backend, "shadowmap new map slots"),
      pageTable_(backend, "shadowmap page table"),
      tableBefore_(backend, "shadowmap page table before"),
      openTable_(backend, "shadowmap open page table"), marked_(backend, "shadowmap marked pages"),
      movedBefore_(backend, "shadowmap moved boxes before"),
      movedNow_(backend, "shadowmap moved boxes"), movedBits_(backend, "shadowmap moved batches"),
      pageStamps_(backend, "shadowmap page stamps"), pageKeys_(backend, "shadowmap page keys"),
      pageEntries_(backend, "shadowmap page entries"), order_(backend, "shadowmap page order"),
      freeRank_(backend, "shadowmap free page ranks"), missing_(backend, "shadowmap missing pages"),
      keptPerMap_(backend, "shadowmap kept pages of map"),
      keptCounts_(backend, "shadowmap kept page counts"),
      freshEntries_(backend, "shadowmap fresh pages"), pool_(backend, "shadowmap page pool"),
      drawnCells_(backend, "shadowmap drawn cells"),
      drawnDepths_(backend, "shadowmap drawn depths"),
      openBlocks_(backend, "shadowmap open blocks"), openFaces_(backend, "shadowmap open faces"),
      openRows_(backend, "shadowmap open cells") {}

void PageCache::reset() {
    forget();
    for (Resident<uint32_t>* before : {&slots_, &startBefore_, &movedBits_})
        before->forget(); // the next uploads depend on these
    heldPages_ = 0;
}

void PageCache::forget() {
    kept_.clear();
    isSlotUsed_.clear();
    drawnCells_.resize(0);
    drawnDepths_.resize(0);
    batchBoxes_.clear();
    for (Buffer<uint32_t>* ofPool : {&pool_, &pageStamps_, &pageEntries_, &pageKeys_})
        ofPool->resize(0); // their memory stays
    now_ = 0;
}

uint32_t PageCache::takeSlot() {
    const auto free = std::find(isSlotUsed_.begin(), isSlotUsed_.end(), uint8_t(0));
    const uint32_t slot = uint32_t(free - isSlotUsed_.begin());
    if (free == isSlotUsed_.end())
        isSlotUsed_.push_back(1);
    else
        *free = 1;
    return slot;
}

void PageCache::begin(std::vector<ShadowMapInfo>& maps, uint64_t& wordCount,
                      const ShadowMapOptions& options, bool keeps) {
    keeps_ = keeps;
    retains_ = options.retainsPages;
    pageTexelsLog2_ = 0;
    while (1u << pageTexelsLog2_ < options.pageTexels)
        ++pageTexelsLog2_;
    capacityPages_ = options.poolBytes / (pageTexels() * sizeof(uint32_t));
    requestCount_ = maps.size();
    keptRequestCount_ = 0;
    if (!keeps)
        forget();
    ++now_;

    // Kept maps by light.
    std::vector<uint32_t> byLight(kept_.size());
    std::iota(byLight.begin(), byLight.end(), 0u);
    std::stable_sort(byLight.begin(), byLight.end(), [&](uint32_t a, uint32_t b) {
        return kept_[a].info.light < kept_[b].info.light;
    });
    std::vector<uint8_t> isUsed(kept_.size(), 0), isGone(kept_.size(), 0);
    std::vector<KeptMap> next;
    std::vector<uint32_t> startBefore;
    std::vector<uint32_t> fresh; // positions in next
    for (size_t i = 0; i < maps.size(); ++i) {
        uint32_t found = kNoPage;
        const uint32_t light = maps[i].light;
        auto at = std::lower_bound(byLight.begin(), byLight.end(), light,
                                   [&](uint32_t a, uint32_t l) { return kept_[a].info.light < l; });
        for (; at != byLight.end() && kept_[*at].info.light == light; ++at) {
            if (!isSameLight(kept_[*at].info, maps[i]))
                isGone[*at] = 1; // the light moved
            else if (found == kNoPage && !isUsed[*at] && isSameMap(kept_[*at].info, maps[i]))
                found = *at;
        }
        if (found != kNoPage) {
            isUsed[found] = 1;
            ++keptRequestCount_;
            next.push_back({maps[i], kept_[found].slot});
            startBefore.push_back(kept_[found].info.pageTableStart);
        } else {
            fresh.push_back(uint32_t(next.size()));
            next.push_back({maps[i], 0});
            startBefore.push_back(kNoPage);
        }
    }
    for (size_t k = 0; k < kept_.size(); ++k) {
        if (isUsed[k])
            continue;
        const uint64_t words = wordsOf(kept_[k].info);
        if (!retains_ || isGone[k] || kept_[k].pageCount == 0 ||
            (wordCount + words) * 32 > 0xffffffffull) {
            isSlotUsed_[kept_[k].slot] = 0;
            continue;
        }
        next.push_back(kept_[k]);
        startBefore.push_back(kept_[k].info.pageTableStart);
        next.back().info.pageTableStart = uint32_t(wordCount * 32);
        maps.push_back(next.back().info);
        wordCount += words;
    }
    freshSlotsHost_.clear();
    isTableSame_ = keeps && wordCount * 32 == pageTable_.size();
    for (size_t i = 0; i < next.size() && isTableSame_; ++i)
        isTableSame_ = startBefore[i] == next[i].info.pageTableStart;
    if (keeps) {
        for (const uint32_t i : fresh) {
            next[i].slot = takeSlot();
            freshSlotsHost_.push_back(next[i].slot);
        }
        std::vector<uint32_t> slots;
        for (const KeptMap& map : next)
            slots.push_back(map.slot);
        slots_.take(std::move(slots));
        startBefore_.take(std::move(startBefore));
        kept_ = std::move(next);
    }
    if (!isTableSame_) {
        std::swap(pageTable_, tableBefore_);
        pageTable_.resize(wordCount * 32);
    }
    marked_.resize(0);
}

void PageCache::noteMotion(const BatchView& hostBatches, View<const uint32_t> movedBatches,
                           bool areAllNamed) {
    const size_t count = hostBatches.boxesWorld.count;
    std::vector<uint32_t> bits((count + 31) / 32, 0);
    if (batchBoxes_.size() != count)
        batchBoxes_.assign(hostBatches.boxesWorld.begin(), hostBatches.boxesWorld.end());
    const auto isMoved = [&](size_t batch) { return (bits[batch / 32] >> batch % 32 & 1u) != 0; };
    const auto mark = [&](size_t batch) { bits[batch / 32] |= 1u << batch % 32; };
    for (const uint32_t batch : movedBatches)
        mark(batch);
    for (size_t batch = 0; batch < count && !areAllNamed; ++batch)
        if (!(batchBoxes_[batch] == hostBatches.boxesWorld[batch]))
            mark(batch);
    if (isMutant(Mutant::kPagesKeptStale))
        std::fill(bits.begin(), bits.end(), 0u);
    if (!hostBatches.levels.empty()) {
        // Motion may change an instance's level of detail, and with it all its batches.
        const size_t parts = hostBatches.levels.partBoxes.count;
        std::vector<uint8_t> hasMoved(parts, 0);
        for (size_t batch = 0; batch < count; ++batch)
            hasMoved[hostBatches.batches[batch].instance % parts] |= isMoved(batch);
        for (size_t batch = 0; batch < count; ++batch)
            if (hasMoved[hostBatches.batches[batch].instance % parts])
                mark(batch);
    }
    std::vector<Box> before, now;
    for (size_t word = 0; word < bits.size(); ++word)
        for (uint32_t left = bits[word]; left != 0; left &= left - 1) {
            const size_t batch = word * 32 + size_t(std::countr_zero(left));
            before.push_back(batchBoxes_[batch]);
            now.push_back(hostBatches.boxesWorld[batch]);
            batchBoxes_[batch] = now.back();
        }
    movedBits_.take(std::move(bits));
    movedBefore_.upload(before);
    movedNow_.upload(now);
}

void PageCache::sortOut(View<const ShadowMapInfo> maps, View<const uint32_t> needed) {
    const size_t slotCount = isSlotUsed_.size();
    drawnCells_.growKeeping(slotCount * kCellsPerMap);
    drawnDepths_.growKeeping(slotCount * kFaceCount);
    freshSlots_.upload(freshSlotsHost_);
    runPass(backend_, EmptySlots{std::as_const(freshSlots_).view(), drawn()});
    if (!isTableSame_)
        runPass(backend_, CarryPages{maps, startBefore_.view(), std::as_const(tableBefore_).view(),
                                     pageTable_.view()});
    const size_t poolPages = pageStamps_.size();
    marked_.resize(movedBefore_.size() ? pageTable_.size() / 32 : 0);
    pageKeys_.resize(poolPages);
    keptPerMap_.resize(maps.count);
    keptCounts_.resize(kKeptPageCounts);
    fillAll(backend_, {marked_, pageKeys_, keptPerMap_, keptCounts_});
    if (movedBefore_.size())
        runPass(backend_,
                MarkUnder{maps, slots_.view(), std::as_const(drawnDepths_).view(),
                          std::as_const(movedBefore_).view(), marked_.view(), pageTexelsLog2_});
    pageEntries_.resize(poolPages);
    missing_.resize(needed.count);
    runPass(backend_,
            SortOutPages{maps, needed, std::as_const(marked_).view(), pageTable_.view(),
                         pageStamps_.view(), pageKeys_.view(), pageEntries_.view(), missing_.view(),
                         keptPerMap_.view(), keptCounts_.view(), now_, retains_});
}

void PageCache::allocate(View<const ShadowMapInfo> maps, View<const uint32_t> needed,
                         View<const uint32_t> firstPage, uint64_t wanted, bool clears,
                         ShadowMapCounts& counts, StageTimes& stages) {
    const uint64_t pages = glm::min(wanted, capacityPages_);
    // If no page is retained, exactly the needed pages are in use, however many of them were kept,
    // so the host need not wait for the counts.
    isCountPending_ = keeps_ && !retains_ && !drawer_ && backend_ == Backend::kCuda;
    uint64_t fresh = pages, retained = 0, stale = 0; // if pending: at most so many are fresh
    AssignPages assign{needed, firstPage, pageTable_.view(), {}, {}, {}, {}, {}, 0, now_};
    PageCommits commits;
    bool isCommitted = false;
    {
        const StageTimer timer(backend_, stages, "page commit");
        if (keeps_) {
            SDAG_ASSERT(wanted <= capacityPages_);
            sortOut(maps, needed);
            prefixSums(backend_, std::as_const(missing_).view(), missing_.view());
            uint64_t held = 0;
            if (!isCountPending_) {
                const std::vector<uint32_t> found = keptCounts_.download();
                fresh = found[kPagesMissing];
                stale = found[kPagesStale];
                retained = found[kPagesRetained];
                held = found[kPagesHeld] + retained;
            }
            // Grow in larger steps up to the budget, because growing copies the content. Memory of
            // frames before that were forgotten is used again, and taken in the same steps.
            const uint64_t poolPages = pageStamps_.size(), needed = held + fresh;
            const auto step = [](uint64_t count) { return count + count / 2; };
            if (needed > poolPages) {
                const uint64_t roomy = glm::min(capacityPages_, glm::max(needed, step(poolPages)));
                const uint64_t room =
                    glm::min(capacityPages_, glm::max(roomy, step(pageStamps_.capacity())));
                if (!drawer_)
                    pool_.growKeeping(roomy * pageTexels(), room * pageTexels());
                for (Buffer<uint32_t>* ofPages : {&pageStamps_, &pageEntries_, &pageKeys_})
                    ofPages->growKeeping(roomy, room);
                pageKeys_.fillFrom(poolPages, 0);
            }
            if (isCountPending_ || (fresh && held)) {
                order_.resize(pageKeys_.size());
                assign.order = std::as_const(order_).view();
                if (retains_) {
                    runPass(backend_, NumberPages{order_.view()});
                    sortPairs(backend_, pageKeys_.view(), order_.view());
                    assign.pageKeys = std::as_const(pageKeys_).view();
                    assign.pageEntries = std::as_const(pageEntries_).view();
                } else { // none is evicted
                    const View<const uint32_t> keys = std::as_const(pageKeys_).view();
                    freeRank_.resize(keys.count);
                    runPass(backend_, MarkFreePages{keys, freeRank_.view()});
                    prefixSums(backend_, std::as_const(freeRank_).view(), freeRank_.view());
                    runPass(backend_,
                            ListFreePages{keys, std::as_const(freeRank_).view(), order_.view()});
                }
            }
            assign.firstPage = std::as_const(missing_).view();
            assign.pageStamps = pageStamps_.view();
            const uint64_t free = pageStamps_.size() - held;
            retained -= fresh > free ? fresh - free : 0;
            // Only maps that are not requested are checked for remaining pages.
            const std::vector<uint32_t> keptPages =
                requestCount_ < kept_.size() ? keptPerMap_.download() : std::vector<uint32_t>{};
            for (size_t i = 0; i < kept_.size(); ++i)
                kept_[i].pageCount = i < requestCount_ ? 1 : keptPages[i];
        } else {
            pageTable_.fill(0xff);
            if (!drawer_)
                pool_.resize(pages * pageTexels());
        }
        if (drawer_)
            drawer_->makeRoom(keeps_ ? pageStamps_.size() : pages, pageTexelsLog2_, keeps_);
        freshEntries_.resize(fresh);
        assign.freshEntries = freshEntries_.view();
        assign.poolPages = uint32_t(fresh);
        runPass(backend_, assign);
        isCommitted = drawer_ && drawer_->commit(maps, std::as_const(freshEntries_).view(),
                                                 std::as_const(pageTable_).view(), commits);
    }
    FreshPages freshPages{std::as_const(freshEntries_).view(), {}};
    if (isCountPending_)
        freshPages.usedCount = {std::as_const(keptCounts_).view().data + kPagesMissing, 1};
    {
        const StageTimer timer(backend_, stages, "page clear");
        if (drawer_)
            drawer_->clear(std::as_const(freshEntries_).view(), std::as_const(pageTable_).view());
        else if (clears)
            runPass(backend_, ClearPages{freshPages, std::as_const(pageTable_).view(), pool_.view(),
                                         pageTexelsLog2_});
        if (keeps_)
            runPass(backend_, ResetCells{maps, freshPages, drawn(), pageTexelsLog2_});
    }

    counts.pageCount = pages;
    counts.pagesRefusedCount = wanted - pages;
    counts.texelCount = pages * pageTexels();
    heldBefore_ = heldPages_;
    heldPages_ = heldAfter_ = pages + retained;
    counts.pagesRetainedCount = retained;
    if (!isCountPending_)
        countFresh(fresh, stale, counts);
    if (isCommitted) {
        counts.pagesCommittedCount = commits.committedCount;
        counts.pagesFreedCount = commits.freedCount;
    }
    counts.keptMapCount = keptRequestCount_;
    counts.mapBytes = heldPages_ * pageTexels() * sizeof(uint32_t) + pageTable_.bytes() +
                      (keeps_ ? drawnCells_.bytes() : 0);
}

void PageCache::countFresh(uint64_t fresh, uint64_t stale, ShadowMapCounts& counts) const {
    counts.pagesCommittedCount = fresh - stale;
    counts.pagesClearedCount = fresh;
    counts.pagesFreedCount = heldBefore_ + counts.pagesCommittedCount - heldAfter_;
}

void PageCache::count(ShadowMapCounts& counts) {
    if (!isCountPending_)
        return;
    const std::vector<uint32_t> found = keptCounts_.download();
    isCountPending_ = false;
    countFresh(found[kPagesMissing], found[kPagesStale], counts);
}

KeptView PageCache::prepareCulling(View<const ShadowMapInfo> maps, const CullMaskView& masks,
                                   MapCulling culling) {
    openBlocks_.resize(masks.blocks.count);
    zero(openFaces_, masks.blocks.count / kBlocksPerMap);
    runPass(backend_, PrepareBlock{masks, culling, drawn(), openBlocks_.view(), openFaces_.view()});
    if (movedNow_.size()) {
        runPass(backend_,
                LowerCells{
                    maps, std::as_const(movedNow_).view(), {masks.cells, masks.blocks}, drawn()});
        zero(marked_, pageTable_.size() / 32);
        runPass(backend_, MarkUnder{maps,
                                    slots_.view(),
                                    {},
                                    std::as_const(movedNow_).view(),
                                    marked_.view(),
                                    pageTexelsLog2_});
    }
    const size_t entries = requestCount_ < maps.count && requestCount_ > 0
                               ? kept_[requestCount_].info.pageTableStart
                               : pageTable_.size();
    openTable_.resize(requestCount_ > 0 ? entries : 0);
    openRows_.resize(masks.cells.count / kProjectionMapSize);
    runPass(backend_, ListOpenCells{masks.cells, drawn(), openRows_.view()});
    // What moved may have opened cells after their faces were found closed.
    const View<const uint32_t> openFaces = std::as_const(openFaces_).view();
    runPass(backend_,
            ListOpenPages{maps, std::as_const(openRows_).view(), std::as_const(marked_).view(),
                          movedNow_.size() ? View<const uint32_t>{} : openFaces,
                          std::as_const(pageTable_).view(), openTable_.view(), pageTexelsLog2_});
    return {std::as_const(drawnCells_).view(), slots_.view(), std::as_const(openBlocks_).view(),
            std::as_const(openFaces_).view(), movedBits_.view()};
}

void PageCache::noteDrawn(View<const uint32_t> cells) {
    runPass(backend_, RaiseDrawn{cells, drawn()});
}

} // namespace shadowdag
