// SPDX-License-Identifier: Apache-2.0
#include "cuda/readback.h"

#include "cuda/buffer.h"
#include "cuda/device.h"
#include "cuda/macros.h"

#include <algorithm>
#include <new>
#include <string>

namespace shadowdag {

Readback::Readback(Backend backend, size_t wordCount) : backend_(backend) {
    reserve(wordCount);
}

void Readback::reserve(size_t wordCount) {
    if (wordCount <= host_.count)
        return;
    release();
    const size_t bytes = wordCount * sizeof(uint32_t);
    void* const words = backend_ == Backend::kCuda ? device::allocatePinned(bytes)
                                                   : ::operator new(bytes, std::nothrow);
    if (!words)
        throw Error(ErrorKind::kResource, "no " + std::to_string(bytes) +
                                              " bytes of host memory for a readback; close other "
                                              "programs");
    host_ = {static_cast<uint32_t*>(words), wordCount};
}

Readback::~Readback() {
    release();
}

void Readback::release() {
    if (!host_.data)
        return;
    try {
        // A copy that is queued still writes, even if there was no mark to be had behind it.
        mark_ ? mark_->wait() : synchronize(backend_);
    } catch (const Error&) { // the queue failed, and writes no more
    }
    if (backend_ == Backend::kCuda)
        device::releasePinned(host_.data);
    else
        ::operator delete(host_.data);
    host_ = {};
    mark_.reset();
}

void Readback::request(View<const uint32_t> words) {
    if (words.count > host_.count)
        reserve(2 * words.count);
    asked_ = words.count;
    mark_.reset();
    detail::countReadback(words.count * sizeof(uint32_t));
    if (backend_ == Backend::kCuda) {
        device::downloadLater(host_.data, words.data, words.count * sizeof(uint32_t));
        mark_ = std::make_unique<QueueMark>();
    } else {
        std::copy(words.begin(), words.end(), host_.begin());
    }
}

View<const uint32_t> Readback::wait() {
    if (mark_)
        mark_->wait();
    return {host_.data, asked_};
}

} // namespace shadowdag
