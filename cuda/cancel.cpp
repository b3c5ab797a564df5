// SPDX-License-Identifier: Apache-2.0
#include "cuda/cancel.h"

#include <atomic>

namespace shadowdag {

namespace {

std::atomic<void (*)(double)> pollFunction{nullptr};

} // namespace

void setCpuPoll(void (*poll)(double fraction)) {
    pollFunction = poll;
}

void pollCpu(double fraction) {
    if (void (*const poll)(double) = pollFunction.load(std::memory_order_relaxed))
        poll(fraction);
}

} // namespace shadowdag
