// SPDX-License-Identifier: Apache-2.0
#include "gl/slices.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace shadowdag {

namespace {

constexpr uint64_t kFirstShare = 64; // share of the first piece, whose time is unknown
constexpr double kMostGrowth = 32;   // a short piece's time is mostly its call's

std::mutex pollMutex;
std::function<void()> pollFunction;

void poll() {
    std::function<void()> ask;
    {
        const std::lock_guard lock(pollMutex);
        ask = pollFunction;
    }
    if (ask)
        ask();
}

} // namespace

void setGlPoll(std::function<void()> poll) {
    const std::lock_guard lock(pollMutex);
    pollFunction = std::move(poll);
}

bool GlSlices::next() {
    using Clock = std::chrono::steady_clock;
    if (end_ == 0) {
        size_ = std::max(count_ / kFirstShare, uint64_t(1));
    } else {
        context_.finish(what_);
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
        const double growth = std::min(kSliceMs / std::max(ms, 1e-3), kMostGrowth);
        size_ = std::max(uint64_t(double(size_) * growth), uint64_t(1));
    }
    if (end_ == count_)
        return false;
    poll();
    begin_ = end_;
    end_ = std::min(begin_ + size_, count_);
    start_ = Clock::now();
    return true;
}

} // namespace shadowdag
