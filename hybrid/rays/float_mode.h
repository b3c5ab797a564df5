// SPDX-License-Identifier: Apache-2.0
// The processor's float mode that Embree wants, for as long as a scope lasts.
#pragma once

#include <xmmintrin.h>

namespace shadowdag {

/// Sets flush-to-zero and denormals-are-zero on the calling thread and restores the former mode at
/// the end of the scope. The mode belongs to a thread: every task of a parallel loop that calls
/// Embree opens a scope of its own, because a mode left behind on a worker would change what later
/// tasks on it compute. Only for files that call Embree.
class EmbreeFloatMode {
public:
    EmbreeFloatMode() : saved_(_mm_getcsr()) {
        _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero);
    }
    ~EmbreeFloatMode() { _mm_setcsr(saved_); }
    EmbreeFloatMode(const EmbreeFloatMode&) = delete;
    EmbreeFloatMode& operator=(const EmbreeFloatMode&) = delete;

private:
    static constexpr unsigned kFlushToZero = 1u << 15;
    static constexpr unsigned kDenormalsAreZero = 1u << 6;
    unsigned saved_;
};

} // namespace shadowdag
