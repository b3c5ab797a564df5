// SPDX-License-Identifier: Apache-2.0
// The processor's float mode that Embree wants, for as long as a scope lasts.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#elif !defined(__aarch64__)
#error "name the register of this processor that holds its float mode"
#endif

namespace shadowdag {

/// Returns the calling thread's register that holds its float mode: MXCSR or FPCR. That of x86
/// processors also holds the exceptions that have occurred, in its lowest six bits.
inline uint64_t floatModeRegister() {
#if defined(__x86_64__)
    return _mm_getcsr();
#else
    uint64_t value;
    asm volatile("mrs %0, fpcr" : "=r"(value));
    return value;
#endif
}
inline void setFloatModeRegister(uint64_t value) {
#if defined(__x86_64__)
    _mm_setcsr(unsigned(value));
#else
    asm volatile("msr fpcr, %0" : : "r"(value));
#endif
}

/// Sets flush-to-zero and denormals-are-zero on the calling thread and restores the former mode at
/// the end of the scope. The mode belongs to a thread: every task of a parallel loop that calls
/// Embree opens a scope of its own, because a mode left behind on a worker would change what later
/// tasks on it compute. Only for files that call Embree.
class EmbreeFloatMode {
public:
    EmbreeFloatMode() : saved_(floatModeRegister()) { setFloatModeRegister(saved_ | kNoDenormals); }
    ~EmbreeFloatMode() { setFloatModeRegister(saved_); }
    EmbreeFloatMode(const EmbreeFloatMode&) = delete;
    EmbreeFloatMode& operator=(const EmbreeFloatMode&) = delete;

private:
#if defined(__x86_64__)
    static constexpr uint64_t kNoDenormals = 1u << 15 | 1u << 6; // FTZ, DAZ
#else
    static constexpr uint64_t kNoDenormals = 1u << 24; // FZ: of operands and results
#endif
    uint64_t saved_;
};

} // namespace shadowdag
