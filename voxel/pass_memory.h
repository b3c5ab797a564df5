// SPDX-License-Identifier: Apache-2.0
// Lists of a build by passes, taken from a budget and given back to it. Not for other folders.
#pragma once

#include "cuda/buffer.h"

#include <algorithm>
#include <utility>

namespace shadowdag {

/// Thrown by a budget that does not hold what is asked for; whoever can do with less catches it.
struct OverBudget {
    uint64_t bytes; ///< all that would have been held
};

/// Bytes that may be held at a time. Outlives what was taken from it.
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

} // namespace shadowdag
