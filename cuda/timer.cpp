// SPDX-License-Identifier: Apache-2.0
#include "cuda/timer.h"

#include "cuda/device.h"

namespace shadowdag {

QueueMark::QueueMark() : mark_(device::recordMark()) {}

QueueMark::~QueueMark() {
    device::releaseMark(mark_);
}

void QueueMark::wait() const {
    device::waitForMark(mark_);
}

double QueueMark::msSince(const QueueMark& begin) const {
    return device::msBetween(begin.mark_, mark_);
}

} // namespace shadowdag
