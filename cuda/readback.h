// SPDX-License-Identifier: Apache-2.0
// A copy to the host that is requested early and awaited late: work that is queued in between runs
// meanwhile, so that the device is not idle while the host waits for the values.
#pragma once

#include "cuda/timer.h"
#include "cuda/view.h"

#include <cstdint>
#include <memory>

namespace shadowdag {

/// Not copyable; one request at a time.
class Readback {
public:
    /// @param wordCount the words that requests have space for at first
    /// Throws Error kResource when there is no memory for them.
    explicit Readback(Backend backend, size_t wordCount = 0);
    ~Readback();
    Readback(const Readback&) = delete;
    Readback& operator=(const Readback&) = delete;

    /// Requests words in the state that the work queued before leaves them in. Makes space for
    /// twice as many if they are more than ever before; throws Error kResource when there is none.
    void request(View<const uint32_t> words);
    /// Returns them when they have arrived; valid until the next request. Does not wait for work
    /// that was queued after it. Throws Error kDevice when work before it failed.
    View<const uint32_t> wait();

private:
    void release();
    void reserve(size_t wordCount);

    Backend backend_;
    View<uint32_t> host_; // pinned on CUDA
    size_t asked_ = 0;
    std::unique_ptr<QueueMark> mark_;
};

} // namespace shadowdag
