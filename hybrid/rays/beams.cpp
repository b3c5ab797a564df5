// SPDX-License-Identifier: Apache-2.0
// Longer than 500 lines: cells, rows and lists share one memory, and what makes, finds, grows and
// moves them relies on the same order of writes.
#include "hybrid/rays/beams.h"

#include "cuda/error.h"
#include "cuda/large_pages.h"
#include "cuda/mutant.h"
#include "hybrid/rays/beam_stream.h"
#include "scenes/split_mix.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <string>
#include <utility>

namespace shadowdag {

/// A beam of a cell.
struct BeamCache::Entry {
    std::atomic<uint32_t> light{0}; ///< of lightIds_, written last; 0: no beam
    uint32_t lightIndex = 0;
    uint32_t first = 0; ///< where the list begins in the memory, in units of 4 bytes
    BeamKind kind = BeamKind::kOpen;
    uint8_t count = 0; ///< of leaves
};

/// The beams of a cell, by light. Never full.
struct BeamCache::Row {
    uint32_t capacity; ///< a power of two; so many entries follow
    uint32_t count;

    Entry* entries() { return reinterpret_cast<Entry*>(this + 1); }
    const Entry* entries() const { return reinterpret_cast<const Entry*>(this + 1); }
    static uint32_t hashOf(uint32_t light) { return light * 0x9e3779b9u >> 8; }
    /// Returns the entry of a light, or the empty one where it would be.
    Entry& at(uint32_t light) {
        for (uint32_t i = hashOf(light);; ++i) {
            Entry& entry = entries()[i & (capacity - 1)];
            const uint32_t found = entry.light.load(std::memory_order_acquire);
            if (found == light || found == 0)
                return entry;
        }
    }
};

struct alignas(64) BeamCache::Cell {
    uint64_t key;
    Box box; ///< of starts that the beams hold for
    uint32_t planeCount;
    const BeamPlane* planes;          ///< of receivers that they hold for
    std::atomic<Row*> row{nullptr};   ///< null: no beams
    std::atomic<uint32_t> frame{0};   ///< the last that asked for it
    uint32_t beamCount = 0, work = 0; ///< made so far, and what their lists cost, in leaves
    std::atomic<bool> isSplit{false};
    std::atomic<bool> isBusy{false}; ///< a thread adds a beam

    bool holdsFor(const Box& starts, const BeamPlanes& receivers) const {
        return contains(box, starts) &&
               (planeCount > BeamPlanes::kMax ||
                (!receivers.areMany() &&
                 std::all_of(receivers.planes, receivers.planes + receivers.count,
                             [this](const BeamPlane& plane) {
                                 return std::find(planes, planes + planeCount, plane) !=
                                        planes + planeCount;
                             })));
    }
    void lock() {
        while (isBusy.exchange(true, std::memory_order_acquire)) {
        }
    }
    void unlock() { isBusy.store(false, std::memory_order_release); }
};

namespace {

/// Leaves that a search may find; some are then left out.
constexpr uint32_t kMaxFound = 48;
constexpr size_t kAlign = 16;
/// A cell with a row for a few lights takes more.
constexpr uint64_t kBytesPerSlot = 256;
constexpr uint32_t kFramesBetweenCompactions = 32;
/// What the rays of an open beam cost, in leaves of a list.
constexpr uint32_t kOpenLeaves = 24;
/// A cell is divided after so many beams where they cost more leaves each.
constexpr uint32_t kBeamsBeforeSplit = 4, kSplitLeaves = 3;

constexpr size_t kLeastRow = 8;

/// Returns whether a row has no room for one more; an entry stays empty.
bool isFull(size_t count, size_t capacity) {
    return 8 * (count + 1) > 7 * capacity;
}

size_t slotCountFor(uint64_t bytes) {
    size_t count = 1;
    while (2 * count * kBytesPerSlot <= bytes)
        count *= 2;
    return count;
}

uint8_t* reserve(uint64_t bytes) {
    const size_t rounded = (bytes + kLargePageBytes - 1) / kLargePageBytes * kLargePageBytes;
    void* memory = std::aligned_alloc(kLargePageBytes, rounded);
    if (!memory)
        throw Error(ErrorKind::kResource, "no memory for " + std::to_string(bytes >> 20) +
                                              " MiB of beams; use less with --beams");
    useLargePages(memory, rounded);
    return static_cast<uint8_t*>(memory);
}

/// Returns the box rounded outwards, as the view moves and other starts will come. Axes along which
/// the box is thin stay as they are: that of a floor leaves the floor's own triangles out.
Box rounded(const Box& box, float step, float thin) {
    Box grown = box;
    for (int a = 0; a < 3; ++a)
        if (box.max[a] - box.min[a] > thin) {
            grown.min[a] = std::min(box.min[a], step * std::floor(box.min[a] / step));
            grown.max[a] = std::max(box.max[a], step * std::ceil(box.max[a] / step));
        }
    return grown;
}

} // namespace

void BeamPlanes::add(const BeamPlane& plane) {
    if (areMany() || std::find(planes, planes + count, plane) != planes + count)
        return;
    if (count < kMax)
        planes[count] = plane;
    ++count;
}

BeamCache::BeamCache(StreamIsa isa) : isa_(isa), memory_(nullptr, std::free) {}

BeamCache::~BeamCache() = default;

void BeamCache::forget() {
    memory_.reset();
    used_ = 0;
    maxBytes_ = 0;
    slots_ = std::vector<std::atomic<Cell*>>();
    cellCount_ = 0;
    lights_.clear();
    lightIds_.clear();
    stopMaking();
    madeCount_ = askedCount_ = pairCount_ = 0;
    isMissingKnown_ = false;
    isFull_ = false;
    nextCompaction_ = 0;
}

void BeamCache::begin(const TriangleBvhView& bvh, const TruthGeometry& geometry,
                      View<const Light> lights, uint64_t maxBytes, uint64_t mostMade) {
    if (bvh.nodes.data != bvh_.nodes.data || bvh.leaves.data != bvh_.leaves.data ||
        bvh.root != bvh_.root || geometry.origin != geometry_.origin || maxBytes != maxBytes_)
        forget();
    bvh_ = bvh;
    geometry_ = geometry;
    if (!memory_) {
        slots_ = std::vector<std::atomic<Cell*>>(slotCountFor(maxBytes));
        memory_.reset(reserve(maxBytes));
        maxBytes_ = maxBytes;
    }
    isStill_.assign(lights.count, 1);
    lightIds_.resize(lights.count, 0);
    for (size_t i = 0; i < lights.count; ++i) {
        const bool isKnown = i < lights_.size();
        if (isKnown && lights[i].kind == lights_[i].kind &&
            lights[i].positionWorld == lights_[i].positionWorld)
            continue;
        isStill_[i] = !isKnown;
        lightIds_[i] = nextLightId_++;
    }
    lights_.assign(lights.data, lights.data + lights.count);
    if (isShort() && frame_ >= nextCompaction_) {
        compact();
        if (isShort()) // most of it is in use
            nextCompaction_ = frame_ + kFramesBetweenCompactions;
    }
    ++frame_;
    splitBudget(isFull_ ? 0 : std::min<uint64_t>(mostMade, uint64_t(INT64_MAX)));
    madeCount_ = askedCount_ = pairCount_ = 0;
    for (std::atomic<uint64_t>& missing : missing_)
        missing = 0;
    isMissingKnown_ = true;
    isFrozen_ = false;
}

void BeamCache::splitBudget(uint64_t mostMade) {
    // Those of most rays, as far as the last frame tells that there is room for all of them; what
    // is left over goes to those of fewer.
    uint64_t wanted = missing_[BeamTally::kClasses - 1];
    manyRays_ = BeamTally::kClasses;
    while (manyRays_ > 1 && wanted + missing_[manyRays_ - 2] <= mostMade)
        wanted += missing_[--manyRays_ - 1];
    uint64_t others = manyRays_ == 1 || wanted >= mostMade ? 0 : mostMade - wanted;
    if (!isMissingKnown_) {
        manyRays_ = mostMade == uint64_t(INT64_MAX) ? 1 : BeamTally::kClasses;
        others = manyRays_ == 1 ? 0 : mostMade / 2;
    }
    mayMakeMany_ = int64_t(mostMade - others);
    mayMakeOthers_ = int64_t(others);
}

void BeamCache::stopMaking() {
    mayMakeMany_ = mayMakeOthers_ = 0;
}

void BeamCache::freeze() {
    stopMaking();
    isFrozen_ = true;
}

void BeamCache::add(const BeamTally& tally) {
    if (isFrozen_)
        return;
    askedCount_.fetch_add(tally.pairCount + tally.openCount, std::memory_order_relaxed);
    pairCount_.fetch_add(tally.pairCount, std::memory_order_relaxed);
    for (uint32_t i = 0; i < BeamTally::kClasses; ++i)
        if (tally.missing[i] > 0)
            missing_[i].fetch_add(tally.missing[i], std::memory_order_relaxed);
}

bool BeamCache::isShort() const {
    return used_ > maxBytes_ / 4 * 3 || cellCount_ > slots_.size() / 4 * 3;
}

void* BeamCache::allocate(size_t bytes) {
    const uint64_t size = (bytes + kAlign - 1) / kAlign * kAlign;
    uint64_t first = used_.load(std::memory_order_relaxed);
    do {
        if (first + size > maxBytes_) {
            isFull_ = true;
            stopMaking();
            return nullptr;
        }
    } while (!used_.compare_exchange_weak(first, first + size, std::memory_order_relaxed));
    return memory_.get() + first;
}

BeamCache::Row* BeamCache::makeRow(size_t capacity) {
    void* place = allocate(sizeof(Row) + capacity * sizeof(Entry));
    if (!place)
        return nullptr;
    Row* row = new (place) Row{uint32_t(capacity), 0};
    for (size_t i = 0; i < capacity; ++i)
        new (row->entries() + i) Entry;
    return row;
}

BeamCache::Cell* BeamCache::makeCell(const Box& box, const BeamPlanes& receivers) {
    const uint32_t planeCount = receivers.areMany() ? 0 : receivers.count;
    void* place = allocate(sizeof(Cell) + 64 - kAlign);
    void* planes = place ? allocate(planeCount * sizeof(BeamPlane)) : nullptr;
    if (!planes)
        return nullptr;
    std::uninitialized_copy_n(receivers.planes, planeCount, static_cast<BeamPlane*>(planes));
    place = reinterpret_cast<void*>((reinterpret_cast<uintptr_t>(place) + 63) / 64 * 64);
    Cell* cell = new (place) Cell;
    cell->box = box;
    cell->planeCount = receivers.count;
    cell->planes = static_cast<const BeamPlane*>(planes);
    return cell;
}

size_t BeamCache::slotOf(uint64_t key) const {
    return size_t(splitMix64(key)) & (slots_.size() - 1);
}

BeamCache::Cell* BeamCache::peek(uint64_t key) const {
    const size_t mask = slots_.size() - 1;
    for (size_t slot = slotOf(key);; slot = (slot + 1) & mask) {
        Cell* cell = slots_[slot].load(std::memory_order_acquire);
        if (!cell || cell->key == key)
            return cell;
    }
}

bool BeamCache::isSplit(Cell& cell) const {
    if (!cell.isSplit.load(std::memory_order_relaxed))
        return false;
    touch(cell);
    return true;
}

void BeamCache::touch(Cell& cell) const {
    if (cell.frame.load(std::memory_order_relaxed) != frame_)
        cell.frame.store(frame_, std::memory_order_relaxed);
}

BeamCache::Cell* BeamCache::cellOf(uint64_t key, const Box& starts, const BeamPlanes& receivers,
                                   float size) {
    const size_t mask = slots_.size() - 1;
    for (size_t slot = slotOf(key);; slot = (slot + 1) & mask) {
        Cell* cell = slots_[slot].load(std::memory_order_acquire);
        while (!cell || (cell->key == key && !cell->holdsFor(starts, receivers))) {
            if ((mayMakeMany_.load(std::memory_order_relaxed) <= 0 &&
                 mayMakeOthers_.load(std::memory_order_relaxed) <= 0) ||
                (!cell && cellCount_.load(std::memory_order_relaxed) > slots_.size() / 8 * 7))
                return nullptr;
            Box box = starts;
            BeamPlanes planes = receivers;
            if (cell) {
                box.add(cell->box);
                if (cell->planeCount > BeamPlanes::kMax)
                    planes.count = cell->planeCount;
                else
                    std::for_each_n(cell->planes, cell->planeCount,
                                    [&](const BeamPlane& plane) { planes.add(plane); });
            }
            // A cell that grows again and again soon holds for all of its surface.
            Cell* made =
                makeCell(rounded(box, (cell ? 0.5f : 0.125f) * size, 0.0625f * size), planes);
            if (!made)
                return nullptr;
            made->key = key;
            if (cell)
                made->isSplit.store(cell->isSplit.load(std::memory_order_relaxed),
                                    std::memory_order_relaxed);
            const bool isNew = !cell;
            if (slots_[slot].compare_exchange_strong(cell, made, std::memory_order_acq_rel)) {
                cellCount_.fetch_add(isNew, std::memory_order_relaxed);
                cell = made;
                break; // it holds
            }
        }
        if (cell->key != key)
            continue;
        touch(*cell);
        return cell;
    }
}

void BeamCache::prefetchSlot(uint64_t key) const {
    __builtin_prefetch(&slots_[slotOf(key)]);
}

void BeamCache::prefetchCell(uint64_t key) const {
    __builtin_prefetch(slots_[slotOf(key)].load(std::memory_order_relaxed));
}

void BeamCache::prefetch(const Cell& cell, uint32_t lightIndex) const {
    if (const Row* row = cell.row.load(std::memory_order_acquire))
        __builtin_prefetch(row->entries() +
                           (Row::hashOf(lightIds_[lightIndex]) & (row->capacity - 1)));
}

Beam BeamCache::beamOf(BeamKind kind, uint32_t count, uint32_t first) const {
    const uint32_t* leaf = reinterpret_cast<const uint32_t*>(memory_.get()) + size_t(first);
    return {kind, count, leaf, reinterpret_cast<const uint8_t*>(leaf + count)};
}

Beam BeamCache::find(Cell* cell, uint32_t lightIndex, const glm::vec3& lightLocal,
                     uint32_t rayCount, BeamTally& tally) {
    Beam beam;
    if (Row* row = cell ? cell->row.load(std::memory_order_acquire) : nullptr) {
        const uint32_t light = lightIds_[lightIndex];
        const Entry& entry = row->at(light);
        // An empty entry may have become another light's since.
        if (entry.light.load(std::memory_order_acquire) == light) {
            beam = beamOf(entry.kind, entry.count, entry.first);
            tally.pairCount += beam.kind == BeamKind::kOpen ? 0 : rayCount;
            return beam;
        }
    }
    if (!isStill_[lightIndex])
        return beam;
    std::atomic<int64_t>& mayMake = rayCount >= manyRays_ ? mayMakeMany_ : mayMakeOthers_;
    if (cell && mayMake.load(std::memory_order_relaxed) > 0 &&
        mayMake.fetch_sub(1, std::memory_order_relaxed) > 0)
        beam = make(*cell, lightIndex, lightLocal);
    else
        ++tally.missing[std::min(rayCount, BeamTally::kClasses) - 1];
    tally.pairCount += beam.kind == BeamKind::kOpen ? 0 : rayCount;
    return beam;
}

Beam BeamCache::make(Cell& cell, uint32_t lightIndex, const glm::vec3& lightLocal) {
    uint32_t leaf[kMaxFound];
    uint8_t mask[kMaxFound];
    stream::BeamWork work{};
    work.nodes = bvh_.nodes.data;
    work.leaves = bvh_.leaves.data;
    work.root = bvh_.root;
    for (int a = 0; a < 3; ++a) {
        work.origin[a] = lightLocal[a];
        work.low[a] = cell.box.min[a];
        work.high[a] = cell.box.max[a];
    }
    work.capacity = kMaxFound;
    work.leaf = leaf;
    work.mask = mask;
    if (bvh_.root != kNoTriangleChild)
        stream::findBeam(isa_, work);
    uint32_t count = 0, first = 0;
    if (!work.isDark && !work.isOverflow)
        count = withoutThoseBelow(cell, leaf, mask, work.count);
    BeamKind kind = work.isDark                             ? BeamKind::kDark
                    : work.isOverflow || count > kMaxLeaves ? BeamKind::kOpen
                    : count == 0                            ? BeamKind::kLit
                                                            : BeamKind::kListed;
    if (kind == BeamKind::kListed && isMutant(Mutant::kBeamLit))
        kind = BeamKind::kLit;
    if (kind == BeamKind::kListed) {
        void* list = allocate(count * (sizeof(uint32_t) + 1));
        if (!list)
            return {};
        uint32_t* leaves = static_cast<uint32_t*>(list);
        std::copy_n(leaf, count, leaves);
        std::copy_n(mask, count, reinterpret_cast<uint8_t*>(leaves + count));
        first = uint32_t((static_cast<uint8_t*>(list) - memory_.get()) / sizeof(uint32_t));
    } else {
        count = 0;
    }
    cell.lock();
    const bool isKept = insert(cell, lightIndex, kind, count, first);
    cell.unlock();
    madeCount_.fetch_add(isKept, std::memory_order_relaxed);
    return isKept ? beamOf(kind, count, first) : Beam{};
}

uint32_t BeamCache::withoutThoseBelow(const Cell& cell, uint32_t* leaf, uint8_t* mask,
                                      uint32_t count) const {
    if (cell.planeCount > BeamPlanes::kMax)
        return count;
    const auto isBelow = [&](uint32_t triangle) {
        for (int corner = 0; corner < 3; ++corner) {
            const glm::dvec3 p = geometry_.vertex(triangle, corner);
            for (uint32_t i = 0; i < cell.planeCount; ++i)
                if (!(glm::dot(cell.planes[i].normal, p) <= cell.planes[i].below))
                    return false;
        }
        return true;
    };
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t above = 0;
        for (uint32_t left = mask[i]; left != 0; left &= left - 1) {
            const uint32_t k = uint32_t(__builtin_ctz(left));
            above |= uint32_t(!isBelow(bvh_.leaves[leaf[i]].triangle[k] & ~kCutTriangleTag)) << k;
        }
        if (above == 0)
            continue;
        leaf[kept] = leaf[i];
        mask[kept++] = uint8_t(above);
    }
    return kept;
}

bool BeamCache::insert(Cell& cell, uint32_t lightIndex, BeamKind kind, uint32_t count,
                       uint32_t first) {
    Row* row = cell.row.load(std::memory_order_relaxed);
    if (!row || isFull(row->count, row->capacity)) {
        Row* grown = makeRow(row ? 2 * size_t(row->capacity) : kLeastRow);
        if (!grown)
            return false;
        if (row)
            copyEntries(*row, *grown, nullptr);
        cell.row.store(grown, std::memory_order_release);
        row = grown;
    }
    Entry& entry = row->at(lightIds_[lightIndex]);
    if (entry.light.load(std::memory_order_relaxed) != 0)
        return true; // another thread was faster
    entry.lightIndex = lightIndex;
    entry.first = first;
    entry.kind = kind;
    entry.count = uint8_t(count);
    ++row->count;
    entry.light.store(lightIds_[lightIndex], std::memory_order_release);
    ++cell.beamCount;
    cell.work += kind == BeamKind::kOpen ? kOpenLeaves : count;
    if (cell.beamCount >= kBeamsBeforeSplit && cell.work > kSplitLeaves * cell.beamCount)
        cell.isSplit.store(true, std::memory_order_relaxed);
    return true;
}

bool BeamCache::isCurrent(const Entry& entry) const {
    const uint32_t light = entry.light.load(std::memory_order_relaxed);
    return light != 0 && entry.lightIndex < lightIds_.size() &&
           lightIds_[entry.lightIndex] == light;
}

void BeamCache::copyEntries(const Row& from, Row& to, const uint8_t* memory) {
    for (uint32_t i = 0; i < from.capacity; ++i) {
        const Entry& entry = from.entries()[i];
        if (!isCurrent(entry))
            continue;
        uint32_t first = entry.first;
        if (memory && entry.count > 0) {
            const size_t bytes = entry.count * (sizeof(uint32_t) + 1);
            uint8_t* list = static_cast<uint8_t*>(allocate(bytes));
            if (!list)
                continue;
            std::copy_n(memory + size_t(first) * sizeof(uint32_t), bytes, list);
            first = uint32_t((list - memory_.get()) / ptrdiff_t(sizeof(uint32_t)));
        }
        const uint32_t light = entry.light.load(std::memory_order_relaxed);
        Entry& copy = to.at(light);
        copy.lightIndex = entry.lightIndex;
        copy.first = first;
        copy.kind = entry.kind;
        copy.count = entry.count;
        copy.light.store(light, std::memory_order_relaxed);
        ++to.count;
    }
}

void BeamCache::compact() {
    const std::vector<std::atomic<Cell*>> cells =
        std::exchange(slots_, std::vector<std::atomic<Cell*>>(slots_.size()));
    const auto memory = std::exchange(
        memory_, std::unique_ptr<uint8_t, void (*)(void*)>(reserve(maxBytes_), std::free));
    used_ = 0;
    cellCount_ = 0;
    isFull_ = false;
    for (const std::atomic<Cell*>& slot : cells) {
        const Cell* cell = slot.load(std::memory_order_relaxed);
        if (!cell || cell->frame.load(std::memory_order_relaxed) != frame_)
            continue;
        Row* row = cell->row.load(std::memory_order_relaxed);
        const size_t current =
            row ? size_t(std::count_if(row->entries(), row->entries() + row->capacity,
                                       [&](const Entry& e) { return isCurrent(e); }))
                : 0;
        const bool isSplit = cell->isSplit.load(std::memory_order_relaxed);
        if (current == 0 && !isSplit)
            continue;
        BeamPlanes planes;
        planes.count = cell->planeCount;
        if (!planes.areMany())
            std::copy_n(cell->planes, planes.count, planes.planes);
        Cell* copy = makeCell(cell->box, planes);
        size_t capacity = kLeastRow;
        while (isFull(current, capacity))
            capacity *= 2;
        Row* copiedRow = copy && !isSplit ? makeRow(capacity) : nullptr;
        if (!copy || (!copiedRow && !isSplit))
            break;
        copy->key = cell->key;
        copy->beamCount = cell->beamCount;
        copy->work = cell->work;
        copy->isSplit.store(isSplit, std::memory_order_relaxed);
        if (copiedRow) {
            copyEntries(*row, *copiedRow, memory.get());
            copy->row.store(copiedRow, std::memory_order_relaxed);
        }
        size_t at = slotOf(copy->key);
        while (slots_[at].load(std::memory_order_relaxed))
            at = (at + 1) & (slots_.size() - 1);
        slots_[at].store(copy, std::memory_order_relaxed);
        ++cellCount_;
    }
}

} // namespace shadowdag
