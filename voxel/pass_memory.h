// SPDX-License-Identifier: Apache-2.0
// The lists of a build by passes, allocated from a budget. Internal to this folder.
#pragma once

#include "cuda/pass.h"
#include "cuda/runs.h"
#include "cuda/scan_sort.h"
#include "voxel/unique_nodes_pass.h"

#include <algorithm>
#include <string>
#include <utility>

namespace shadowdag {

/// Thrown if a budget is too small for an allocation; a caller that can use less memory catches it.
struct OverBudget {
    uint64_t bytes; ///< the total that would have been held
};

/// A limit of the bytes held at a time. Outlives the allocations from it.
class PassBudget {
public:
    explicit PassBudget(uint64_t bytes) : limit_(bytes) {}
    PassBudget(const PassBudget&) = delete;

    void take(uint64_t bytes) {
        if (bytes > limit_ || held_ > limit_ - bytes)
            throw OverBudget{held_ + bytes};
        held_ += bytes;
        peak_ = std::max(peak_, held_);
    }
    void giveBack(uint64_t bytes) { held_ -= bytes; }
    uint64_t heldBytes() const { return held_; }
    uint64_t peakBytes() const { return peak_; }

private:
    uint64_t limit_, held_ = 0, peak_ = 0;
};

/// Holds bytes of a budget that others allocate. Move-only.
class Reservation {
public:
    Reservation(PassBudget& budget, uint64_t bytes) : budget_(&budget), bytes_(bytes) {
        budget.take(bytes);
    }
    Reservation(Reservation&& other) noexcept
        : budget_(other.budget_), bytes_(std::exchange(other.bytes_, 0)) {}
    Reservation& operator=(Reservation&& other) noexcept {
        std::swap(budget_, other.budget_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~Reservation() { budget_->giveBack(bytes_); }

private:
    PassBudget* budget_;
    uint64_t bytes_;
};

/// `count` elements on a backend, taken from a budget. Move-only.
template <class T> class PassList {
public:
    PassList(PassBudget& budget, Backend backend, const std::string& name, size_t count)
        : taken_(budget, count * sizeof(T)), buffer_(backend, name, count) {}

    View<T> view() { return buffer_.view(); }
    View<const T> view() const { return buffer_.view(); }
    size_t size() const { return buffer_.size(); }
    Buffer<T>& buffer() { return buffer_; }
    const Buffer<T>& buffer() const { return buffer_; }

private:
    Reservation taken_;
    Buffer<T> buffer_;
};

using Words = PassList<uint32_t>;
using LongWords = PassList<uint64_t>;

/// What one entry of a list may be numbered by.
constexpr uint64_t kMaxPassList = 0xfffffffeull;

/// Makes lists on a backend and has the operations that every step of a build needs. All throw
/// OverBudget.
struct PassMemory {
    PassMemory(Backend ofBackend, uint64_t budgetBytes) : backend(ofBackend), budget(budgetBytes) {}

    Backend backend;
    PassBudget budget;

    Words words(const char* name, size_t count) { return {budget, backend, name, count}; }
    LongWords longWords(const char* name, size_t count) { return {budget, backend, name, count}; }
    /// Returns count + 1 words, of which the last is 0: counts, and offsets after a scan.
    Words places(const char* name, size_t count) {
        Words list = words(name, count + 1);
        detail::fillBytes(backend, list.view().data + count, 0, sizeof(uint32_t));
        return list;
    }
    /// Turns counts into offsets and returns their sum.
    size_t scan(Words& list) {
        const uint64_t total = exclusiveScan(backend, std::as_const(list).view(), list.view());
        if (total > kMaxPassList)
            throw OverBudget{total * sizeof(uint64_t)};
        return size_t(total);
    }
    /// Sorts keys and reorders `order` with them; the copies that sorting needs are counted.
    void sort(LongWords& keys, Words& order) {
        const Reservation scratch(budget, keys.size() * (sizeof(uint64_t) + sizeof(uint32_t)));
        sortPairs(backend, keys.view(), order.view());
    }
    /// Returns 0, 1, ...
    Words counting(const char* name, size_t count) {
        Words order = words(name, count);
        runPass(backend, CountUp{order.view()});
        return order;
    }
    /// Number of runs, and the most of the budget that they take.
    struct HeldRuns {
        Reservation taken;
        Runs runs;
        HeldRuns(PassMemory& memory, size_t itemCount)
            : taken(memory.budget, 2 * (itemCount + 1) * sizeof(uint32_t)),
              runs(memory.backend, "voxelize") {}
    };
    HeldRuns runsOf(const LongWords& keys, uint32_t shift) {
        HeldRuns held(*this, keys.size());
        listRuns(backend, keys.view(), shift, held.runs);
        return held;
    }
};

} // namespace shadowdag
